"""The ArduPilot adapter on the wire: what it sends, what it believes, how it retries and lets go."""

from __future__ import annotations

import asyncio
import math
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.ardupilot import GUIDED, ArduPilotVehicle
from flightd.adapters.vehicle.mavlink.outputs import PoseForm
from flightd.adapters.vehicle.mavlink.signing import Signing
from flightd.adapters.vehicle.mavlink.vehicle import MavlinkOptions, MavlinkVehicle
from flightd.core.geometry import wrap_pi
from flightd.core.types import AttitudeSetpoint, Demand, Event, EventLevel, GridPose, VehicleState
from flightd.runtime.clock import LoopClock
from flightd.sim.airframe import Airframe
from flightd.sim.autopilot.copter import ArduCopterPeer, CopterMode
from flightd.sim.autopilot.peer import PeerConfig
from flightd.sim.autopilot.radio import RadioParams
from tests.protocol.mavlink.scripted import PX4, ScriptedAutopilot, scripted
from tests.protocol.rig import Rig, ardupilot_rig, run_virtual

SET_MODE, ARM, INTERVAL = 176, 400, 511
GUIDED_NOGPS, ALT_HOLD, LAND = 20, 2, 9


def known(vehicle: Any) -> VehicleState:
    state = vehicle.state()
    assert state is not None
    return VehicleState(**{name: getattr(state, name) for name in VehicleState.__slots__})


# What we are and ask


def test_we_are_an_onboard_computer_and_beat_once_a_second() -> None:
    async def test() -> None:
        async with scripted() as (autopilot, _):
            await asyncio.sleep(10.0)
            beats = autopilot.all("HEARTBEAT")
            assert 10 <= len(beats) <= 12
            assert {(b.type, b.autopilot, b.get_srcSystem(), b.get_srcComponent()) for b in beats} == {
                (18, 8, 1, 191)
            }

    run_virtual(test)


def test_message_intervals_are_asked_for_and_nothing_else_is_commanded() -> None:
    async def test() -> None:
        async with scripted() as (autopilot, _):
            await asyncio.sleep(1.0)
            asked = {m.param1: m.param2 for m in autopilot.commands(INTERVAL)}
            assert asked[0] == 50_000
            assert asked[30] == 20_000
            assert {m.command for m in autopilot.all("COMMAND_LONG")} == {INTERVAL}

    run_virtual(test)


def test_timesync_is_asked_and_answered() -> None:
    async def test() -> None:
        async with scripted() as (autopilot, _):
            autopilot.say(dialect.MAVLink_timesync_message(0, 4711))
            await asyncio.sleep(0.5)
            answers = [m for m in autopilot.all("TIMESYNC") if m.tc1 != 0]
            assert [m.ts1 for m in answers] == [4711]
            assert answers[0].tc1 == pytest.approx(asyncio.get_running_loop().time() * 1e9 - 0.5e9, abs=1e6)
            assert len([m for m in autopilot.all("TIMESYNC") if m.tc1 == 0]) > 5

    run_virtual(test)


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

    run_virtual(test)


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
        autopilot.parameters = parameters
        async with scripted(autopilot) as (_, vehicle):
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(8.0)
            assert vehicle.send(AttitudeSetpoint(0, climb_mps=0.5))
            await asyncio.sleep(0.1)
            assert autopilot.all("SET_ATTITUDE_TARGET")[-1].thrust == pytest.approx(thrust)

    run_virtual(test)


def test_before_the_meaning_of_thrust_is_known_it_is_not_flown() -> None:
    async def test() -> None:
        autopilot = ScriptedAutopilot()
        autopilot.parameters = {}
        async with scripted(autopilot) as (_, vehicle):
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(3.0)
            assert known(vehicle).refusal == "GUID_OPTIONS not read yet"
            assert not autopilot.commands(ARM)
            assert not autopilot.commands(SET_MODE)
            assert not vehicle.send(AttitudeSetpoint(0))

    run_virtual(test)


