"""The link in use: rates kept, reboots, a poor radio, either side first; poses and texts over it."""

from __future__ import annotations

import asyncio
import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.ardupilot import ArduPilotVehicle
from flightd.adapters.vehicle.mavlink.link.codec import Codec, FrameParser
from flightd.adapters.vehicle.mavlink.pose_output import PoseForm
from flightd.adapters.vehicle.mavlink.required_parameters import Job
from flightd.adapters.vehicle.mavlink.services.statustext import TextAssembler, make_texts
from flightd.adapters.vehicle.mavlink.vehicle import MavlinkVehicle
from flightd.config.vehicle import DEFAULT_ORIGIN_DEG
from flightd.core.geometry import wrap_pi
from flightd.core.refusal import words
from flightd.core.shared_pose import SharedPose
from flightd.core.types import Attitude, Demand, Event, EventLevel
from flightd.runtime.clock import LoopClock
from flightd.runtime.free_ports import free_port
from flightd.sim.autopilot.autopilot import PeerConfig
from flightd.sim.autopilot.copter import ArduCopterPeer, CopterMode
from flightd.sim.autopilot.radio import RadioParams
from tests.protocol.mavlink.scripted_autopilot import (
    ALT_HOLD,
    ARM,
    INTERVAL,
    ScriptedAutopilot,
    known,
    scripted,
)
from tests.rigs.event_loops import virtual
from tests.rigs.vehicles import PATIENT_COPTER, ardupilot_rig, mavlink_rig


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

    virtual(test())


def test_a_denied_stream_is_not_asked_for_all_the_time() -> None:
    async def test() -> None:
        autopilot = ScriptedAutopilot()
        autopilot.results[INTERVAL] = 2
        async with scripted(autopilot) as (_, _vehicle):
            await asyncio.sleep(20.0)
            assert len(autopilot.commands(INTERVAL)) < 12

    virtual(test())


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

    virtual(test())


def test_an_overtaken_heartbeat_is_no_take_over() -> None:
    async def test() -> None:
        autopilot = ScriptedAutopilot()
        async with scripted(autopilot) as (_, vehicle):
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(2.0)
            (channel,) = autopilot.link.channels.values()
            old = dialect.MAVLink_heartbeat_message(2, 3, 129, ALT_HOLD, 4, 3)
            overtaken = channel.pack(old, 0)
            autopilot.beat()
            autopilot.link.transmit(overtaken, channel.address)
            await asyncio.sleep(0.5)
            assert known(vehicle).in_control
            autopilot.say(old)  # the same, but new
            await asyncio.sleep(0.1)
            assert not known(vehicle).in_control

    virtual(test())


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

    virtual(test())


def test_either_side_may_start_first() -> None:
    async def test() -> None:
        config = PeerConfig(ready_s=0.5, port=free_port())
        async with ardupilot_rig(config, peer_runs=False) as rig:
            rig.peer.close()  # nobody listens: the kernel answers with ICMP
            await asyncio.sleep(5.0)
            assert rig.vehicle.state() is None
            serving = asyncio.create_task(rig.peer.run())
            await rig.take_off(1.0)
            serving.cancel()
            await asyncio.gather(serving, return_exceptions=True)

    virtual(test())


# Poses


_TAKES = {"VISO_TYPE": 1.0, "VISO_DELAY_MS": 80.0, "EK3_SRC1_POSXY": 6.0, "EK3_SRC1_VELXY": 6.0}


def taking(**other: float) -> ScriptedAutopilot:
    """An ArduCopter whose parameters take our motion, but for the `other` ones."""
    autopilot = ScriptedAutopilot()
    autopilot.parameters.update(_TAKES | other)
    return autopilot


def test_the_motion_is_told_at_thirty_hertz_if_so_chosen_and_taken() -> None:
    async def test() -> None:
        pose = SharedPose(
            0, Attitude(0, 0.0, 0.0, 0.0), 0.0, 1.0, 2.0, 0.0, 0.0, 1.5, (0.01, 0.01), (0.01, 0.01), 0.01, 0.9
        )
        near, far = (pose.x_m + 0.4, pose.y_m), (pose.x_m + 4.0, pose.y_m)
        for form, pad_m, expected, targets, other in (
            (PoseForm.ODOMETRY, near, 60, 60, {}),
            (PoseForm.ODOMETRY, far, 60, 0, {}),
            (None, near, 0, 0, {}),
            (PoseForm.ODOMETRY, near, 0, 0, {"VISO_TYPE": 0.0}),
            (PoseForm.ODOMETRY, near, 0, 0, {"EK3_SRC1_YAW": 6.0}),
        ):
            async with scripted(taking(**other), pose_form=form) as (autopilot, vehicle):
                autopilot.say(dialect.MAVLink_distance_sensor_message(0, 5, 800, 150, 0, 0, 25, 0))
                await asyncio.sleep(2.0)
                for _ in range(100):
                    autopilot.say(dialect.MAVLink_distance_sensor_message(0, 5, 800, 150, 0, 0, 25, 0))
                    vehicle.share_pose(pose, pad_m)
                    await asyncio.sleep(0.02)
                assert len(autopilot.all("ODOMETRY")) == pytest.approx(expected, abs=3)
                assert len(autopilot.all("LANDING_TARGET")) == pytest.approx(targets, abs=3)

    virtual(test())


