"""A climb rate that is told no more: the height's takes its place where thrust is ours, elsewhere none."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from functools import partial
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.climb_check import ClimbCheck
from flightd.core.types import Demand
from flightd.sim.autopilot.autopilot import PeerConfig
from tests.protocol.mavlink.scripted_autopilot import ScriptedAutopilot, known, scripted
from tests.rigs.event_loops import virtual
from tests.rigs.vehicles import Rig, ardrone_rig, ardupilot_rig, px4_rig

CLIMB_MESSAGES = frozenset(
    {
        dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED,
        dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
        dialect.MAVLINK_MSG_ID_VFR_HUD,
    }
)
TICK_NS, READING_NS = 20_000_000, 50_000_000
SINK_MPS = 0.3
raw_rig = partial(ardupilot_rig, PeerConfig(ready_s=0.5, parameters={"GUID_OPTIONS": 8}))
by_thrust = pytest.mark.parametrize("make", [raw_rig, px4_rig], ids=["ardupilot", "px4"])


class Sinking:
    """A check of a vehicle that sinks steadily, by a range finder with 20 samples a second."""

    def __init__(self) -> None:
        self.check = ClimbCheck()
        self.now_ns = 10**9

    def believed(self, told_mps: float, seconds: float, *, reads: bool = True) -> list[float]:
        """What is believed at each tick meanwhile."""
        rates = []
        for _ in range(round(seconds * 1e9 / TICK_NS)):
            self.now_ns += TICK_NS
            sampled_ns = self.now_ns // READING_NS * READING_NS
            if reads:
                self.check.height(sampled_ns, 9.0 - SINK_MPS * sampled_ns * 1e-9)
            rates.append(self.check.believed_mps(self.now_ns, told_mps, -SINK_MPS))
        return rates


def test_a_rate_that_is_missing_for_a_moment_is_not_replaced() -> None:
    sinking = Sinking()
    sinking.believed(-0.31, 2.0)
    for _ in range(5):
        assert all(math.isnan(rate_mps) for rate_mps in sinking.believed(math.nan, 0.38))
        assert not sinking.check.by_height
        assert set(sinking.believed(-0.31, 0.1)) == {-0.31}


def test_the_heights_rate_takes_the_place_of_one_that_is_told_no_more_until_it_is_told_again() -> None:
    sinking = Sinking()
    sinking.believed(-0.31, 2.0)
    late = sinking.believed(math.nan, 2.0)[21:]
    assert late == pytest.approx([-SINK_MPS] * len(late), abs=0.01)
    assert sinking.check.by_height
    assert not sinking.check.contradicted
    assert set(sinking.believed(-0.31, 0.1)) == {-0.31}
    assert not sinking.check.by_height


def test_without_heights_nothing_takes_its_place() -> None:
    sinking = Sinking()
    sinking.believed(-0.31, 2.0)
    sinking.believed(math.nan, 1.0)
    assert all(math.isnan(rate_mps) for rate_mps in sinking.believed(math.nan, 1.0, reads=False)[15:])


@pytest.mark.parametrize("stuck_at_s", [0.0, 2.0], ids=["from the floor on", "in the climb"])
def test_a_height_that_sticks_does_not_contradict_a_rate_that_the_loop_has_not_yet_brought_down(
    stuck_at_s: float,
) -> None:
    """1.05 m/s instead of 0.8, as long as the hover thrust is held for more than it is."""
    check, told_mps = ClimbCheck(), 1.05
    for tick in range(1, 250):
        sampled_ns = tick * TICK_NS // READING_NS * READING_NS
        check.height(10**9 + sampled_ns, round(0.1 + told_mps * min(sampled_ns * 1e-9, stuck_at_s), 2))
        assert check.believed_mps(10**9 + tick * TICK_NS, told_mps, 0.8) == told_mps


@pytest.mark.parametrize("told_mps", [0.0, 0.3, 1.05])
@pytest.mark.parametrize("wanted_mps", [-0.3, 0.8])
def test_a_rate_that_sticks_is_contradicted_by_a_height_that_goes_where_thrust_pushes(
    told_mps: float, wanted_mps: float
) -> None:
    """The vehicle follows the push at half of what it should, and is fast within a second all the same."""
    check, height_m, true_mps = ClimbCheck(), 5.0, told_mps
    for tick in range(1, 100):
        true_mps += 2.0 * (wanted_mps - told_mps) * TICK_NS * 1e-9
        height_m += true_mps * TICK_NS * 1e-9
        if tick * TICK_NS % READING_NS < TICK_NS:
            check.height(10**9 + tick * TICK_NS, round(height_m, 2))
        check.believed_mps(10**9 + tick * TICK_NS, told_mps, wanted_mps)
        if check.contradicted:
            break
    assert check.contradicted
    assert abs(true_mps - told_mps) < 2.0


@pytest.mark.parametrize(
    ("make", "keeps"),
    [(ardupilot_rig, True), (raw_rig, False), (px4_rig, False), (ardrone_rig, True)],
    ids=["ardupilot", "raw thrust", "px4", "ardrone"],
)
def test_a_vehicle_says_whether_it_keeps_a_climb_by_itself(make: Callable[[], Any], keeps: bool) -> None:
    async def test() -> None:
        async with make() as rig:
            await rig.until(lambda: rig.vehicle.state() is not None)
            await asyncio.sleep(3.0)
            assert rig.known().keeps_climb is keeps

    virtual(test())


def test_what_is_not_known_to_keep_a_climb_does_not() -> None:
    """Whether thrust is a climb rate was not answered yet."""

    async def test() -> None:
        autopilot = ScriptedAutopilot()
        del autopilot.parameters["GUID_OPTIONS"]
        async with scripted(autopilot) as (_, vehicle):
            await asyncio.sleep(3.0)
            assert not known(vehicle).keeps_climb

    virtual(test())


async def _silenced(rig: Rig) -> None:
    """It hovers, and tells no climb rate for as long as it takes to be missed."""
    await rig.take_off(1.5)
    rig.peer.link.withheld = set(CLIMB_MESSAGES)
    await rig.stream(1.5)


@by_thrust
def test_thrust_is_steered_down_by_the_heights_rate_and_no_further_without_it(
    make: Callable[[], Any],
) -> None:
    async def test() -> None:
        async with make() as rig:
            await _silenced(rig)
            await rig.stream(1.0, climb_mps=-SINK_MPS)
            for _ in range(5):
                await rig.stream(0.2, climb_mps=-SINK_MPS)
                state, true_mps = rig.known(), rig.peer.truth().climb_mps
                assert state.climb_contradicted
                assert state.climb_mps == pytest.approx(true_mps, abs=0.15)
                assert true_mps == pytest.approx(-SINK_MPS, abs=0.15)
            rig.peer.sensors.fault.range_lost = True
            await rig.stream(1.0)
            assert math.isnan(rig.known().climb_mps)

    virtual(test())


@by_thrust
def test_the_heights_rate_comes_late_and_is_answered_gently(make: Callable[[], Any]) -> None:
    """As fast as a told rate is answered, it sinks by 0.3 m/s faster than commanded."""

    async def test() -> None:
        async with make() as rig:
            await _silenced(rig)
            await rig.stream(1.5, climb_mps=0.5)
            await rig.stream(1.5)
            fastest_mps = 0.0
            for _ in range(75):
                await rig.stream(0.02, climb_mps=-0.5)
                fastest_mps = min(fastest_mps, rig.peer.truth().climb_mps)
            assert -0.72 < fastest_mps < -0.5

    virtual(test())


def test_an_autopilot_that_keeps_a_climb_sinks_as_it_is_commanded_to_and_tells_no_rate() -> None:
    async def test() -> None:
        async with ardupilot_rig() as rig:
            await _silenced(rig)
            await rig.stream(1.0, climb_mps=-SINK_MPS)
            assert rig.peer.truth().climb_mps == pytest.approx(-SINK_MPS, abs=0.15)
            assert math.isnan(rig.known().climb_mps)
            assert rig.known().keeps_climb
            assert not rig.known().climb_contradicted

    virtual(test())


@by_thrust
def test_a_rate_that_is_told_again_is_believed_again(make: Callable[[], Any]) -> None:
    """In the autopilot's own landing, too, in which nothing is steered that could tell that it came back."""

    async def test() -> None:
        async with make() as rig:
            for demand in (Demand.FLY, Demand.LAND):
                rig.peer.link.withheld = set()
                await rig.take_off(1.5)
                rig.peer.link.withheld = set(CLIMB_MESSAGES)
                await rig.stream(1.5)
                assert rig.known().climb_contradicted
                rig.vehicle.demand(demand)
                rig.peer.link.withheld = set()
                await rig.stream(1.0)
                assert not rig.known().climb_contradicted
                assert rig.known().climb_mps == pytest.approx(rig.peer.truth().climb_mps, abs=0.1)

    virtual(test())


@by_thrust
def test_in_the_autopilots_own_landing_no_rate_is_kept(make: Callable[[], Any]) -> None:
    """What was believed last would be told all the way down, and on the floor."""

    async def test() -> None:
        async with make() as rig:
            await _silenced(rig)
            rig.vehicle.demand(Demand.LAND)
            await rig.stream(1.0)
            assert rig.peer.armed
            assert rig.peer.truth().climb_mps < -0.3
            assert math.isnan(rig.known().climb_mps)

    virtual(test())


@by_thrust
def test_on_the_floor_no_rate_is_made_up(make: Callable[[], Any]) -> None:
    """Nothing is armed without one."""

    async def test() -> None:
        async with make() as rig:
            await _silenced(rig)
            rig.vehicle.demand(Demand.LAND)
            await rig.until(lambda: not rig.peer.armed, 20.0)
            await rig.until(lambda: not rig.known().armed)
            assert math.isnan(rig.known().climb_mps)
            assert not rig.known().climb_contradicted

    virtual(test())
