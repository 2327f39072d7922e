"""What the PX4 adapter adds to the contract: the stream before OFFBOARD, thrust, landing, failsafes."""

from __future__ import annotations

import asyncio
import math

import pytest

from flightd.adapters.vehicle.mavlink.height_loop import HeightLoop
from flightd.core.types import AttitudeSetpoint, Demand, LandedState
from flightd.sim.airframe import Airframe, AirframeCommand, AirframeParams
from flightd.sim.autopilot.peer import PeerConfig
from flightd.sim.autopilot.px4 import Px4Mode
from tests.protocol.rig import CALM, px4_rig, run_virtual


def test_it_streams_before_offboard_and_only_on_demand() -> None:
    async def test() -> None:
        async with px4_rig() as rig:
            await asyncio.sleep(3.0)
            assert rig.peer._stream_s == 0.0
            rig.vehicle.demand(Demand.FLY)
            took_s = await rig.until(lambda: rig.known().armed)
            assert 1.2 < took_s < 3.0
            assert rig.known().mode == "OFFBOARD"
            rig.vehicle.demand(Demand.STANDBY)
            await asyncio.sleep(1.0)
            assert rig.peer._stream_s == 0.0

    run_virtual(test)


def test_the_idle_stream_carries_no_thrust_and_never_keeps_a_flight_alive() -> None:
    async def test() -> None:
        async with px4_rig() as rig:
            await rig.until(lambda: rig.vehicle.state() is not None)
            rig.vehicle.demand(Demand.FLY)
            await rig.until(lambda: rig.known().armed)
            await asyncio.sleep(3.0)
            assert rig.peer._thrust == 0.0
            assert rig.known().in_control
            await rig.take_off(1.0)
            await asyncio.sleep(1.5)  # the mission is dead
            assert rig.peer.mode == Px4Mode.AUTO_LAND
            assert not rig.known().in_control
            await asyncio.sleep(8.0)
            assert rig.peer.truth().height_m == pytest.approx(0.1, abs=0.01)
            assert not rig.known().armed

    run_virtual(test)


def test_the_failsafe_of_a_lost_link_is_a_take_over() -> None:
    async def test() -> None:
        async with px4_rig() as rig:
            await rig.take_off(1.5)
            rig.cut(True)
            await rig.stream(2.0)
            rig.cut(False)
            await asyncio.sleep(0.5)
            assert rig.known().mode == "AUTO.LAND"
            assert not rig.known().in_control
            assert not any(await rig.stream(1.0, climb_mps=0.5))

    run_virtual(test)


def test_arming_refusals_carry_px4s_words() -> None:
    async def test() -> None:
        async with px4_rig(PeerConfig(ready_s=6.0)) as rig:
            await rig.until(lambda: rig.vehicle.state() is not None)
            rig.vehicle.demand(Demand.FLY)
            await asyncio.sleep(3.0)
            assert (
                rig.known().refusal == "arming: temporarily rejected (Preflight Fail: system power unstable)"
            )
            await rig.until(lambda: rig.known().armed)

    run_virtual(test)


@pytest.mark.parametrize("hover", [0.22, 0.34, 0.6])
def test_the_hover_thrust_is_found_whatever_the_airframe(hover: float) -> None:
    async def test() -> None:
        async with px4_rig() as rig:
            rig.peer.airframe.params = AirframeParams(hover_collective=hover)
            await rig.until(lambda: rig.vehicle.state() is not None)
            rig.vehicle.demand(Demand.FLY)
            await rig.until(lambda: rig.known().armed)
            speeds = []
            for _ in range(45):
                await rig.stream(0.1, climb_mps=0.4)
                speeds.append(rig.peer.truth().climb_mps)
            assert max(speeds) < 0.9  # no jump at lift-off
            assert speeds[-1] == pytest.approx(0.4, abs=0.1)
            await rig.stream(1.0)
            height_m = rig.peer.truth().height_m
            await rig.stream(10.0)
            assert rig.peer.truth().height_m == pytest.approx(height_m, abs=0.15)

    run_virtual(test)


