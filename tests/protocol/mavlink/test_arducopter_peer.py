"""The simulated ArduCopter behaves as the real one was seen to: refusals, silent drops, time-outs."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.runtime.clock import LoopClock
from flightd.sim.autopilot.autopilot import PeerConfig, Sticks
from flightd.sim.autopilot.copter import ArduCopterPeer, CopterMode
from flightd.sim.plant.airframe import Airframe, AirframeParams
from tests.protocol.mavlink.raw_client import RawClient
from tests.rigs.event_loops import virtual
from tests.rigs.vehicles import CALM


@asynccontextmanager
async def pair(
    config: PeerConfig | None = None, params: AirframeParams | None = None
) -> AsyncIterator[tuple[ArduCopterPeer, RawClient]]:
    config = config or PeerConfig(ready_s=0.0, parameters={"GUID_TIMEOUT": 3.0})
    peer = ArduCopterPeer(LoopClock(), Airframe(params, CALM), config)
    client = await RawClient.connect(await peer.open())
    async with asyncio.TaskGroup() as tasks:
        serving = tasks.create_task(peer.run())
        await asyncio.sleep(0.05)
        try:
            yield peer, client
        finally:
            serving.cancel()
            client.close()


def armed(peer: ArduCopterPeer) -> bool:
    return peer.armed


async def hovering(peer: ArduCopterPeer, client: RawClient, height_m: float = 1.5) -> float:
    """Take off by thrust; the vehicle's yaw as it reports it."""
    await client.arm_guided()
    await client.stream(30, 50)
    await asyncio.sleep(0.1)
    yaw = float(client.last("ATTITUDE").yaw)
    while peer.truth().height_m < height_m:
        await client.fly(0.1, yaw_rad=yaw, thrust=0.6)
    await client.fly(1.5, yaw_rad=yaw)
    return yaw


def test_only_the_heartbeat_comes_unasked() -> None:
    async def test() -> None:
        async with pair() as (_, client):
            await asyncio.sleep(5.0)
            assert {m.get_type() for _, m in client.heard} == {"HEARTBEAT"}
            assert 4 <= len(client.all("HEARTBEAT")) <= 6
            beat = client.last("HEARTBEAT")
            assert (beat.type, beat.autopilot, beat.custom_mode) == (2, 3, 0)
            assert beat.base_mode & 129 == 1

    virtual(test())


def test_messages_come_at_the_asked_interval_and_stop() -> None:
    async def test() -> None:
        async with pair() as (_, client):
            for message_id in (1, 30, 33, 74, 132, 147, 245):
                await client.stream(message_id, 50)
            await client.stream(0, 20)
            client.heard.clear()
            await asyncio.sleep(2.0)
            for kind in ("ATTITUDE", "DISTANCE_SENSOR", "BATTERY_STATUS", "SYS_STATUS", "EXTENDED_SYS_STATE"):
                assert len(client.all(kind)) == pytest.approx(100, abs=3), kind
            assert len(client.all("HEARTBEAT")) == pytest.approx(40, abs=2)
            assert client.last("DISTANCE_SENSOR").orientation == 25
            assert client.last("DISTANCE_SENSOR").current_distance == pytest.approx(10, abs=3)
            assert client.last("BATTERY_STATUS").battery_remaining == 100
            assert await client.command(511, 30, -1) == 0
            client.heard.clear()
            await asyncio.sleep(1.0)
            assert not client.all("ATTITUDE")
            assert await client.command(511, 9999, 20000) == 2
            assert await client.command(512, 148) == 0
            assert client.last("AUTOPILOT_VERSION").flight_sw_version >> 16 == 0x0405
            assert await client.command(512, 9999) == 4

    virtual(test())


def test_a_ground_stations_stream_request_overwrites_the_rate() -> None:
    async def test() -> None:
        async with pair() as (_, client):
            await client.stream(30, 50)
            client.send(dialect.MAVLink_request_data_stream_message(1, 1, 10, 4, 1))
            await asyncio.sleep(0.5)
            client.heard.clear()
            await asyncio.sleep(2.0)
            assert len(client.all("ATTITUDE")) == pytest.approx(8, abs=1)

    virtual(test())


