"""The emulated drone does what is known of the real one, byte by byte, rule by rule."""

from __future__ import annotations

import asyncio
import itertools
import struct
from typing import Any

import pytest

from flightd.sim.ardrone import configuration
from flightd.sim.ardrone.states import (
    BIT_BOOTSTRAP,
    BIT_COM_LOST,
    BIT_COM_WATCHDOG,
    BIT_COMMAND_ACK,
    BIT_CUTOUT,
    BIT_DEMO,
    BIT_EMERGENCY,
    BIT_FLY,
    BIT_VBAT_LOW,
    DroneOptions,
    MajorState,
)
from tests.protocol.ardrone import golden
from tests.protocol.ardrone.raw_client import RawClient, raw_drone
from tests.rigs.ardrone import make_drone
from tests.rigs.event_loops import virtual

FLY, LAND, PRESS = "REF,290718208", "REF,290717696", "REF,290717952"
HOVER = "PCMD,0,0,0,0,0"


def demo_fields(packet: bytes) -> tuple[Any, ...]:
    """(ctrl state, battery, theta, phi, psi, altitude, vx, vy, vz) of a packet's first option."""
    return struct.unpack_from("<IIfffifff", packet, 20)


async def up(client: RawClient) -> None:
    """Configure demo navdata, take off, wait until the drone hovers."""
    client.wake()
    await client.configure("general:navdata_demo", "TRUE")
    while client.server.drone.major != MajorState.HOVERING:
        await client.keep_saying(0.1, FLY, HOVER)


def test_bootstrap_packets_have_24_bytes_and_number_one_until_configured() -> None:
    async def main() -> None:
        async with raw_drone() as client:
            client.wake(b"\x01")
            await asyncio.sleep(0.5)
            assert {len(packet) for _, packet in client.packets} == {24}
            assert client.state & BIT_BOOTSTRAP
            assert client.state & BIT_DEMO
            assert client.sequence == 1
            await client.configure("general:navdata_demo", "TRUE")
            client.packets.clear()
            await client.keep_saying(1.0, LAND)
            assert not client.state & BIT_BOOTSTRAP
            numbers = [struct.unpack_from("<I", packet, 8)[0] for _, packet in client.packets]
            assert numbers == list(range(2, 2 + len(numbers)))
            assert 14 <= len(numbers) <= 16
            assert {len(packet) for _, packet in client.packets} == {500}

    virtual(main())


def test_full_navdata_comes_two_hundred_times_a_second_with_all_options() -> None:
    async def main() -> None:
        async with raw_drone() as client:
            client.wake()
            await client.configure("general:navdata_demo", "FALSE")
            client.packets.clear()
            await client.keep_saying(1.0, LAND)
            times = [at_ns for at_ns, _ in client.packets]
            assert {after - before for before, after in itertools.pairwise(times)} == {5_000_000}
            assert len(client.newest) == 2120
            assert not client.state & BIT_DEMO

    virtual(main())


def test_only_larger_numbers_are_obeyed_and_one_starts_afresh() -> None:
    async def main() -> None:
        async with raw_drone() as client:
            drone = client.server.drone
            for datagram, last in (
                (b"AT*COMWDG=0\r", 0),
                (b"AT*COMWDG=10\r", 10),
                (b"AT*REF=9,512\r", 10),
                (b"AT*REF=10,512\r", 10),
                (b"AT*COMWDG=4000\rAT*COMWDG=4001\rAT*COMWDG=3999\r", 4001),
                (b"AT*COMWDG=1\r", 1),
                (b"AT*COMWDG=2\r", 2),
            ):
                client.raw(datagram)
                await asyncio.sleep(0.01)
                assert drone.last_sequence == last
            assert drone.major == MajorState.LANDED

    virtual(main())