@pytest.mark.parametrize(("options", "wanted"), [(0, True), (8, False), (1, True)])
def test_thrust_that_means_something_else_than_configured_is_not_flown(options: int, wanted: bool) -> None:
    async def test() -> None:
        for configured in (wanted, None):
            autopilot = ScriptedAutopilot()
            autopilot.parameters = {"GUID_OPTIONS": options}
            async with scripted(autopilot, raw_thrust=configured) as (_, vehicle):
                vehicle.demand(Demand.FLY)
                await asyncio.sleep(3.0)
                refused = "vehicle.raw_thrust" in known(vehicle).refusal
                assert refused is (configured is not None)
                assert bool(autopilot.commands(ARM)) is not refused

    run_virtual(test)


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

    run_virtual(test)


def test_another_firmware_is_recognised_and_not_flown() -> None:
    async def test() -> None:
        autopilot = ScriptedAutopilot()
        autopilot.autopilot = PX4
        async with scripted(autopilot) as (_, vehicle):
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(2.0)
            assert known(vehicle).refusal == "the autopilot is PX4, the configuration says ARDUPILOT"
            assert not autopilot.commands(SET_MODE)

    run_virtual(test)


# Commands


def test_an_unanswered_command_is_repeated_with_rising_confirmation() -> None:
    async def test() -> None:
        autopilot = ScriptedAutopilot()
        autopilot.results[SET_MODE] = [None, None, 0]
        async with scripted(autopilot) as (_, vehicle):
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(3.0)
            assert [m.confirmation for m in autopilot.commands(SET_MODE)] == [0, 1, 2]
            assert known(vehicle).in_control

    run_virtual(test)


def test_a_dead_command_channel_is_told_and_tried_again_for_ever() -> None:
    async def test() -> None:
        autopilot = ScriptedAutopilot()
        autopilot.results[ARM] = None
        async with scripted(autopilot) as (_, vehicle):
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(10.0)
            assert known(vehicle).refusal == "arming: no answer"
            assert len(autopilot.commands(ARM)) > 12
            autopilot.results[ARM] = 0
            await asyncio.sleep(3.0)
            assert known(vehicle).armed
            assert known(vehicle).refusal == ""

    run_virtual(test)


def test_in_progress_is_waited_for_and_strange_results_are_refusals() -> None:
    async def test() -> None:
        autopilot = ScriptedAutopilot()
        autopilot.results[SET_MODE] = 5
        async with scripted(autopilot) as (_, vehicle):
            autopilot.obeys = False

            def finish(message: Any) -> None:
                if message.command == SET_MODE:
                    ack = dialect.MAVLink_command_ack_message(SET_MODE, 0, 0, 0, 1, 191)
                    asyncio.get_running_loop().call_later(2.0, autopilot.say, ack)

            autopilot.after = finish
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(1.9)
            assert len(autopilot.commands(SET_MODE)) == 1
            assert not known(vehicle).in_control
            await asyncio.sleep(0.3)
            assert known(vehicle).in_control
        autopilot = ScriptedAutopilot()
        autopilot.results[SET_MODE] = 42
        async with scripted(autopilot) as (_, vehicle):
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(1.0)
            assert known(vehicle).refusal == "mode GUIDED_NOGPS: result 42"

    run_virtual(test)


def test_another_clients_acknowledgement_is_not_ours() -> None:
    async def test() -> None:
        autopilot = ScriptedAutopilot()
        autopilot.results[SET_MODE] = None
        autopilot.obeys = False
        async with scripted(autopilot) as (_, vehicle):
            foreign = dialect.MAVLink_command_ack_message(SET_MODE, 0, 0, 0, 255, 190)
            autopilot.after = lambda message: autopilot.say(foreign)
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(2.0)
            assert not known(vehicle).in_control

    run_virtual(test)


def test_arming_is_retried_with_the_autopilots_reason_until_it_is_ready() -> None:
    async def test() -> None:
        async with ardupilot_rig(PeerConfig(ready_s=20.0)) as rig:
            await asyncio.sleep(1.0)
            rig.vehicle.demand(Demand.FLY)
            await asyncio.sleep(3.0)
            assert rig.known().refusal == "arming: failed (PreArm: Gyros still settling)"
            assert rig.known().in_control
            assert not rig.known().armed
            assert 14.0 < await rig.until(lambda: rig.known().armed, 30.0) < 19.0
            assert rig.known().refusal == ""

    run_virtual(test)