def test_the_boot_clock_is_its_own_and_timesync_tells_it_both_ways() -> None:
    async def test() -> None:
        async with pair(PeerConfig(clock_ppm=100.0)) as (_, client):
            await asyncio.sleep(10.5)
            client.send(dialect.MAVLink_timesync_message(0, 4711))
            await asyncio.sleep(0.05)
            requests = [m for m in client.all("TIMESYNC") if m.tc1 == 0]
            answers = [m for m in client.all("TIMESYNC") if m.tc1 != 0]
            assert len(requests) == 1
            assert answers[0].ts1 == 4711
            assert answers[0].tc1 / 1e9 == pytest.approx(10.55 * 1.0001, abs=0.002)

    virtual(test())


def test_arming_is_refused_with_the_reason_until_the_sensors_have_settled() -> None:
    async def test() -> None:
        async with pair(PeerConfig(ready_s=20.0)) as (peer, client):
            assert await client.command(176, 1, 20) == 0
            assert await client.command(400, 1) == 4
            text = client.last("STATUSTEXT")
            assert text.text == "PreArm: Gyros still settling"
            assert text.severity == 2
            await asyncio.sleep(20.0)
            peer.arming_block = "Compass not healthy"
            assert await client.command(400, 1) == 4
            assert client.last("STATUSTEXT").text == "PreArm: Compass not healthy"
            peer.arming_block = ""
            assert await client.command(400, 1) == 0
            await asyncio.sleep(0.01)
            assert client.last("HEARTBEAT").base_mode & 128

    virtual(test())


def test_guided_is_acknowledged_on_the_floor_but_not_armed_without_a_position() -> None:
    async def test() -> None:
        async with pair() as (_, client):
            assert await client.command(176, 1, 4) == 0
            assert await client.command(400, 1) == 4
            assert client.last("STATUSTEXT").text == "PreArm: Need Position Estimate"
            assert await client.command(176, 1, 99) == 4
            assert await client.command(176, 0, 20) == 2  # param1 does not say custom mode

    virtual(test())


def test_commands_of_others_are_ignored_and_unknown_ones_unsupported() -> None:
    async def test() -> None:
        async with pair() as (peer, client):
            assert await client.command(176, 1, 20, system=7) is None
            assert await client.command(31999) == 3
            await client.arm_guided()
            assert await client.command(22, 0, 0, 0, 0, 0, 0, 1.5) == 4  # NAV_TAKEOFF in GUIDED_NOGPS
            assert await client.command(400, math.nan) == 2
            assert armed(peer)

    virtual(test())


def test_half_thrust_on_the_floor_disarms_after_the_delay_and_more_takes_off() -> None:
    async def test() -> None:
        async with pair() as (peer, client):
            await client.arm_guided()
            await client.fly(9.5)
            assert armed(peer)
            await client.fly(1.0)
            assert not armed(peer)
            assert peer.truth().height_m == pytest.approx(0.1)
            await client.arm_guided()
            await client.fly(2.0, thrust=0.6, yaw_rad=0.7)
            assert peer.truth().height_m > 0.5
            assert await client.command(400, 0) == 4  # no disarming in the air
            assert armed(peer)

    virtual(test())


@pytest.mark.parametrize(("thrust", "climb_mps"), [(0.6, 0.5), (0.4, -0.3), (0.5, 0.0), (0.45, -0.15)])
def test_thrust_is_a_climb_rate(thrust: float, climb_mps: float) -> None:
    async def test() -> None:
        async with pair() as (peer, client):
            yaw = await hovering(peer, client, 2.0)
            await client.fly(1.0, yaw_rad=yaw, thrust=thrust)
            start_m = peer.truth().height_m
            await client.fly(2.0, yaw_rad=yaw, thrust=thrust)
            assert (peer.truth().height_m - start_m) / 2.0 == pytest.approx(climb_mps, abs=0.06)

    virtual(test())