@pytest.mark.parametrize(
    "datagram",
    [
        b"AT*COMWDG=5",
        b"AT*COMWDG=5\n",
        b"AT*COMWDG\r",
        b"AT*COMWDG=\r",
        b"AT*COMWDG=-5\r",
        b"AT*COMWDG=99999999999\r",
        b"at*comwdg=5\r",
        b"ATCOMWDG=5\r",
        b'AT*CONFIG=5,"a:b,"c"\r',
        b"AT*REF=5,1.5\r",
        b"\xff\xfe\r\r\r",
        b"AT*COMWDG=5\r" + b" " * 1024,
    ],
)
def test_what_is_no_command_is_passed_over(datagram: bytes) -> None:
    async def main() -> None:
        async with raw_drone() as client:
            client.raw(datagram)
            await asyncio.sleep(0.01)
            assert client.server.drone.last_sequence == 0
            client.raw(b"garbage\rAT*COMWDG=7\rmore")
            await asyncio.sleep(0.01)
            assert client.server.drone.last_sequence == 7

    virtual(main())


def test_unknown_commands_count_as_traffic_and_do_nothing() -> None:
    async def main() -> None:
        async with raw_drone() as client:
            client.wake()
            await client.keep_saying(
                0.3, "LED,0,1084227584,2", "ANIM,18,1000", "PMODE,2", "MISC,2,20,2000,3000"
            )
            assert not client.state & BIT_COM_WATCHDOG
            assert client.server.drone.major == MajorState.LANDED

    virtual(main())


@pytest.mark.parametrize("fly", ["REF,512", FLY])
def test_take_off_and_landing_pass_through_their_states(fly: str) -> None:
    async def main() -> None:
        async with raw_drone() as client:
            drone = client.server.drone
            client.wake()
            await client.configure("general:navdata_demo", "TRUE")
            seen: list[int] = []
            for order in (fly, "REF,0"):
                for _ in range(300):
                    client.say(order, HOVER)
                    await asyncio.sleep(0.03)
                    major = demo_fields(client.newest)[0] >> 16
                    if len(client.newest) > 24 and major not in seen[-1:]:
                        seen.append(major)
            assert seen == [
                MajorState.LANDED,
                MajorState.TAKE_OFF,
                MajorState.HOVERING,
                MajorState.LANDING,
                MajorState.LANDED,
            ]
            assert drone.airframe.touchdown_mps < 0.6
            assert not client.state & BIT_FLY

    virtual(main())


def test_a_weak_battery_refuses_without_a_word() -> None:
    async def main() -> None:
        async with raw_drone(make_drone(battery_frac=0.19)) as client:
            client.wake()
            await client.keep_saying(3.0, FLY, HOVER)
            assert client.server.drone.major == MajorState.LANDED
            assert client.state & BIT_VBAT_LOW
            assert not client.state & BIT_EMERGENCY

    virtual(main())


def test_bit_eight_acts_on_its_rising_edge_only() -> None:
    async def main() -> None:
        async with raw_drone() as client:
            drone = client.server.drone
            await up(client)
            await client.keep_saying(0.2, PRESS)
            assert drone.emergency, "held down it does not toggle back"
            assert client.state & BIT_EMERGENCY
            assert not client.state & BIT_FLY
            await client.keep_saying(1.0, FLY)
            assert drone.emergency, "nothing but the edge clears it"
            await client.keep_saying(0.1, LAND)
            await client.keep_saying(0.1, PRESS)
            assert not client.state & BIT_EMERGENCY
            assert drone.airframe.height_m == pytest.approx(0.1)

    virtual(main())


def test_a_lasting_fault_comes_back_after_clearing() -> None:
    async def main() -> None:
        async with raw_drone() as client:
            drone = client.server.drone
            await up(client)
            drone.faults = BIT_CUTOUT
            await client.keep_saying(0.2, LAND)
            assert client.state & BIT_EMERGENCY
            assert client.state & BIT_CUTOUT
            await client.keep_saying(0.2, PRESS)
            assert drone.emergency

    virtual(main())