def test_the_disarm_delay_ends_the_attempt_and_a_new_demand_begins_another() -> None:
    async def test() -> None:
        async with ardupilot_rig() as rig:
            await rig.until(lambda: rig.vehicle.state() is not None)
            rig.vehicle.demand(Demand.FLY)
            await rig.until(lambda: rig.known().armed)
            await rig.until(lambda: not rig.known().armed, 12.0)  # nobody asked for a climb
            await asyncio.sleep(5.0)
            assert not rig.known().armed
            rig.vehicle.demand(Demand.STANDBY)
            rig.vehicle.demand(Demand.FLY)
            await rig.until(lambda: rig.known().armed)

    run_virtual(test)


def test_a_disarm_demand_on_the_floor_never_disarms_the_pilot() -> None:
    async def test() -> None:
        async with ardupilot_rig() as rig:
            await rig.take_off(1.0)
            while rig.known().armed:
                await rig.stream(0.1, climb_mps=-0.3)
            rig.vehicle.demand(Demand.DISARM)
            await asyncio.sleep(1.0)
            assert rig.peer.pilot_mode(CopterMode.ALT_HOLD)
            assert rig.peer.pilot_arm()
            await asyncio.sleep(5.0)
            assert rig.known().armed

    run_virtual(test)


@pytest.mark.parametrize("has_position", [True, False])
def test_guided_flies_a_vehicle_that_knows_its_position_and_no_other(has_position: bool) -> None:
    async def test() -> None:
        clock = LoopClock()
        peer = ArduCopterPeer(clock, Airframe(), PeerConfig(ready_s=0.5, has_position=has_position))
        host, port = await peer.open()
        vehicle = ArduPilotVehicle(f"udpout://{host}:{port}", clock, flying_mode=GUIDED)
        tasks = [asyncio.create_task(part.run()) for part in (peer, vehicle)]
        rig = Rig(vehicle, peer, lambda: None, lambda apart: None)
        if has_position:
            await rig.take_off(1.0)
            assert rig.known().mode == "GUIDED"
        else:
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(4.0)
            assert rig.known().refusal == "arming: failed (PreArm: Need Position Estimate)"
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    run_virtual(test)


# The pilot


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

    run_virtual(test)


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
                await asyncio.sleep(1.0)
                assert known(vehicle).in_control is ours

    run_virtual(test)


def test_an_accepted_mode_that_never_shows_is_not_held_for_long() -> None:
    async def test() -> None:
        autopilot = ScriptedAutopilot()
        autopilot.obeys = False
        async with scripted(autopilot) as (_, vehicle):
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(1.0)
            assert not known(vehicle).in_control
            assert not vehicle.send(AttitudeSetpoint(0))

    run_virtual(test)


def test_a_failsafe_of_the_autopilot_counts_as_a_take_over() -> None:
    async def test() -> None:
        async with ardupilot_rig(PeerConfig(ready_s=0.5, parameters={"BATT_FS_LOW_ACT": 1})) as rig:
            await rig.take_off()
            rig.peer.airframe.battery_frac = 0.02
            await rig.until(lambda: not rig.known().in_control, 2.0)
            assert rig.known().mode == "LAND"
            assert not any(await rig.stream(1.0))

    run_virtual(test)


# The link


def test_rates_that_a_ground_station_overwrote_are_asked_for_again() -> None:
    async def test() -> None:
        async with ardupilot_rig() as rig:
            await asyncio.sleep(5.0)
            assert isinstance(rig.vehicle, MavlinkVehicle)
            requests = rig.vehicle.streams.requests
            await asyncio.sleep(10.0)
            assert rig.vehicle.streams.requests == requests
            for channel in rig.peer.link.channels.values():
                channel.stream(30, 250_000_000, round(asyncio.get_running_loop().time() * 1e9))
            rig.vehicle.attitudes()
            await asyncio.sleep(5.0)
            rig.vehicle.attitudes()
            await asyncio.sleep(1.0)
            assert len(rig.vehicle.attitudes()) == pytest.approx(50, abs=3)

    run_virtual(test)


def test_a_denied_stream_is_not_asked_for_all_the_time() -> None:
    async def test() -> None:
        autopilot = ScriptedAutopilot()
        autopilot.results[INTERVAL] = 2
        async with scripted(autopilot) as (_, _vehicle):
            await asyncio.sleep(20.0)
            assert len(autopilot.commands(INTERVAL)) < 12

    run_virtual(test)