@pytest.mark.parametrize(
    ("parameters", "rise_m"),
    [({}, 0.35), ({"WPNAV_ACCEL_Z": 100, "PSC_JERK_Z": 5}, 0.75)],
    ids=["as shipped", "the firmware's defaults"],
)
def test_a_climb_that_is_to_end_goes_on_as_the_parameters_have_it(
    parameters: dict[str, float], rise_m: float
) -> None:
    async def test() -> None:
        async with pair(PeerConfig(ready_s=0.0, parameters=parameters)) as (peer, client):
            yaw = await hovering(peer, client, 2.0)
            await client.fly(3.0, yaw_rad=yaw, thrust=0.7)
            end_m = peer.truth().height_m
            await client.fly(3.0, yaw_rad=yaw)
            assert peer.truth().height_m - end_m == pytest.approx(rise_m, rel=0.2)

    virtual(test())


def test_with_the_thrust_option_thrust_is_collective() -> None:
    async def test() -> None:
        async with pair(PeerConfig(ready_s=0.0, parameters={"GUID_OPTIONS": 8})) as (peer, client):
            await client.arm_guided()
            await client.fly(1.0, thrust=0.3, yaw_rad=0.7)
            assert peer.truth().height_m == pytest.approx(0.1)
            await client.fly(3.0, thrust=0.39, yaw_rad=0.7)
            assert peer.truth().climb_mps == pytest.approx(2.5, abs=0.6)
            await asyncio.sleep(6.0)  # time-out falls back to holding the height
            assert abs(peer.truth().climb_mps) < 0.1

    virtual(test())


def test_roll_turns_level_only_after_the_time_out_and_nothing_lands() -> None:
    async def test() -> None:
        async with pair() as (peer, client):
            yaw = await hovering(peer, client)
            height_m = peer.truth().height_m
            await client.fly(0.5, yaw_rad=yaw, roll_deg=8)
            await asyncio.sleep(2.8)
            assert math.degrees(peer.truth().roll_rad) == pytest.approx(8, abs=0.6)
            await asyncio.sleep(1.2)
            assert math.degrees(peer.truth().roll_rad) == pytest.approx(0, abs=0.6)
            await asyncio.sleep(20.0)
            assert armed(peer)
            assert peer.truth().height_m == pytest.approx(height_m, abs=0.1)

    virtual(test())


@pytest.mark.parametrize(
    "setpoint",
    [{"mask": 3}, {"mask": 1}, {"mask": 71}, {"norm": 1.0008}, {"system": 2}, {"thrust": math.nan}],
    ids=["mask 3", "mask 1", "no thrust", "norm", "other system", "thrust NaN"],
)
def test_these_setpoints_are_dropped_in_silence(setpoint: dict[str, Any]) -> None:
    async def test() -> None:
        async with pair() as (peer, client):
            yaw = await hovering(peer, client)
            client.heard.clear()
            await client.fly(2.0, yaw_rad=yaw, roll_deg=8, **setpoint)
            assert math.degrees(peer.truth().roll_rad) == pytest.approx(0, abs=0.6)
            assert {m.get_type() for _, m in client.heard} <= {"HEARTBEAT", "ATTITUDE", "TIMESYNC"}

    virtual(test())


@pytest.mark.parametrize("setpoint", [{}, {"mask": 0}, {"norm": 1.0004}, {"component": 9}])
def test_these_setpoints_are_obeyed(setpoint: dict[str, Any]) -> None:
    async def test() -> None:
        async with pair() as (peer, client):
            yaw = await hovering(peer, client)
            await client.fly(1.0, yaw_rad=yaw, roll_deg=8, **setpoint)
            assert math.degrees(peer.truth().roll_rad) == pytest.approx(8, abs=0.6)

    virtual(test())


def test_the_largest_angle_is_not_enforced() -> None:
    async def test() -> None:
        async with pair() as (peer, client):
            yaw = await hovering(peer, client)
            await client.fly(0.8, yaw_rad=yaw, roll_deg=60)
            assert math.degrees(peer.truth().roll_rad) == pytest.approx(60, abs=2)

    virtual(test())


