"""The ArduPilot adapter on the wire: what it sends and believes, its modes, the pilot."""

from __future__ import annotations

import asyncio
import math
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.ardupilot import ArduPilotVehicle
from flightd.adapters.vehicle.mavlink.link.codec import Codec
from flightd.adapters.vehicle.mavlink.required_parameters import Job
from flightd.adapters.vehicle.mavlink.vehicle import MavlinkOptions
from flightd.core.refusal import words
from flightd.core.types import AttitudeSetpoint, Demand, Event, EventLevel, LandedState
from flightd.runtime.clock import LoopClock
from flightd.sim.autopilot.autopilot import PeerConfig
from flightd.sim.autopilot.copter import ArduCopterPeer
from flightd.sim.plant.airframe import Airframe
from tests.protocol.mavlink.scripted_autopilot import (
    ALT_HOLD,
    ARM,
    GUIDED_NOGPS,
    INTERVAL,
    LAND,
    PX4,
    SET_MODE,
    WAY_DOWN,
    ScriptedAutopilot,
    known,
    scripted,
)
from tests.rigs.event_loops import virtual
from tests.rigs.vehicles import Rig, ardupilot_rig

# What we are and ask


def test_we_are_an_onboard_computer_and_beat_twenty_times_a_second() -> None:
    async def test() -> None:
        async with scripted() as (autopilot, _):
            await asyncio.sleep(10.0)
            beats = autopilot.all("HEARTBEAT")
            assert 190 <= len(beats) <= 230
            assert {(b.type, b.autopilot, b.get_srcSystem(), b.get_srcComponent()) for b in beats} == {
                (18, 8, 191, 191)
            }

    virtual(test())


def test_message_intervals_are_asked_for_and_nothing_else_is_commanded() -> None:
    async def test() -> None:
        async with scripted() as (autopilot, _):
            await asyncio.sleep(1.0)
            asked = {m.param1: m.param2 for m in autopilot.commands(INTERVAL)}
            assert asked[0] == 50_000
            assert asked[30] == 20_000
            assert {m.command for m in autopilot.all("COMMAND_LONG")} == {INTERVAL}

    virtual(test())


def test_timesync_is_asked_and_answered() -> None:
    async def test() -> None:
        async with scripted() as (autopilot, _):
            autopilot.say(dialect.MAVLink_timesync_message(0, 4711))
            await asyncio.sleep(0.5)
            answers = [m for m in autopilot.all("TIMESYNC") if m.tc1 != 0]
            assert [m.ts1 for m in answers] == [4711]
            assert answers[0].tc1 == pytest.approx(asyncio.get_running_loop().time() * 1e9 - 0.5e9, abs=1e6)
            assert len([m for m in autopilot.all("TIMESYNC") if m.tc1 == 0]) > 5

    virtual(test())


def test_setpoints_carry_unit_quaternions_all_rates_and_the_climb_as_thrust() -> None:
    async def test() -> None:
        async with scripted() as (autopilot, vehicle):
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(2.0)
            autopilot.heard.clear()
            for climb in (0.0, 0.5, 5.0, -0.3, -9.0):
                assert vehicle.send(AttitudeSetpoint(0, 0.1, -0.2, 0.3, climb))
            await asyncio.sleep(0.1)
            targets = autopilot.all("SET_ATTITUDE_TARGET")
            assert [t.thrust for t in targets] == pytest.approx([0.5, 0.6, 1.0, 0.4, 0.0])
            for target in targets:
                assert target.type_mask == 0
                assert abs(math.hypot(*target.q) - 1.0) < 1e-6
                rates = (target.body_roll_rate, target.body_pitch_rate, target.body_yaw_rate)
                assert rates == pytest.approx((0.0, 0.0, 0.3))
                w, x, y, z = target.q
                yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
                assert yaw == pytest.approx(1.0, abs=0.01)  # the vehicle's own heading

    virtual(test())


@pytest.mark.parametrize(
    ("parameters", "thrust"),
    [
        ({"GUID_OPTIONS": 0, "WPNAV_SPEED_UP": 100, "WPNAV_SPEED_DN": 150}, 0.75),
        ({"GUID_OPTIONS": 0, "WP_SPD_UP": 5.0, "WP_SPD_DN": 1.5}, 0.55),  # ArduCopter 4.7: metres
        ({"GUID_OPTIONS": 0}, 0.6),
    ],
)
def test_climb_is_scaled_by_the_autopilots_speeds(parameters: dict[str, float], thrust: float) -> None:
    async def test() -> None:
        autopilot = ScriptedAutopilot()
        autopilot.parameters = WAY_DOWN | parameters
        async with scripted(autopilot) as (_, vehicle):
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(16.0)  # it has hardly any parameter
            assert vehicle.send(AttitudeSetpoint(0, climb_mps=0.5))
            await asyncio.sleep(0.1)
            assert autopilot.all("SET_ATTITUDE_TARGET")[-1].thrust == pytest.approx(thrust)

    virtual(test())