def test_the_watchdogs_rise_after_50_ms_and_two_seconds() -> None:
    async def main() -> None:
        async with raw_drone() as client:
            client.wake()
            await client.configure("general:navdata_demo", "FALSE")
            await client.keep_saying(0.3, LAND)
            silent_ns = client.clock.now_ns() - 30_000_000
            await asyncio.sleep(0.2)
            states = [(at_ns - silent_ns, struct.unpack_from("<I", p, 4)[0]) for at_ns, p in client.packets]
            late = [after_ns for after_ns, state in states if after_ns > 0 and state & BIT_COM_WATCHDOG]
            assert 50_000_000 < late[0] <= 60_000_000
            client.say("COMWDG")
            assert not await client.next_state() & BIT_COM_WATCHDOG
            await asyncio.sleep(2.1)
            client.packets.clear()
            await asyncio.sleep(1.0)
            assert client.packets == [], "communication lost: silence"
            assert client.server.drone.last_sequence == 0
            client.wake()
            assert await client.next_state() & (BIT_COM_LOST | BIT_BOOTSTRAP) == BIT_COM_LOST | BIT_BOOTSTRAP
            client.raw(b"AT*COMWDG=5\r")
            assert not await client.next_state() & BIT_COM_LOST
            assert client.server.drone.last_sequence == 5

    virtual(main())


def test_without_commands_it_keeps_the_last_tilt_and_then_lands() -> None:
    async def main() -> None:
        async with raw_drone() as client:
            drone = client.server.drone
            await up(client)
            await client.keep_saying(0.5, FLY, "PCMD,1,0,-1097229926,0,0")
            speed = drone.airframe.vx_mps
            await asyncio.sleep(1.5)
            assert drone.airframe.vx_mps > speed + 0.3
            await asyncio.sleep(6.0)
            assert drone.major == MajorState.LANDED
            assert drone.airframe.on_floor

    virtual(main())


def test_pcmd_means_fractions_of_the_configured_limits() -> None:
    async def main() -> None:
        async with raw_drone() as client:
            air = client.server.drone.airframe
            await up(client)
            await client.configure("control:euler_angle_max", "0.3")
            await client.keep_saying(0.8, FLY, "PCMD,1,1056964608,-2147483648,0,0")
            assert air.roll_rad == pytest.approx(0.15, abs=0.01)
            await client.keep_saying(1.5, FLY, "PCMD_MAG,1,0,0,1056964608,-1090519040,0,0")
            assert air.climb_mps == pytest.approx(0.35, abs=0.06)
            assert air.yaw_speed_radps == pytest.approx(-0.873, abs=0.08)
            await client.keep_saying(2.5, FLY, HOVER)
            assert abs(air.vx_mps) + abs(air.vy_mps) < 0.3
            assert demo_fields(client.newest)[8] == 0.0, "vz is never filled"

    virtual(main())


def test_altitude_max_and_flying_mode_hold_it_back() -> None:
    async def main() -> None:
        async with raw_drone() as client:
            air = client.server.drone.airframe
            await up(client)
            await client.configure("control:altitude_max", "1500")
            await client.keep_saying(5.0, FLY, "PCMD,1,0,0,1065353216,0")
            assert air.height_m == pytest.approx(1.5, abs=0.2)
            await client.configure("control:flying_mode", "1")
            await client.keep_saying(1.0, FLY, "PCMD,1,1056964608,0,0,0")
            assert abs(air.roll_rad) < 0.08

    virtual(main())


def test_config_is_acknowledged_and_ignored_until_the_bit_is_cleared() -> None:
    async def main() -> None:
        async with raw_drone() as client:
            stored = client.server.drone.configuration
            client.wake()
            client.say("COMWDG")
            assert not await client.next_state() & BIT_COMMAND_ACK
            client.say('CONFIG,"control:altitude_max","2000"')
            assert await client.next_state() & BIT_COMMAND_ACK
            client.say('CONFIG,"control:altitude_max","4000"')
            await asyncio.sleep(0.05)
            assert stored.text("control:altitude_max") == "2000"
            client.say("CTRL,5,0", 'CONFIG,"control:altitude_max","4000"')
            await asyncio.sleep(0.05)
            assert stored.text("control:altitude_max") == "4000"
            client.say("CTRL,0,0", 'CONFIG,"no:such_key","1"')
            assert await client.next_state() & BIT_COMMAND_ACK, "wrong keys are acknowledged too"

    virtual(main())