def test_yaw_in_the_quaternion_is_obeyed_and_rates_turn_it_between_messages() -> None:
    async def test() -> None:
        async with pair() as (peer, client):
            yaw = await hovering(peer, client)
            await client.fly(3.0, yaw_rad=yaw + 0.5)
            assert client.last("ATTITUDE").yaw == pytest.approx(yaw + 0.5, abs=0.02)
            client.attitude(yaw_rad=yaw + 0.5, mask=0, rates=(0.0, 0.0, 0.3))
            await asyncio.sleep(2.0)  # no message: it goes on turning
            assert client.last("ATTITUDE").yaw == pytest.approx(yaw + 0.5 + 0.6, abs=0.05)

    virtual(test())


def test_sinking_lands_and_disarms_by_the_delay_and_land_mode_at_once() -> None:
    async def test() -> None:
        async with pair() as (peer, client):
            yaw = await hovering(peer, client)
            await client.stream(245, 10)
            await client.fly(0.2, yaw_rad=yaw)
            assert client.last("EXTENDED_SYS_STATE").landed_state == 2
            await client.fly(8.0, yaw_rad=yaw, thrust=0.4)
            assert client.last("EXTENDED_SYS_STATE").landed_state == 1
            assert armed(peer)
            await client.fly(11.0, yaw_rad=yaw, thrust=0.4)
            assert not armed(peer)
            await hovering(peer, client)
            assert await client.command(21) == 0
            assert peer.mode == CopterMode.LAND
            await asyncio.sleep(1.0)
            assert client.last("EXTENDED_SYS_STATE").landed_state == 4
            await asyncio.sleep(6.0)
            assert not armed(peer)
            assert peer.truth().height_m == pytest.approx(0.1)
            assert await client.command(400, 1) == 4  # LAND is not armable
            assert "LAND mode not armable" in client.last("STATUSTEXT").text

    virtual(test())


@pytest.mark.parametrize("hover", [0.25, 0.45])
def test_what_it_hovers_at_is_learnt_in_flight_and_tells_when_it_has_landed(hover: float) -> None:
    async def test() -> None:
        async with pair(params=AirframeParams(hover_collective=hover)) as (peer, client):
            yaw = await hovering(peer, client)
            guess = peer.parameters["MOT_THST_HOVER"]
            assert abs(guess - 0.35) < 0.4 * abs(hover - 0.35)
            await client.fly(30.0, yaw_rad=yaw)
            assert peer.parameters["MOT_THST_HOVER"] == pytest.approx(hover, rel=0.03)
            assert not peer.landed
            await client.fly(8.0, yaw_rad=yaw, thrust=0.4)
            assert peer.landed

    virtual(test())


def test_setpoints_are_dropped_in_other_modes_and_the_pilot_flies() -> None:
    async def test() -> None:
        async with pair() as (peer, client):
            yaw = await hovering(peer, client)
            client.heard.clear()
            assert peer.pilot_mode(CopterMode.ALT_HOLD, Sticks(pitch_rad=math.radians(-5)))
            await asyncio.sleep(0.02)
            assert client.last("HEARTBEAT").custom_mode == 2  # told at once
            await client.fly(1.0, yaw_rad=yaw, roll_deg=8)
            assert math.degrees(peer.truth().roll_rad) == pytest.approx(0, abs=0.6)
            assert math.degrees(peer.truth().pitch_rad) == pytest.approx(-5, abs=0.6)
            assert not peer.pilot_mode(CopterMode.LOITER)  # needs a position
            assert peer.mode == CopterMode.ALT_HOLD

    virtual(test())