def test_a_rebooted_autopilot_is_heard_again_with_its_new_clock() -> None:
    async def test() -> None:
        async with ardupilot_rig() as rig:
            await asyncio.sleep(10.0)
            rig.peer.reboot()
            await asyncio.sleep(10.0)
            rig.vehicle.attitudes()
            await asyncio.sleep(1.0)
            samples = rig.vehicle.attitudes()
            assert len(samples) == pytest.approx(50, abs=3)
            now_ns = asyncio.get_running_loop().time() * 1e9
            assert 0 <= now_ns - samples[-1].stamp_ns < 0.05e9
            await rig.take_off()

    run_virtual(test)


def test_a_reboot_in_control_is_hands_off() -> None:
    async def test() -> None:
        async with ardupilot_rig() as rig:
            await rig.until(lambda: rig.vehicle.state() is not None)
            rig.vehicle.demand(Demand.FLY)
            await rig.until(lambda: rig.known().armed)
            rig.peer.reboot()
            await asyncio.sleep(10.0)
            assert not rig.known().in_control
            assert not rig.known().armed
            assert not any(await rig.stream(1.0))

    run_virtual(test)


def test_an_overtaken_heartbeat_is_no_take_over() -> None:
    async def test() -> None:
        autopilot = ScriptedAutopilot()
        async with scripted(autopilot) as (_, vehicle):
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(2.0)
            (channel,) = autopilot.link.channels.values()
            old = dialect.MAVLink_heartbeat_message(2, 3, 129, ALT_HOLD, 4, 3)
            channel._packer.seq = (channel._packer.seq - 3) % 256
            autopilot.say(old)
            channel._packer.seq = (channel._packer.seq + 2) % 256
            await asyncio.sleep(0.5)
            assert known(vehicle).in_control
            autopilot.say(old)  # the same, but new
            await asyncio.sleep(0.1)
            assert not known(vehicle).in_control

    run_virtual(test)


def test_a_poor_radio_is_flown_through() -> None:
    async def test() -> None:
        radio = RadioParams(loss=0.1, delay_s=0.02, jitter_s=0.02, doubled=0.05)
        async with ardupilot_rig(PeerConfig(ready_s=0.5, radio=radio)) as rig:
            await rig.take_off(1.5)
            for rate in (0.3, -0.3):
                sent = await rig.stream(5.0, yaw_rate_radps=rate)
                assert all(sent)
                assert rig.known().in_control
            samples = rig.vehicle.attitudes()
            stamps = [sample.stamp_ns for sample in samples]
            assert stamps == sorted(stamps)
            errors = [
                abs(wrap_pi(s.yaw_rad - rig.peer.truth_at(s.stamp_ns).yaw_rad - 0.7)) for s in samples[-80:]
            ]
            assert sum(errors) / len(errors) < math.radians(1.0)  # 30 ms of a 17 deg/s turn are half a degree
            rig.take_over()
            assert await rig.until(lambda: not rig.known().in_control, 1.0) < 0.3

    run_virtual(test)


def test_either_side_may_start_first() -> None:
    async def test() -> None:
        async with ardupilot_rig(peer_runs=False) as rig:
            rig.peer.link.close()  # nobody listens: the kernel answers with ICMP
            await asyncio.sleep(5.0)
            assert rig.vehicle.state() is None
            address = rig.peer._address
            rig.peer._address = None
            rig.peer._config = PeerConfig(ready_s=0.5, port=address[1])
            serving = asyncio.create_task(rig.peer.run())
            await rig.take_off(1.0)
            serving.cancel()
            await asyncio.gather(serving, return_exceptions=True)

    run_virtual(test)


# Poses


