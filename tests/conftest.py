"""For all tests: Hypothesis repeats its examples, and no test depends on the machine's speed.

Those marked `realtime` do depend on it: see `tests.rigs.machine`; those in a browser may."""

from __future__ import annotations

import gc
import os
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

from tests.command import Command
from tests.rigs.machine import Meter, Needs, Patience
from tests.rigs.recorded_flight import fly_once
from tests.rigs.schedule import FromBothEnds, cores_of, in_browser, in_order

settings.register_profile(
    "flightd", deadline=None, derandomize=True, database=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("flightd")

_IN_CI = os.environ.get("CI", "") == "true"
_PATIENCE = pytest.StashKey[Patience]()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addini(
        "realtime_patience_s",
        "how long all tests that fly by the clock wait together for a quiet machine",
        default="120" if _IN_CI else "10",
    )


def pytest_configure(config: pytest.Config) -> None:
    config.stash[_PATIENCE] = Patience(float(config.getini("realtime_patience_s")))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What the machine's speed may make fail, by the clock or in a browser, is tried once more, and told."""
    for item in items:
        if cores_of(item) or in_browser(item.nodeid):
            item.add_marker(pytest.mark.flaky(reruns=1))
    in_order(items)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """What a run has collected stays to its end: nobody looks through it for garbage again and again, and
    for what flights leave behind more rarely than a program with little memory would."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
        gc.freeze()
        gc.set_threshold(20_000, 20, 20)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> FromBothEnds:
    return FromBothEnds(config, log)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, object, object]:
    """A test that flies by the clock is skipped on a machine too busy for it; in CI it flies all the same.
    When it fails, that counts unless others took meanwhile what it needs."""
    marker = item.get_closest_marker("realtime")
    if marker is None:
        return (yield)
    needs = Needs(**marker.kwargs)
    missing = item.config.stash[_PATIENCE].wait_for(needs)
    if missing and not _IN_CI:
        pytest.skip(missing)
    meter = Meter()
    try:
        with meter.running():
            return (yield)
    except (Exception, pytest.fail.Exception) as failure:
        if missing := needs.missing(meter.load):
            said = str(failure).partition("\n")[0]
            pytest.skip(f"{missing}; it failed by {type(failure).__name__}: {said}")
        raise
    finally:
        item.user_properties.append(("machine", str(meter.load)))


@pytest.fixture(scope="session")
def recorded_flight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a simulated flight's files, flown once in a run of the tests; nobody writes there."""
    own = tmp_path_factory.getbasetemp()
    return fly_once(own.parent if "PYTEST_XDIST_WORKER" in os.environ else own)


@pytest.fixture
def flightd(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Command:
    """The command line."""
    return Command(monkeypatch, capsys)