def test_parameters_are_read_listed_and_set() -> None:
    async def test() -> None:
        async with pair() as (peer, client):
            client.send(dialect.MAVLink_param_request_read_message(1, 1, b"GUID_TIMEOUT", -1))
            client.send(dialect.MAVLink_param_request_read_message(1, 1, b"NO_SUCH_THING", -1))
            client.send(dialect.MAVLink_param_request_list_message(1, 1))
            client.send(dialect.MAVLink_param_set_message(1, 1, b"GUID_TIMEOUT", 0.5, 9))
            client.send(dialect.MAVLink_param_set_message(1, 1, b"GUID_TIMEOUT", math.nan, 9))
            await asyncio.sleep(0.1)
            values = client.all("PARAM_VALUE")
            assert (values[0].param_id, values[0].param_value) == ("GUID_TIMEOUT", 3.0)
            listed = values[1:-2]
            assert len(listed) == listed[0].param_count
            assert [v.param_index for v in listed] == list(range(len(listed)))
            assert [v.param_value for v in values[-2:]] == [0.5, 0.5]
            assert peer.parameters["GUID_TIMEOUT"] == 0.5
            yaw = await hovering(peer, client)
            await client.fly(0.5, yaw_rad=yaw, roll_deg=8)
            await asyncio.sleep(1.5)
            assert math.degrees(peer.truth().roll_rad) == pytest.approx(0, abs=0.7)

    virtual(test())


def test_a_reboot_forgets_streams_and_starts_the_clock_anew() -> None:
    async def test() -> None:
        async with pair(PeerConfig(ready_s=2.0)) as (_, client):
            await asyncio.sleep(3.0)
            await client.stream(30, 20)
            await asyncio.sleep(0.2)
            assert client.last("ATTITUDE").time_boot_ms > 3000
            assert await client.command(246, 1) == 0
            client.heard.clear()
            await asyncio.sleep(0.5)
            assert not client.all("ATTITUDE")
            assert await client.command(400, 1) == 4
            await client.stream(30, 20)
            await asyncio.sleep(0.2)
            assert client.last("ATTITUDE").time_boot_ms < 1500

    virtual(test())


def test_a_low_battery_is_told_once_and_lands_if_so_set() -> None:
    async def test() -> None:
        peer_config = PeerConfig(ready_s=0.0, parameters={"BATT_FS_LOW_ACT": 1})
        async with pair(peer_config) as (peer, client):
            await hovering(peer, client)
            peer.airframe.battery_frac = 0.02
            await client.fly(9.0)
            assert peer.mode != CopterMode.LAND, "a moment of load is no empty battery"
            await client.fly(2.0)
            assert int(peer.mode) == int(CopterMode.LAND)
            texts = [t.text for t in client.all("STATUSTEXT") if "is low" in t.text]
            assert len(texts) == 1

    virtual(test())


def test_truth_is_the_same_whoever_asks_and_however_often() -> None:
    async def flight(asking: bool) -> Any:
        async with pair() as (peer, client):
            await client.arm_guided()
            for _ in range(40):
                client.attitude(yaw_rad=0.7, thrust=0.6)
                await asyncio.sleep(0.05)
                if asking:
                    peer.truth()
            stamp = LoopClock().now_ns() - 33_333_333
            return peer.truth_at(stamp)

    first = virtual(flight(False))
    assert first == virtual(flight(True))
    assert first.height_m > 0.5


def test_garbage_makes_no_channel_and_stops_nothing() -> None:
    async def test() -> None:
        async with pair() as (peer, client):
            loop = asyncio.get_running_loop()
            transport, _ = await loop.create_datagram_endpoint(RawClient, remote_addr=await peer.open())
            for junk in (b"", b"\xfd", b"\xfd" * 300, bytes(range(256)), b"\xfe\x09\x00"):
                transport.sendto(junk)
            await asyncio.sleep(0.1)
            assert len(peer.link.channels) == 1
            assert await client.command(176, 1, 20) == 0
            transport.close()

    virtual(test())


def test_whoever_starts_anew_is_heard_however_many_have_spoken_before() -> None:
    async def test() -> None:
        async with pair(PeerConfig(ready_s=0.0, remotes=(("127.0.0.1", 9),))) as (peer, client):
            for _ in range(20):
                gone = await RawClient.connect(await peer.open())
                await asyncio.sleep(0.3)
                gone.close()
            again = await RawClient.connect(await peer.open())
            await asyncio.sleep(1.5)
            assert again.all("HEARTBEAT")
            assert client.times("HEARTBEAT")[-1] > again.times("HEARTBEAT")[0] - 1.1, "who speaks stays"
            assert ("127.0.0.1", 9) in peer.link.channels
            again.close()

    virtual(test())
