"""What the PX4 adapter adds to the contract: the stream before OFFBOARD, thrust, landing, failsafes."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.core.refusal import words
from flightd.core.types import AttitudeSetpoint, Demand, LandedState
from flightd.sim.autopilot.autopilot import PeerConfig
from flightd.sim.autopilot.px4 import Px4Mode
from flightd.sim.plant.airframe import AirframeParams
from tests.rigs.event_loops import virtual
from tests.rigs.vehicles import px4_rig


def test_it_streams_before_offboard_and_only_on_demand() -> None:
    async def test() -> None:
        async with px4_rig() as rig:
            await asyncio.sleep(3.0)
            assert rig.peer.stream_s == 0.0
            rig.vehicle.demand(Demand.FLY)
            took_s = await rig.until(lambda: rig.known().armed)
            assert 1.2 < took_s < 3.0
            assert rig.known().mode == "OFFBOARD"
            rig.vehicle.demand(Demand.STANDBY)
            await asyncio.sleep(1.0)
            assert rig.peer.stream_s == 0.0

    virtual(test())


def test_the_idle_stream_carries_no_thrust_and_never_keeps_a_flight_alive() -> None:
    async def test() -> None:
        async with px4_rig() as rig:
            await rig.until(lambda: rig.vehicle.state() is not None)
            rig.vehicle.demand(Demand.FLY)
            await rig.until(lambda: rig.known().armed)
            await asyncio.sleep(3.0)
            assert rig.peer.thrust == 0.0
            assert rig.known().in_control
            await rig.take_off(1.0)
            await asyncio.sleep(1.5)  # the mission is dead
            assert rig.peer.mode == Px4Mode.AUTO_LAND
            assert not rig.known().in_control
            await asyncio.sleep(8.0)
            assert rig.peer.truth().height_m == pytest.approx(0.1, abs=0.01)
            assert not rig.known().armed

    virtual(test())


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

    virtual(test())


def test_arming_refusals_carry_px4s_words() -> None:
    async def test() -> None:
        async with px4_rig(PeerConfig(ready_s=6.0)) as rig:
            await rig.until(lambda: rig.vehicle.state() is not None)
            rig.vehicle.demand(Demand.FLY)
            await asyncio.sleep(3.0)
            assert (
                words(rig.known().refusal)
                == "arming: temporarily rejected (Preflight Fail: system power unstable)"
            )
            await rig.until(lambda: rig.known().armed)

    virtual(test())


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

    virtual(test())


def test_the_hover_thrust_that_was_found_is_not_lost_to_a_parameter_that_comes_late() -> None:
    async def test() -> None:
        async with px4_rig() as rig:
            answer = rig.peer.parameters.answer

            def hold_back(message: Any, reply: Callable[[Any], None]) -> None:
                if message.param_id != "MPC_THR_HOVER":
                    answer(message, reply)

            rig.peer.parameters.answer = hold_back
            await rig.take_off(1.5)
            rig.peer.parameters["MPC_THR_HOVER"] = 0.8
            rig.peer.parameters.answer = answer
            for _ in range(80):
                await rig.stream(0.1)
                assert abs(rig.peer.truth().climb_mps) < 0.2

    virtual(test())


def test_thrust_is_cut_after_touch_down_so_that_it_reports_landed() -> None:
    async def test() -> None:
        async with px4_rig() as rig:
            await rig.take_off(1.0)
            while rig.peer.truth().height_m > 0.11:
                await rig.stream(0.1, climb_mps=-0.3)
            await rig.stream(2.0, climb_mps=-0.3)
            assert rig.known().landed is LandedState.ON_GROUND
            assert rig.peer.thrust == 0.0
            assert rig.peer.airframe.touchdown_mps < 0.5

    virtual(test())


def test_setpoints_are_refused_while_not_ours() -> None:
    async def test() -> None:
        async with px4_rig() as rig:
            await asyncio.sleep(2.0)
            assert rig.vehicle.send(AttitudeSetpoint(0, climb_mps=1.0)) is False
            assert rig.peer.thrust == 0.0

    virtual(test())


@pytest.mark.parametrize("told", ["nothing more", "that it stands"])
def test_a_flight_whose_landed_state_stays_that_of_the_floor_is_not_dropped(told: str) -> None:
    async def test() -> None:
        async with px4_rig() as rig:
            await rig.until(lambda: rig.vehicle.state() is not None)
            rig.vehicle.demand(Demand.FLY)
            await rig.until(lambda: rig.known().armed and rig.known().landed is LandedState.ON_GROUND)
            send = rig.peer.link.send

            def falsify(channel: Any, message: Any) -> None:
                if message.get_type() == "EXTENDED_SYS_STATE":
                    if told == "nothing more":
                        return
                    message.landed_state = dialect.MAV_LANDED_STATE_ON_GROUND
                send(channel, message)

            rig.peer.link.send = falsify
            await rig.take_off(1.5)
            stale = told == "nothing more"
            assert rig.known().landed is (LandedState.UNKNOWN if stale else LandedState.ON_GROUND)
            height_m = rig.peer.truth().height_m
            await rig.stream(3.0)
            assert rig.peer.truth().height_m == pytest.approx(height_m, abs=0.15)
            await rig.stream(1.0, climb_mps=-0.3)
            assert rig.peer.truth().height_m > 1.0

    virtual(test())


@pytest.mark.parametrize("leap_m", [1.4, -1.4])
def test_a_leap_of_the_height_above_home_at_arming_is_no_climb(leap_m: float) -> None:
    """It was taken for 4.8 m/s of climb: the hover thrust was learnt far too low, the take-off took 13 s."""

    async def test() -> None:
        config = PeerConfig(ready_s=0.5, home_leap_m=leap_m)
        async with px4_rig(config) as rig:
            await rig.until(lambda: rig.vehicle.state() is not None)
            rig.vehicle.demand(Demand.FLY)
            await rig.until(lambda: rig.known().armed and rig.known().in_control)
            climbs = []
            for _ in range(60):
                await rig.stream(0.1, climb_mps=0.5)
                climbs.append(rig.known().climb_mps)
                if rig.peer.truth().height_m > 1.0:
                    break
            assert rig.peer.truth().height_m > 1.0
            assert min(climbs) > -0.3
            assert max(climbs) < 0.9

    virtual(test())


def test_a_take_over_is_seen_in_time_though_the_heartbeat_keeps_its_rate() -> None:
    """PX4 refuses SET_MESSAGE_INTERVAL of HEARTBEAT: a take-over was seen up to a second late."""

    async def test() -> None:
        async with px4_rig() as rig:
            await rig.take_off(1.5)
            for at_s in (0.2, 0.45, 0.7):
                rig.peer.pilot_mode(Px4Mode.OFFBOARD)
                rig.vehicle.demand(Demand.STANDBY)
                await asyncio.sleep(0.1)
                rig.vehicle.demand(Demand.FLY)
                await rig.until(lambda: rig.known().in_control)
                await rig.stream(at_s)
                rig.take_over()
                assert await rig.until(lambda: not rig.known().in_control, 1.0) < 0.15
            texts = [text for text in rig.peer.texts if text.startswith("heartbeat_rate")]
            assert not texts

    virtual(test())