def test_before_the_meaning_of_thrust_is_known_it_is_not_flown() -> None:
    async def test() -> None:
        autopilot = ScriptedAutopilot()
        autopilot.parameters = {}
        async with scripted(autopilot) as (_, vehicle):
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(3.0)
            assert words(known(vehicle).refusal) == "GUID_OPTIONS not read yet"
            assert not autopilot.commands(ARM)
            assert not autopilot.commands(SET_MODE)
            assert not vehicle.send(AttitudeSetpoint(0))

    virtual(test())


@pytest.mark.parametrize(("options", "wanted"), [(0, True), (8, False), (1, True)])
def test_thrust_that_means_something_else_than_configured_is_not_flown(options: int, wanted: bool) -> None:
    async def test() -> None:
        for configured in (wanted, None):
            autopilot = ScriptedAutopilot()
            autopilot.parameters["GUID_OPTIONS"] = options
            async with scripted(autopilot, job=Job(raw_thrust=configured)) as (_, vehicle):
                vehicle.demand(Demand.FLY)
                await asyncio.sleep(3.0)
                refused = "vehicle.raw_thrust" in words(known(vehicle).refusal)
                assert refused is (configured is not None)
                assert bool(autopilot.commands(ARM)) is not refused

    virtual(test())


def test_a_vehicle_found_flying_is_not_steered_before_the_meaning_of_thrust_is_known() -> None:
    async def test() -> None:
        autopilot = ScriptedAutopilot()
        autopilot.parameters, autopilot.mode, autopilot.armed = {}, GUIDED_NOGPS, True
        async with scripted(autopilot) as (_, vehicle):
            vehicle.demand(Demand.KEEP)
            await asyncio.sleep(1.0)
            assert words(known(vehicle).refusal) == "GUID_OPTIONS not read yet"
            assert known(vehicle).in_control, "it may be told to land"
            assert not vehicle.send(AttitudeSetpoint(0))
            await asyncio.sleep(10.0)  # however often an answer is lost
            autopilot.parameters = WAY_DOWN | {"GUID_OPTIONS": 8}
            await asyncio.sleep(0.6)
            assert (known(vehicle).in_control, words(known(vehicle).refusal)) == (True, "")
            assert vehicle.send(AttitudeSetpoint(0))

    virtual(test())


def test_a_vehicle_found_flying_for_nobody_is_landed_by_a_mission_that_is_over() -> None:
    """Our heartbeats keep it from landing by itself; nothing was asked of it, for it had never been held."""

    async def test() -> None:
        autopilot = ScriptedAutopilot()
        autopilot.mode, autopilot.armed = GUIDED_NOGPS, True
        async with scripted(autopilot) as (_, vehicle):
            vehicle.demand(Demand.LAND)
            await asyncio.sleep(2.0)
            assert [command.param2 for command in autopilot.commands(SET_MODE)][:1] == [LAND]

    virtual(test())