def test_guided_by_our_pose_gets_an_origin_until_it_reports_one() -> None:
    async def test() -> None:
        for form, guided, other in (
            (PoseForm.ODOMETRY, True, {}),
            (PoseForm.ODOMETRY, False, {}),
            (None, True, {}),
            (PoseForm.ODOMETRY, True, {"VISO_TYPE": 0.0}),
        ):
            async with scripted(
                taking(**other), pose_form=form, origin_deg=(47.5, -8.25), job=Job(guided=guided)
            ) as (autopilot, _):
                await asyncio.sleep(9.0)
                sent = autopilot.all("SET_GPS_GLOBAL_ORIGIN")
                if form is None or other or not guided:
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

    virtual(test())


@pytest.mark.parametrize(
    ("sent_deg", "other_deg", "told"),
    [
        (DEFAULT_ORIGIN_DEG, None, True),
        (DEFAULT_ORIGIN_DEG, (47.5, -8.25), False),
        ((60.0, 10.0), None, False),
    ],
)
def test_a_compass_refused_by_the_shipped_origin_is_told_to_be_so(
    sent_deg: tuple[float, float], other_deg: tuple[float, float] | None, told: bool
) -> None:
    async def test() -> None:
        autopilot = taking()
        autopilot.results[ARM] = dialect.MAV_RESULT_FAILED

        def refuse(command: Any) -> None:
            if command.command == ARM:
                autopilot.say(dialect.MAVLink_statustext_message(2, b"Arm: Check mag field (z diff:520>200)"))

        autopilot.after = refuse
        async with scripted(
            autopilot, pose_form=PoseForm.ODOMETRY, origin_deg=sent_deg, job=Job(guided=True)
        ) as (_, vehicle):
            await asyncio.sleep(5.0)
            place = (round(degrees * 1e7) for degrees in other_deg or sent_deg)
            autopilot.say(dialect.MAVLink_gps_global_origin_message(*place, 0, 0))
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(3.0)
            refusal = words(known(vehicle).refusal)
            assert "Check mag field" in refusal
            assert ("vehicle.origin_deg is the shipped default" in refusal) is told

    virtual(test())


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

    virtual(test())


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
            assert words(known(vehicle).refusal) == "arming: failed (PreArm: " + "y" * 42 + "z" * 10 + ")"

    virtual(test())


@given(st.text("ab", max_size=300))
def test_long_texts_end_where_they_end(text: str) -> None:
    messages = make_texts(4, text, 7)
    heard = TextAssembler()
    told = [whole for message in messages for whole in heard.add(_sent(message))]
    assert told == [(4, text[:199])]


def test_texts_from_a_sender_that_never_changes_their_id_are_told_and_do_not_pile_up() -> None:
    heard = TextAssembler()
    texts = [f"{number:050}" for number in range(100)]
    told = [
        text
        for part in texts
        for _ in range(2)  # a poor radio doubles them
        for _, text in heard.add(_sent(dialect.MAVLink_statustext_message(4, part.encode(), 1, 0)))
    ]
    assert told == texts[:-1]


def _sent(message: Any) -> Any:
    """The message as it arrives."""
    (heard,) = FrameParser(Codec(1)).datagram(Codec(1).pack(message))
    return heard


def test_heartbeats_too_rare_to_see_a_take_over_in_time_are_told_once() -> None:
    async def test() -> None:
        for hz, told in ((1.0, 1), (20.0, 0)):
            autopilot = ScriptedAutopilot()
            autopilot.results[INTERVAL] = 2  # denied
            async with scripted(autopilot, beats=False):
                beating = asyncio.create_task(autopilot.run(hz))
                await asyncio.sleep(60.0)
                texts = [m.text for m in autopilot.all("STATUSTEXT") if m.text.startswith("heartbeat_rate")]
                beating.cancel()
                await asyncio.wait([beating])
            assert len(texts) == told

    virtual(test())


class _Faulty(ArduPilotVehicle):
    """When told, something beside its demand fails again and again, or something that nobody looks after."""

    def __init__(self, url: str, clock: LoopClock) -> None:
        super().__init__(url, clock)
        self.beside, self.within = asyncio.Event(), asyncio.Event()
        self.failures = 0

    def _serve(self, tasks: asyncio.TaskGroup) -> None:
        super()._serve(tasks)
        tasks.create_task(self._once_heard(self._fail_beside), name="beside")
        tasks.create_task(self._fail(self.within), name="within")

    async def _fail_beside(self) -> None:
        await self._fail(self.beside)

    async def _fail(self, told: asyncio.Event) -> None:
        await told.wait()
        self.failures += 1
        raise ValueError("a fault")


def test_what_fails_beside_the_demand_ends_no_flight_and_an_adapter_that_fails_lands_it() -> None:
    seen: list[tuple[bool, int, bool]] = []

    async def test() -> None:
        async with mavlink_rig(ArduCopterPeer, _Faulty, CopterMode.ALT_HOLD, patience=PATIENT_COPTER) as rig:
            await rig.take_off()
            vehicle, flying = rig.vehicle, rig.flying_task
            assert isinstance(vehicle, _Faulty)
            assert flying is not None
            vehicle.beside.set()
            await rig.stream(2.5)
            assert vehicle.failures > 1
            seen.append((flying.done(), rig.peer.mode, rig.peer.armed))
            vehicle.within.set()
            await asyncio.sleep(0.5)
            seen.append((flying.done(), rig.peer.mode, rig.peer.armed))
            await asyncio.sleep(9.5)
            seen.append((flying.done(), rig.peer.mode, rig.peer.armed))

    with pytest.raises(AssertionError, match="a fault"):  # what the adapter ended with
        virtual(test())
    land = CopterMode.LAND
    assert seen == [(False, CopterMode.GUIDED_NOGPS, True), (True, land, True), (True, land, False)]
