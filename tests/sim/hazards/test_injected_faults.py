"""Each fault of the vehicle, done to the simulated autopilot and seen through its socket, in virtual time."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

import pytest
from pydantic import TypeAdapter

from flightd.core.types import Demand
from flightd.sim.scenario.fault_schema import Fault
from flightd.sim.scenario.faults import WorldFaults
from flightd.site.site_file import load_site
from tests.rigs.event_loops import virtual
from tests.rigs.vehicles import Rig, ardupilot_rig, px4_rig

SITE = load_site(Path(__file__).parents[3] / "configs" / "site-demo.toml")
BOTH = {"ardupilot": ardupilot_rig, "px4": px4_rig}


@pytest.fixture(params=list(BOTH))
def in_flight(
    request: pytest.FixtureRequest,
) -> Callable[[Callable[[Rig, Any], Coroutine[Any, Any, None]]], None]:
    """Runs a test on a vehicle at 1.5 m; `turn(on, kind=..., ...)` begins or ends a fault."""

    def run(test: Callable[[Rig, Any], Coroutine[Any, Any, None]]) -> None:
        async def main() -> None:
            async with BOTH[request.param]() as rig:
                await rig.until(lambda: rig.vehicle.state() is not None)
                rig.vehicle.demand(Demand.FLY)
                await rig.until(lambda: rig.known().armed)
                await rig.take_off(1.5)
                world = WorldFaults((), SITE, {}, rig.peer.airframe, rig.peer, lambda _index, _begins: None)

                def turn(on: bool, **keys: Any) -> None:
                    fault: Any = TypeAdapter(Fault).validate_python({"at_s": 0.0, **keys})
                    world.turn(fault, on)

                await test(rig, turn)

        virtual(main())

    return run


def test_without_heartbeats_the_set_points_go_on(in_flight: Any) -> None:
    async def test(rig: Rig, turn: Any) -> None:
        turn(True, kind="heartbeat_silent")
        beat_ns = rig.known().heartbeat_ns
        assert all(await rig.stream(6.0))
        assert rig.known().heartbeat_ns - beat_ns < 1_100_000_000
        turn(False, kind="heartbeat_silent")
        await rig.stream(1.5)
        assert rig.known().heartbeat_ns - beat_ns > 6_000_000_000

    in_flight(test)


def test_a_silent_autopilot_is_not_heard_and_heard_again(in_flight: Any) -> None:
    async def test(rig: Rig, turn: Any) -> None:
        turn(True, kind="telemetry_silent")
        before_ns = rig.known().attitude.stamp_ns
        await rig.stream(1.0)
        assert rig.known().attitude.stamp_ns - before_ns < 100_000_000
        turn(False, kind="telemetry_silent")
        await rig.stream(0.5)
        assert rig.known().attitude.stamp_ns - before_ns > 1_000_000_000

    in_flight(test)


def test_the_range_finder_reads_wrong_or_nothing(in_flight: Any) -> None:
    async def test(rig: Rig, turn: Any) -> None:
        before_m = rig.known().height_m
        turn(True, kind="height_biased", offset_m=2.0)
        await rig.stream(0.3)
        assert rig.known().height_m - before_m == pytest.approx(2.0, abs=0.3)
        turn(False, kind="height_biased", offset_m=2.0)
        turn(True, kind="height_lost")
        await rig.stream(2.0)
        assert math.isnan(rig.known().height_m)
        turn(False, kind="height_lost")
        await rig.stream(0.3)
        assert rig.known().height_m == pytest.approx(before_m, abs=0.5)

    in_flight(test)


def test_the_attitude_is_off_in_what_is_told(in_flight: Any) -> None:
    async def test(rig: Rig, turn: Any) -> None:
        before = rig.known().attitude.yaw_rad
        turn(True, kind="attitude_biased", yaw_deg=20.0)
        await asyncio.sleep(0.05)  # before the autopilot has turned the vehicle by it
        assert math.degrees(rig.known().attitude.yaw_rad - before) > 10.0

    in_flight(test)


def test_battery_and_clock_jump_as_told(in_flight: Any) -> None:
    async def test(rig: Rig, turn: Any) -> None:
        refused = rig.known().stamps_refused
        turn(True, kind="battery", charge=0.5)
        turn(True, kind="clock_jump", jump_s=100.0)
        await rig.stream(1.5)
        assert rig.known().battery_frac == pytest.approx(0.5, abs=0.02)
        assert rig.known().stamps_refused > refused

    in_flight(test)


def test_the_range_finder_measures_on_when_the_clock_jumps_back(in_flight: Any) -> None:
    async def test(rig: Rig, turn: Any) -> None:
        turn(True, kind="clock_jump", jump_s=100.0)
        await rig.stream(2.0)
        turn(False, kind="clock_jump", jump_s=100.0)
        await rig.stream(3.0, climb_mps=0.3)
        assert rig.peer.truth().height_m > 2.0
        assert rig.known().height_m == pytest.approx(rig.peer.truth().height_m, abs=0.2)

    in_flight(test)


def test_a_pilot_takes_it_and_lands_it(in_flight: Any) -> None:
    async def test(rig: Rig, turn: Any) -> None:
        turn(True, kind="pilot")
        await rig.stream(1.2)
        assert not rig.known().in_control
        turn(False, kind="pilot")
        await rig.until(lambda: rig.peer.landed, 15.0)

    in_flight(test)


def test_a_range_finder_without_a_signal_is_not_believed(in_flight: Any) -> None:
    async def test(rig: Rig, turn: Any) -> None:
        turn(True, kind="height_quality")
        await rig.stream(1.0)
        assert math.isnan(rig.known().height_m)
        turn(False, kind="height_quality")
        await rig.stream(0.3)
        assert rig.known().height_m == pytest.approx(1.5, abs=0.3)

    in_flight(test)


def test_a_battery_that_is_told_of_no_longer_or_not_known_is_as_told(in_flight: Any) -> None:
    async def test(rig: Rig, turn: Any) -> None:
        turn(True, kind="charge_misreported")
        await rig.stream(2.5)
        assert math.isnan(rig.known().battery_frac)
        assert rig.known().battery_cells == 3
        turn(False, kind="charge_misreported")
        turn(True, kind="battery_silent")
        told_ns = rig.known().battery_stamp_ns
        await rig.stream(3.0)
        assert rig.known().battery_stamp_ns - told_ns < 1_100_000_000

    in_flight(test)


def test_without_answers_about_its_clock_the_error_grows(in_flight: Any) -> None:
    async def test(rig: Rig, turn: Any) -> None:
        turn(True, kind="clock_rate", share=0.03)
        await rig.stream(5.0)
        assert rig.known().clock_error_s < 0.003
        turn(True, kind="timesync_silent")
        await rig.stream(6.0)
        assert rig.known().clock_error_s > 0.02

    in_flight(test)