def test_the_grid_pose_is_shared_at_thirty_hertz_if_so_chosen() -> None:
    async def test() -> None:
        pose = GridPose(0, "A1", 0.0, 0.0, 0.0, 1.0, 2.0, 0.0, 0.0, 1.5, (0.01,) * 9, 0.9)
        near, far = (pose.x_m + 0.4, pose.y_m), (pose.x_m + 4.0, pose.y_m)
        for form, pad_m, expected, targets in (
            (PoseForm.ODOMETRY, near, 60, 60),
            (PoseForm.ODOMETRY, far, 60, 0),
            (None, near, 0, 0),
        ):
            async with scripted(pose_form=form) as (autopilot, vehicle):
                autopilot.say(dialect.MAVLink_distance_sensor_message(0, 5, 800, 150, 0, 0, 25, 0))
                await asyncio.sleep(0.1)
                for _ in range(100):
                    autopilot.say(dialect.MAVLink_distance_sensor_message(0, 5, 800, 150, 0, 0, 25, 0))
                    vehicle.share_pose(pose, pad_m)
                    await asyncio.sleep(0.02)
                assert len(autopilot.all("ODOMETRY")) == pytest.approx(expected, abs=3)
                assert len(autopilot.all("LANDING_TARGET")) == pytest.approx(targets, abs=3)

    run_virtual(test)


def test_an_estimator_that_gets_our_pose_gets_an_origin_until_it_reports_one() -> None:
    async def test() -> None:
        for form in (PoseForm.ODOMETRY, None):
            async with scripted(pose_form=form, origin_deg=(47.5, -8.25)) as (autopilot, _):
                await asyncio.sleep(9.0)
                sent = autopilot.all("SET_GPS_GLOBAL_ORIGIN")
                if form is None:
                    assert not sent
                    continue
                assert len(sent) >= 2  # nobody answered
                assert (sent[0].latitude, sent[0].longitude) == (475_000_000, -82_500_000)
                autopilot.say(dialect.MAVLink_gps_global_origin_message(475_000_000, -82_500_000, 0, 0))
                await asyncio.sleep(5.0)
                known = len(autopilot.all("SET_GPS_GLOBAL_ORIGIN"))
                await asyncio.sleep(10.0)
                assert len(autopilot.all("SET_GPS_GLOBAL_ORIGIN")) == known
                autopilot.say(dialect.MAVLink_attitude_message(1, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0))  # a reboot
                await asyncio.sleep(3.0)
                assert len(autopilot.all("SET_GPS_GLOBAL_ORIGIN")) > known

    run_virtual(test)


# Texts


def test_events_are_shown_as_texts_long_ones_in_chunks() -> None:
    async def test() -> None:
        async with scripted() as (autopilot, vehicle):
            vehicle.notify(Event(0, EventLevel.WARNING, "phase", "hold"))
            vehicle.notify(Event(0, EventLevel.ERROR, "long", "x" * 100))
            await asyncio.sleep(0.1)
            texts = autopilot.all("STATUSTEXT")
            assert (texts[0].severity, texts[0].text, texts[0].id) == (4, "phase: hold", 0)
            assert [t.chunk_seq for t in texts[1:]] == [0, 1, 2]
            assert len({t.id for t in texts[1:]}) == 1
            assert texts[1].id > 0
            assert "".join(t.text for t in texts[1:]) == "long: " + "x" * 100

    run_virtual(test)


def test_a_reason_in_chunks_is_told_whole() -> None:
    async def test() -> None:
        autopilot = ScriptedAutopilot()
        autopilot.results[ARM] = 4
        async with scripted(autopilot) as (_, vehicle):

            def explain(message: Any) -> None:
                if message.command == ARM:
                    for number, part in enumerate((b"PreArm: " + b"y" * 42, b"z" * 10)):
                        autopilot.say(dialect.MAVLink_statustext_message(2, part, 9, number))

            autopilot.after = explain
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(2.0)
            assert known(vehicle).refusal == "arming: failed (PreArm: " + "y" * 42 + "z" * 10 + ")"

    run_virtual(test)


def test_the_flight_over_a_signed_link() -> None:
    async def test() -> None:
        key, clock = bytes(range(32)), LoopClock()
        peer = ArduCopterPeer(clock, Airframe(), PeerConfig(ready_s=0.5, signing_key=key))
        host, port = await peer.open()
        url = f"udpout://{host}:{port}"
        signed = ArduPilotVehicle(url, clock, MavlinkOptions(signing=Signing(key, clock, 1_795_000_000.0)))
        bare = ArduPilotVehicle(url, clock)
        tasks = [asyncio.create_task(part.run()) for part in (peer, signed, bare)]
        rig = Rig(signed, peer, lambda: None, lambda apart: None)
        await rig.take_off(1.0)
        assert len(peer.link.channels) == 1  # the unsigned one was never heard
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    run_virtual(test)


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

    run_virtual(test)