def test_profiled_writes_need_config_ids_in_the_same_breath() -> None:
    async def main() -> None:
        async with raw_drone() as client:
            stored = client.server.drone.configuration
            client.wake()
            for name, value in (
                ("session", "00000001"),
                ("profile", "00000002"),
                ("application", "00000003"),
            ):
                await client.configure(f"custom:{name}_id", value)
                await asyncio.sleep(0.5)
            ids = 'CONFIG_IDS,"00000001","00000002","00000003"'
            write = 'CONFIG,"video:video_codec","131"'
            for group, value in (
                ([write], "129"),
                ([ids, "COMWDG", write], "129"),
                (['CONFIG_IDS,"00000001","00000003","00000002"', write], "129"),
                ([ids, write], "131"),
            ):
                client.say("CTRL,5,0", *group)
                await asyncio.sleep(0.02)
                assert stored.text("video:video_codec") == value

    virtual(main())


def test_all_values_are_sent_over_tcp_with_a_closing_nul() -> None:
    async def main() -> None:
        async with raw_drone() as client:
            ports = client.server.ports
            reader, writer = await asyncio.open_connection(ports.host, ports.control)
            client.wake()
            client.say("CTRL,4,0")
            text = (await reader.readuntil(b"\0")).decode()
            assert await client.next_state() & BIT_COMMAND_ACK
            lines = text[:-1].splitlines()
            assert [line.partition(" = ")[0] for line in lines] == list(configuration.KEYS)
            assert "general:num_version_soft = 2.4.8" in lines
            client.say("CTRL,5,0", "CTRL,6,0")
            assert (await reader.readuntil(b"\0")).startswith(b"[applis]\n")
            writer.close()

    virtual(main())


def test_a_reboot_counts_everything_from_the_start() -> None:
    async def main() -> None:
        async with raw_drone() as client:
            client.wake()
            await client.configure("general:navdata_demo", "TRUE")
            await client.keep_saying(1.0, LAND)
            client.server.reboot()
            client.packets.clear()
            await asyncio.sleep(0.5)
            assert client.packets == []
            client.wake()
            assert await client.next_state() & BIT_BOOTSTRAP
            assert client.sequence == 1
            assert client.server.drone.configuration.flag("general:navdata_demo"), "the configuration stays"

    virtual(main())


@pytest.mark.parametrize("kind", ["ack", "noack"])
def test_the_recorded_sessions_of_the_npm_client_are_obeyed(kind: str) -> None:
    transcript = golden.recorded()["client_transcripts"][kind]

    async def main() -> None:
        async with raw_drone(make_drone(DroneOptions(spin_up_s=0.1))) as client:
            drone = client.server.drone
            client.wake(b"\x01")
            start_ns = client.clock.now_ns()
            obeyed: list[int] = []
            for at_ms, text in transcript:
                due_ns = start_ns + (at_ms - transcript[0][0]) * 1_000_000
                await asyncio.sleep(max(0, due_ns - client.clock.now_ns()) / 1e9)
                client.raw(text.encode() + b"\r")
                await asyncio.sleep(0)
                obeyed.append(drone.last_sequence)
            await asyncio.sleep(0.01)
            sent = [int(text.partition("=")[2].partition(",")[0]) for _, text in transcript]
            assert drone.last_sequence == sent[-1]
            assert drone.ignored_commands == 1, "its counter starts at 0: that one is stale"
            assert drone.configuration.flag("general:navdata_demo")
            assert drone.major in (MajorState.TAKE_OFF, MajorState.LANDING)
            # Without its CTRL 5 the acknowledge bit still stands, and the second CONFIG is lost.
            assert client.server.channel == (1 if kind == "ack" else 0)

    virtual(main())