def test_thrust_is_cut_after_touch_down_so_that_it_reports_landed() -> None:
    async def test() -> None:
        async with px4_rig() as rig:
            await rig.take_off(1.0)
            while rig.peer.truth().height_m > 0.11:
                await rig.stream(0.1, climb_mps=-0.3)
            await rig.stream(2.0, climb_mps=-0.3)
            assert rig.known().landed is LandedState.ON_GROUND
            assert rig.peer._thrust == 0.0
            assert rig.peer.airframe.touchdown_mps < 0.5

    run_virtual(test)


# The height loop by itself


def fly_loop(
    loop: HeightLoop, airframe: Airframe, wishes: list[tuple[float, float]], *, blind: bool = False
) -> list[tuple[float, float]]:
    """Fly (climb, duration) pairs; (thrust, height) at each 20 ms."""
    path, now_ns, told = [], 0, True
    for climb, duration_s in wishes:
        for _ in range(round(duration_s / 0.02)):
            now_ns += 20_000_000
            thrust = loop.step(
                now_ns,
                climb,
                climb_mps=airframe.climb_mps,
                height_m=math.nan if blind else airframe.height_m,
                tilt_cos=1.0,
                on_floor=told,
            )
            for _ in range(5):
                airframe.step(0.004, AirframeCommand(motors=True, collective=thrust))
            told = told and airframe.climb_mps < 0.15
            path.append((thrust, airframe.height_m))
    return path


@pytest.mark.parametrize("blind", [False, True])
def test_touch_down_is_felt_with_and_without_a_range_finder(blind: bool) -> None:
    airframe = Airframe(draught=CALM)
    path = fly_loop(HeightLoop(), airframe, [(0.5, 4.0), (0.0, 2.0), (-0.4, 9.0)], blind=blind)
    assert max(height for _, height in path) > 1.0
    last_thrust = max(i for i, (thrust, _) in enumerate(path) if thrust > 0.0)
    assert last_thrust < len(path) - 50
    assert path[last_thrust][1] == pytest.approx(0.1)  # it was not cut in the air


def test_slow_sinking_and_hovering_near_the_floor_are_no_touch_down() -> None:
    airframe = Airframe(draught=CALM)
    path = fly_loop(HeightLoop(), airframe, [(0.3, 3.0), (-0.06, 4.0), (0.0, 5.0)])
    assert min(thrust for thrust, _ in path[-300:]) > 0.2
    assert path[-1][1] > 0.3


def test_without_a_climb_rate_the_hover_thrust_is_kept() -> None:
    loop, airframe = HeightLoop(), Airframe(draught=CALM)
    fly_loop(loop, airframe, [(0.4, 3.0), (0.0, 2.0)])
    thrust = loop.step(
        6_000_000_000, 0.5, climb_mps=math.nan, height_m=math.nan, tilt_cos=1.0, on_floor=False
    )
    assert thrust == pytest.approx(loop.hover)
    assert thrust == pytest.approx(airframe.params.hover_collective, rel=0.1)


def test_a_flight_taken_over_in_the_air_starts_at_the_guessed_hover_thrust() -> None:
    loop = HeightLoop()
    loop.hover = 0.4
    first = loop.step(1_000_000_000, 0.0, climb_mps=0.0, height_m=1.5, tilt_cos=1.0, on_floor=False)
    assert first == pytest.approx(0.4)


def test_a_waiting_vehicle_gets_no_thrust() -> None:
    loop = HeightLoop()
    for i in range(50):
        thrust = loop.step(i * 20_000_000, 0.0, climb_mps=0.0, height_m=0.1, tilt_cos=1.0, on_floor=True)
        assert thrust == 0.0


def test_setpoints_are_refused_while_not_ours() -> None:
    async def test() -> None:
        async with px4_rig() as rig:
            await asyncio.sleep(2.0)
            assert rig.vehicle.send(AttitudeSetpoint(0, climb_mps=1.0)) is False
            assert rig.peer._thrust == 0.0

    run_virtual(test)
