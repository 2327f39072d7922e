"""For all tests: Hypothesis repeats its examples, and no test depends on the machine's speed.

Those marked `realtime` do depend on it: see `tests.rigs.machine`; those in a browser may."""

from __future__ import annotations

import os
import re
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings
from xdist.scheduler.loadscope import LoadScopeScheduling

from tests.command import Command
from tests.rigs.machine import Meter, Needs, Patience
from tests.rigs.recorded_flight import fly_once

settings.register_profile(
    "flightd", deadline=None, derandomize=True, database=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("flightd")

_COSTLY = {
    "tests/bench/test_vision_cost.py",
    "tests/replay/test_decisions.py",
    "tests/replay/test_log_command.py",
    "tests/replay/test_playback.py",
    "tests/replay/test_report.py",
    "tests/replay/test_report_inventory.py",
    "tests/sim/flights/test_scan_flight.py",
    "tests/sim/ideal/test_height_changes.py",
    "tests/sim/pictures/test_shelf_reading.py",
    "tests/unit/cli/test_vision_commands.py",
    "tests/unit/foxglove/test_logged_for_viewers.py",
    "tests/web/test_flight_folder.py",
    "tests/web/test_flight_functions.py",
    "tests/web/test_flight_fuzz.py",
    "tests/web/test_flights_api.py",
    "tests/web/test_navigation.py",
    "tests/web/test_studio_api.py",
}
_ON_ONE_DATABASE = "tests/unit/ground_store/"
_IN_BROWSER = re.compile(r"tests/web/test_(?:\w*page|language)\.py")
"""Each starts a Chromium, and a station for all its tests."""
_PAGES_WITHIN = 0.9
"""Of the flights: by then all pages have begun."""
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
    """Whole flights first, and spread among them what needs a browser: a flight computes, a page mostly
    waits, and one that began last would keep one core busy while the other waits.  Of those by the clock come
    last what needs little of the machine: they are short.  What the machine's speed may make fail, by the
    clock or in a browser, is tried once more, and told."""
    for item in items:
        if _cores_of(item) or _IN_BROWSER.match(item.nodeid):
            item.add_marker(pytest.mark.flaky(reruns=1))
    flights = [item for item in items if "/sim/" in item.nodeid]
    flights.sort(key=lambda item: item.get_closest_marker("slow") is None)
    turn = {item.nodeid: number / len(flights) for number, item in enumerate(flights)}
    pages = list(dict.fromkeys(_module(item.nodeid) for item in items if _IN_BROWSER.match(item.nodeid)))
    among = {module: _PAGES_WITHIN * number / len(pages) for number, module in enumerate(pages)}
    items.sort(
        key=lambda item: (-_cores_of(item), turn.get(item.nodeid, among.get(_module(item.nodeid), 1.0)))
    )


def _module(nodeid: str) -> str:
    return nodeid.partition("::")[0]


def _cores_of(item: pytest.Item) -> float:
    """What a test that flies by the clock needs free; 0: another one."""
    marker = item.get_closest_marker("realtime")
    return 0.0 if marker is None else Needs(**marker.kwargs).cores


class _CostlyTogether(LoadScopeScheduling):  # type: ignore[misc]  # its library has no types
    """The tests of a module that share what took long to make stay on one worker; others go anywhere."""

    def _split_scope(self, nodeid: str) -> str:
        if nodeid.startswith(_ON_ONE_DATABASE):
            return _ON_ONE_DATABASE
        module = _module(nodeid)
        return module if module in _COSTLY or _IN_BROWSER.fullmatch(module) else nodeid


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> LoadScopeScheduling:
    return _CostlyTogether(config, log)


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
