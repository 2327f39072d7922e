"""An autopilot whose clock runs at another rate than ours, or begins anew: its times are put right."""

from __future__ import annotations

import asyncio
import math
import random
from collections.abc import Callable
from typing import Any

import pytest

from flightd.adapters.vehicle.mavlink.services.clock_offset import ClockSync
from flightd.runtime.clock import LoopClock
from flightd.sim.autopilot.autopilot import PeerConfig
from flightd.sim.autopilot.radio import RadioParams
from tests.rigs.event_loops import virtual
from tests.rigs.vehicles import ardupilot_rig, px4_rig

MS = 1_000_000
START_NS = 5_000_000_000_000


class Compared:
    """A clock and one that runs `rate` faster, compared by trips of `least_ms` and a random rest."""

    def __init__(self, rate: float, least_ms: float = 1.0, jitter_ms: float = 1.0, seed: int = 1) -> None:
        self.sync = ClockSync()
        self._rng = random.Random(seed)
        self._least_ms, self._jitter_ms = least_ms, jitter_ms
        self._rate, self._since_ns, self._theirs_ns = rate, START_NS, 7_000 * MS
        self.now_ns = START_NS

    def theirs_ns(self, ours_ns: int) -> int:
        return self._theirs_ns + round((ours_ns - self._since_ns) * (1.0 + self._rate))

    def change_rate(self, rate: float) -> None:
        self._theirs_ns, self._since_ns = self.theirs_ns(self.now_ns), self.now_ns
        self._rate = rate

    def run(self, seconds: float, *, answered: bool = True) -> float:
        """The largest error of a time of theirs just now, ms."""
        worst = 0.0
        for _ in range(round(seconds / 0.2)):
            asked = self.sync.ask(self.now_ns)
            there, back = (
                round((self._least_ms / 2 + self._rng.expovariate(1.0) * self._jitter_ms / 2) * MS)
                for _ in range(2)
            )
            if answered:
                told_ns = self.theirs_ns(asked + there)
                assert self.sync.answered(asked, told_ns, asked + there + back)
            for part in (0.25, 0.5, 0.75, 1.0):
                ours_ns = self.now_ns + round(part * 200 * MS)
                found = self.sync.to_ours(self.theirs_ns(ours_ns))
                assert found is not None
                worst = max(worst, abs(found - ours_ns) / MS)
            self.now_ns += 200 * MS
        return worst


@pytest.mark.parametrize("rate", [0.015, -0.015, 50e-6, 0.05])
def test_a_clock_at_another_rate_is_known_to_a_few_ms(rate: float) -> None:
    clocks = Compared(rate)
    clocks.run(2.0)
    assert clocks.run(300.0) < 2.0
    assert clocks.sync.rate == pytest.approx(rate, abs=5e-4)
    assert clocks.sync.error_s(clocks.now_ns) < 0.003


def test_a_jittery_radio_and_a_strange_rate_are_still_told_apart() -> None:
    clocks = Compared(0.015, least_ms=20.0, jitter_ms=20.0)
    clocks.run(5.0)
    assert clocks.run(120.0) < 12.0
    assert clocks.sync.error_s(clocks.now_ns) < 0.02


def test_a_long_way_is_flown_by_where_its_delay_is_the_same_all_the_time() -> None:
    """What uneven ways put wrong is constant, and found with the camera's delay; what changes is told."""
    for seed in range(5):
        long = Compared(0.0, least_ms=120.0, jitter_ms=30.0, seed=seed)
        long.run(6.0)
        assert max(_errors_s(long)) < 0.02
    endless = Compared(0.0, least_ms=400.0, jitter_ms=1.0)
    endless.run(6.0)
    assert endless.sync.error_s(endless.now_ns) > 0.05


def _errors_s(clocks: Compared) -> list[float]:
    """What is told of the error, in each second of a minute."""
    return [clocks.sync.error_s(clocks.now_ns) for _ in range(60) if clocks.run(1.0) >= 0.0]


def test_a_rate_that_changes_at_once_is_found_within_a_second() -> None:
    clocks = Compared(0.0)
    clocks.run(10.0)
    clocks.change_rate(0.03)
    assert clocks.run(1.6) < 40.0
    assert clocks.run(20.0) < 5.0


def test_the_error_is_told_and_grows_when_nothing_answers() -> None:
    clocks = Compared(0.015)
    assert math.isnan(clocks.sync.error_s(clocks.now_ns))
    clocks.run(10.0)
    before_s = clocks.sync.error_s(clocks.now_ns)
    clocks.run(10.0, answered=False)
    assert clocks.sync.error_s(clocks.now_ns) > max(0.02, 5 * before_s)


@pytest.mark.parametrize("ahead_ms", [40, 300])
def test_a_lone_message_stamped_ahead_of_its_time_moves_nothing(ahead_ms: int) -> None:
    clocks = Compared(0.0)
    clocks.run(10.0)
    for _ in range(50):  # as many others as an autopilot sends
        clocks.sync.heard(clocks.theirs_ns(clocks.now_ns), clocks.now_ns + MS)
    clocks.sync.heard(clocks.theirs_ns(clocks.now_ns) + ahead_ms * MS, clocks.now_ns + MS)
    assert clocks.run(8.0) < 2.0
    assert clocks.sync.error_s(clocks.now_ns) < 0.003


RIGS: dict[str, Callable[[PeerConfig], Any]] = {"ardupilot": ardupilot_rig, "px4": px4_rig}


@pytest.mark.parametrize("ppm", [15_000.0, -15_000.0])
@pytest.mark.parametrize("name", list(RIGS))
def test_attitudes_keep_their_age_when_the_autopilots_clock_runs_off(name: str, ppm: float) -> None:
    """Its times saw-toothed by up to 240 ms while the clocks were taken to run alike."""

    async def test() -> None:
        radio = RadioParams(delay_s=0.002)
        async with RIGS[name](PeerConfig(ready_s=0.5, clock_ppm=ppm, radio=radio)) as rig:
            await rig.take_off(1.5)
            clock, ages_ms = LoopClock(), []
            rig.vehicle.attitudes()
            for _ in range(4000):
                await rig.stream(0.005, hz=200.0)
                ages_ms += [(clock.now_ns() - a.stamp_ns) / MS for a in rig.vehicle.attitudes()]
                await asyncio.sleep(0)
            assert len(ages_ms) > 900
            assert max(ages_ms) < 14.0  # the radio, one step of 5 ms, whole milliseconds
            assert rig.known().clock_error_s < 0.003
            assert rig.known().stamps_refused == 0

    virtual(test())


@pytest.mark.parametrize("name", list(RIGS))
def test_attitudes_are_taken_on_when_the_boot_time_begins_anew_after_49_days(name: str) -> None:
    """Every later one was refused, and the clocks were never compared again."""

    async def test() -> None:
        async with RIGS[name](PeerConfig(ready_s=0.5, clock_ppm=0.0)) as rig:
            rig.peer.jump_clock((2**32 - 30_000) * MS)
            await rig.take_off(1.5)
            rig.vehicle.attitudes()
            clock, ages_ms = LoopClock(), []
            while rig.peer.boot_clock_ns(clock.now_ns()) < (2**32 + 5_000) * MS:
                await rig.stream(0.02)
                ages_ms += [(clock.now_ns() - a.stamp_ns) / MS for a in rig.vehicle.attitudes()]
            assert max(ages_ms) < 30.0
            assert rig.known().stamps_refused == 0
            assert clock.now_ns() - rig.known().height_stamp_ns < 200 * MS

    virtual(test())