def test_a_clock_that_leaps_back_in_the_air_does_not_change_what_thrust_means() -> None:
    async def test() -> None:
        async with ardupilot_rig(PeerConfig(ready_s=0.5, parameters={"GUID_OPTIONS": 8})) as rig:
            await rig.take_off(1.5)
            height_m = rig.peer.truth().height_m
            rig.peer.parameters.answer = lambda *_: None  # nor are parameters answered any more
            rig.peer.link.broadcast(dialect.MAVLink_attitude_message(0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
            assert all(await rig.stream(3.0))
            assert rig.peer.truth().height_m == pytest.approx(height_m, abs=0.15)

    virtual(test())


# Whom we believe


def test_others_are_not_the_autopilot() -> None:
    async def test() -> None:
        for other in (ScriptedAutopilot(7, 1), ScriptedAutopilot(1, 154), ScriptedAutopilot(255, 190)):
            async with scripted(other) as (_, vehicle):
                await asyncio.sleep(2.0)
                assert vehicle.state() is None
        station = ScriptedAutopilot()
        station.kind = dialect.MAV_TYPE_GCS
        async with scripted(station) as (_, vehicle):
            await asyncio.sleep(2.0)
            assert vehicle.state() is None

    virtual(test())


def test_another_firmware_is_recognised_and_not_flown() -> None:
    async def test() -> None:
        autopilot = ScriptedAutopilot()
        autopilot.autopilot = PX4
        async with scripted(autopilot) as (_, vehicle):
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(2.0)
            assert words(known(vehicle).refusal) == "the autopilot is PX4, the configuration says ARDUPILOT"
            assert not autopilot.commands(SET_MODE)

    virtual(test())


# Modes and the pilot


@pytest.mark.parametrize("has_position", [True, False])
def test_guided_flies_a_vehicle_that_knows_its_position_and_no_other(has_position: bool) -> None:
    async def test() -> None:
        clock = LoopClock()
        peer = ArduCopterPeer(
            clock,
            Airframe(),
            PeerConfig(ready_s=0.5, has_position=has_position, parameters={"EK3_SRC1_VELXY": 5}),
        )
        host, port = await peer.open()
        vehicle = ArduPilotVehicle(f"udpout://{host}:{port}", clock, MavlinkOptions(job=Job(guided=True)))
        tasks = [asyncio.create_task(part.run()) for part in (peer, vehicle)]
        rig = Rig(vehicle, peer, lambda: None, lambda apart: None)
        if has_position:
            await rig.take_off(1.0)
            assert rig.known().mode == "GUIDED"
        else:
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(4.0)
            assert words(rig.known().refusal) == "arming: failed (PreArm: Need Position Estimate)"
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    virtual(test())


def test_landing_mode_is_ours_but_takes_no_setpoints() -> None:
    async def test() -> None:
        async with scripted() as (autopilot, vehicle):
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(2.0)
            vehicle.demand(Demand.LAND)
            await asyncio.sleep(1.0)
            assert autopilot.mode == LAND
            assert known(vehicle).in_control
            assert not vehicle.send(AttitudeSetpoint(0))
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(1.0)
            assert autopilot.mode == GUIDED_NOGPS
            assert vehicle.send(AttitudeSetpoint(0))

    virtual(test())


def test_a_landing_that_is_acknowledged_but_never_shown_is_asked_for_again() -> None:
    async def test() -> None:
        async with scripted() as (autopilot, vehicle):
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(2.0)
            assert known(vehicle).in_control
            autopilot.obeys = False  # as if the acknowledgement were a late one, of the mode before
            autopilot.heard.clear()
            vehicle.demand(Demand.LAND)
            await asyncio.sleep(3.0)
            assert len(autopilot.commands(SET_MODE)) > 3
            assert known(vehicle).in_control, "nobody took it over"
            autopilot.obeys = True
            await asyncio.sleep(1.0)
            assert autopilot.mode == LAND
            assert known(vehicle).in_control

    virtual(test())


def test_no_retry_follows_when_the_pilot_takes_over_meanwhile() -> None:
    async def test() -> None:
        autopilot = ScriptedAutopilot()
        async with scripted(autopilot) as (_, vehicle):
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(2.0)
            assert known(vehicle).in_control
            autopilot.results[SET_MODE] = None
            autopilot.heard.clear()
            vehicle.demand(Demand.LAND)
            await asyncio.sleep(0.1)
            autopilot.mode = ALT_HOLD
            await asyncio.sleep(5.0)
            assert len(autopilot.commands(SET_MODE)) == 1
            assert not known(vehicle).in_control

    virtual(test())


def test_a_late_heartbeat_of_the_mode_before_is_no_take_over_but_any_other_is() -> None:
    async def test() -> None:
        for shown, ours in ((0, True), (ALT_HOLD, False)):
            autopilot = ScriptedAutopilot()
            async with scripted(autopilot) as (_, vehicle):

                def late(message: Any, shown: int = shown, autopilot: ScriptedAutopilot = autopilot) -> None:
                    if message.command == SET_MODE:
                        autopilot.beat(shown)  # acknowledged already, yet shows this

                autopilot.after = late
                vehicle.demand(Demand.FLY)
                await asyncio.sleep(2.0)
                assert known(vehicle).in_control is ours

    virtual(test())


def test_an_accepted_mode_that_never_shows_is_not_held_for_long() -> None:
    async def test() -> None:
        autopilot = ScriptedAutopilot()
        autopilot.obeys = False
        async with scripted(autopilot) as (_, vehicle):
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(3.0)
            assert not known(vehicle).in_control
            assert not vehicle.send(AttitudeSetpoint(0))

    virtual(test())


def test_heartbeats_come_from_a_system_of_their_own_and_texts_from_the_vehicles() -> None:
    """The failsafe watches the first; a ground station shows only the second."""

    async def test() -> None:
        async with scripted() as (autopilot, vehicle):
            await asyncio.sleep(0.5)
            vehicle.notify(Event(0, EventLevel.WARNING, "start", "arms in 3 s"))
            await asyncio.sleep(0.2)
            heard = {(m.get_type(), m.get_srcSystem()) for _, m in autopilot.heard}
            assert {("HEARTBEAT", 191), ("STATUSTEXT", 1)} <= heard
            assert ("HEARTBEAT", 1) not in heard

    virtual(test())


def test_nothing_is_armed_while_somebody_else_beats_as_the_system_that_the_failsafe_watches() -> None:
    async def test() -> None:
        async with scripted() as (autopilot, vehicle):
            await asyncio.sleep(1.5)
            assert known(vehicle).unfit is None
            station = Codec(191, dialect.MAV_COMP_ID_MISSIONPLANNER)
            kind, none = dialect.MAV_TYPE_GCS, dialect.MAV_AUTOPILOT_INVALID
            frame = station.pack(dialect.MAVLink_heartbeat_message(kind, none, 0, 0, 4, 3))
            for address in autopilot.link.channels:
                autopilot.link.transmit(frame, address)
            await asyncio.sleep(0.2)
            assert "somebody else sends heartbeats as system 191" in words(known(vehicle).unfit)
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(2.0)
            assert autopilot.commands(ARM) == []

    virtual(test())


def test_nothing_is_armed_where_a_range_of_systems_holds_off_the_landing() -> None:
    async def test() -> None:
        autopilot = ScriptedAutopilot()
        autopilot.parameters["MAV_GCS_SYSID_HI"] = 255
        async with scripted(autopilot) as (_, vehicle):
            await asyncio.sleep(2.0)
            assert "MAV_GCS_SYSID_HI" in words(known(vehicle).unfit)
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(2.0)
            assert autopilot.commands(ARM) == []

    virtual(test())


def test_an_arming_that_comes_after_its_start_is_void_is_taken_back() -> None:
    async def test() -> None:
        async with scripted() as (autopilot, vehicle):
            autopilot.results[ARM] = None
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(2.5)
            autopilot.results[ARM] = 0
            vehicle.demand(Demand.DISARM)  # what the mission demands when a start has come to nothing
            autopilot.armed = True
            down = dialect.MAV_SENSOR_ROTATION_PITCH_270
            autopilot.say(dialect.MAVLink_distance_sensor_message(0, 5, 800, 10, 0, 1, down, 0))
            await asyncio.sleep(1.0)
            assert autopilot.commands(ARM)[-1].param1 == 0

    virtual(test())


@pytest.mark.parametrize(("distance_cm", "disarms"), [(10, True), (150, False), (None, False)])
def test_leaving_it_disarms_only_what_the_range_finder_too_has_on_the_floor(
    distance_cm: int | None, disarms: bool
) -> None:
    async def test() -> None:
        async with scripted() as (autopilot, vehicle):
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(2.5)
            assert known(vehicle).in_control
            assert known(vehicle).armed
            if distance_cm is not None:
                down = dialect.MAV_SENSOR_ROTATION_PITCH_270
                autopilot.say(dialect.MAVLink_distance_sensor_message(0, 5, 800, distance_cm, 0, 1, down, 0))
            autopilot.say(dialect.MAVLink_extended_sys_state_message(0, 1))
            await asyncio.sleep(0.1)
            assert known(vehicle).landed is LandedState.ON_GROUND
        assert [m.param1 for m in autopilot.commands(ARM)] == ([1, 0] if disarms else [1])
        assert (autopilot.commands(SET_MODE)[-1].param2 == LAND) is not disarms

    virtual(test())


def test_a_failsafe_of_the_autopilot_counts_as_a_take_over() -> None:
    async def test() -> None:
        async with ardupilot_rig(PeerConfig(ready_s=0.5, parameters={"BATT_FS_LOW_ACT": 1})) as rig:
            await rig.take_off()
            rig.peer.airframe.battery_frac = 0.02
            await rig.until(lambda: not rig.known().in_control, 12.0)
            assert rig.known().mode == "LAND"
            assert not any(await rig.stream(1.0))

    virtual(test())
