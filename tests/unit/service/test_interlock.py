"""The interlock: a file that says whether the aisles are closed; nothing arms without it."""

from __future__ import annotations

import asyncio
import os
import time
from dataclasses import replace
from pathlib import Path

import pytest

from flightd.adapters.interlock import FileInterlock
from flightd.app.absent_parts import NO_INTERLOCK
from flightd.app.build import interlock_of
from flightd.app.computer_check import ComputerCheck
from flightd.config.schema import load_config
from flightd.core.errors import InputError
from flightd.core.refusal import RecordedRefusal, words
from flightd.core.types import CommandKind, Phase
from flightd.doctor.computer import check_fitness
from flightd.runtime.clock import LoopClock
from flightd.site.site_file import load_site, parse_site, site_toml
from tests.rigs.event_loops import in_real_time
from tests.rigs.waiting import until
from tests.unit.mission.configured import configured
from tests.unit.mission.driven import Flight

CONFIGS = Path(__file__).parents[3] / "configs"
CONFIG = load_config(CONFIGS / "sim.toml")
SITE = load_site(CONFIGS / "site-demo.toml")


@in_real_time
async def test_it_is_closed_only_while_the_file_says_so(tmp_path: Path) -> None:
    path = tmp_path / "value"
    interlock = FileInterlock(path, "1", LoopClock())
    assert not interlock.is_closed
    reading = asyncio.ensure_future(interlock.run())
    try:
        path.write_text("1\n")
        await until(lambda: interlock.is_closed, 20.0)
        path.write_text("0\n")
        await until(lambda: not interlock.is_closed, 20.0)
        path.write_text("1\n")
        await until(lambda: interlock.is_closed, 20.0)
        path.unlink()
        await until(lambda: not interlock.is_closed, 20.0)
    finally:
        reading.cancel()
        await asyncio.wait([reading])
    path.write_text("1\n")
    await until(lambda: not interlock.is_closed, 20.0)  # nobody reads it any more


class Readings:
    """A file that says that the aisles are closed, may be three seconds old, and is read by the second."""

    def __init__(self, path: Path, *, written_ago_s: float = 0.0) -> None:
        self._path = path
        self.now_s = 100.0
        self.interlock = FileInterlock(path, "1", self, max_age_s=3.0)
        path.write_text("1\n")
        self._of_s = time.time() - written_ago_s
        os.utime(path, (self._of_s,) * 2)

    def now_ns(self) -> int:
        """`ports.Clock`."""
        return round(self.now_s * 1e9)

    def write(self, step_s: float = 0.0) -> None:
        """Again, by a time of day that was set by so much."""
        self._of_s += 1.0 + step_s
        self._path.write_text("1\n")
        os.utime(self._path, (self._of_s,) * 2)

    def is_closed(self) -> bool:
        self.now_s += 1.0
        return self.interlock.says_closed(self.now_ns())


def test_what_a_dead_controller_said_last_is_not_believed(tmp_path: Path) -> None:
    for ago_s in (-100.0, 100.0):  # by a clock that was set back since, or of an hour ago
        assert not Readings(tmp_path / "value", written_ago_s=ago_s).is_closed()
    readings = Readings(tmp_path / "value", written_ago_s=1.5)
    assert [readings.is_closed() for _ in range(3)] == [True, True, False]
    readings.write()
    assert [readings.is_closed() for _ in range(5)] == [True] * 4 + [False]


@pytest.mark.parametrize("step_s", [-3600.0, 3600.0])
def test_a_time_of_day_that_is_set_opens_no_aisle(
    step_s: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    readings = Readings(tmp_path / "value")
    assert readings.is_closed()
    now_ns = time.time_ns()
    monkeypatch.setattr(time, "time_ns", lambda: now_ns + round(step_s * 1e9))
    monkeypatch.setattr(time, "time", lambda: now_ns * 1e-9 + step_s)
    assert readings.is_closed(), "what was written before is as old as it was"
    readings.write(step_s)
    assert readings.is_closed()
    assert [readings.is_closed() for _ in range(3)] == [True, True, True]
    assert not readings.is_closed(), "and dies all the same"


def test_a_site_that_demands_one_is_not_flown_without() -> None:
    demanding = replace(SITE, interlock=True)
    assert parse_site(site_toml(demanding), "again") == demanding

    class Clock:
        def now_ns(self) -> int:
            return 0

    assert interlock_of(CONFIG, SITE, Clock()) is NO_INTERLOCK
    with pytest.raises(InputError, match=r"interlock.file: site demo demands it.*name the file"):
        interlock_of(CONFIG, demanding, Clock())
    config = CONFIG.with_values(interlock={"file": Path("/run/aisle")})
    assert isinstance(interlock_of(config, SITE, Clock()), FileInterlock)


def test_with_an_open_aisle_nothing_starts_or_arms() -> None:
    flight = Flight(configured(autostart=True))
    flight.set(aisle_closed=False)
    flight.run(5.0, follow=False)
    assert (str(flight.mission.phase), flight.mission.reason) == ("preflight", "the aisle is not closed")
    flight.order(CommandKind.START)
    flight.set(aisle_closed=True)
    flight.run(0.04, follow=False)
    assert str(flight.mission.phase) == "arming"
    flight.set(aisle_closed=False)
    flight.run(0.04, follow=False)
    assert flight.phase is Phase.ABORTED


def test_what_the_check_before_the_flight_finds_keeps_it_on_the_ground_and_is_told() -> None:
    flight = Flight(configured(autostart=True))
    flight.set(unfit=RecordedRefusal("FS_GCS_ENABLE is 0, expected 5"))
    flight.run(10.0, follow=False)
    assert flight.phase is Phase.PREFLIGHT
    assert flight.mission.reason == "not fit to fly: FS_GCS_ENABLE is 0, expected 5"
    told = [event.text for event in flight.mission.drain_events() if event.name == "unfit"]
    assert told == ["FS_GCS_ENABLE is 0, expected 5"]


def test_this_computer_is_looked_at_without_waiting(tmp_path: Path) -> None:
    lost = CONFIG.with_values(recorder={"folder": tmp_path / "file" / "folder"})
    (tmp_path / "file").write_text("no folder")
    assert "file" in words(ComputerCheck(lambda: check_fitness(lost, SITE)).unfit)
