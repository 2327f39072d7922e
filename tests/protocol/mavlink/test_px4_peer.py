"""The simulated PX4 keeps to what its documentation and sources say of attitude OFFBOARD."""

from __future__ import annotations

import asyncio
import math
import struct
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from itertools import pairwise
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.runtime.clock import LoopClock
from flightd.sim.autopilot.autopilot import PeerConfig
from flightd.sim.autopilot.px4 import Px4Mode, Px4Peer
from flightd.sim.plant.airframe import Airframe
from tests.protocol.mavlink.raw_client import RawClient
from tests.rigs.event_loops import virtual
from tests.rigs.vehicles import CALM

SET_MODE, ARM = 176, 400
HOVER = 0.34


@asynccontextmanager
async def pair(**parameters: float) -> AsyncIterator[tuple[Px4Peer, RawClient]]:
    config = PeerConfig(ready_s=0.0, parameters=parameters)
    peer = Px4Peer(LoopClock(), Airframe(wind=CALM), config)
    client = await RawClient.connect(await peer.open())
    serving = asyncio.create_task(peer.run())
    await asyncio.sleep(0.05)
    try:
        yield peer, client
    finally:
        serving.cancel()
        await asyncio.gather(serving, return_exceptions=True)
        client.close()


async def offboard(client: RawClient) -> None:
    await client.fly(1.3, thrust=0.0)
    assert await client.command(SET_MODE, 1, 6) == 0


async def hopping(peer: Px4Peer, client: RawClient) -> None:
    """Take off by raw thrust, then hang about."""
    await offboard(client)
    assert await client.command(ARM, 1) == 0
    await client.fly(1.5, thrust=HOVER * 1.1, yaw_rad=0.7)
    await client.fly(0.5, thrust=HOVER * 0.95, yaw_rad=0.7)
    assert peer.truth().height_m > 0.5


def in_air(peer: Px4Peer) -> bool:
    return not peer.landed


def armed(peer: Px4Peer) -> bool:
    return peer.armed


def test_offboard_needs_a_running_stream() -> None:
    async def test() -> None:
        async with pair() as (peer, client):
            assert await client.command(SET_MODE, 1, 6) == 1
            assert "Offboard is currently not available" in client.last("STATUSTEXT").text
            await client.fly(0.7, thrust=0.0)
            assert await client.command(SET_MODE, 1, 6) == 1
            await client.fly(2.0, hz=1.0, thrust=0.0)  # too slow
            assert await client.command(SET_MODE, 1, 6) == 1
            await offboard(client)
            assert peer.mode == Px4Mode.OFFBOARD
            await asyncio.sleep(1.1)
            assert client.last("HEARTBEAT").custom_mode == 393216

    virtual(test())


@pytest.mark.parametrize(("action", "mode"), [(4, Px4Mode.AUTO_LAND), (1, Px4Mode.ALTCTL)])
def test_a_silent_stream_ends_offboard_after_a_second(action: int, mode: Px4Mode) -> None:
    async def test() -> None:
        async with pair(COM_OBL_RC_ACT=action) as (peer, client):
            await hopping(peer, client)
            await asyncio.sleep(0.9)
            assert peer.mode == Px4Mode.OFFBOARD
            await asyncio.sleep(0.3)
            assert peer.mode == mode
            assert client.last("STATUSTEXT").text == "Offboard control lost"

    virtual(test())


def test_arming_in_offboard_needs_the_stream_too() -> None:
    async def test() -> None:
        async with pair() as (_, client):
            await offboard(client)
            await asyncio.sleep(1.2)
            assert await client.command(ARM, 1) == 1
            assert await client.command(SET_MODE, 1, 3) == 1  # POSCTL: no position
            assert await client.command(SET_MODE, 1, 300) == 2

    virtual(test())


def test_thrust_is_collective_and_holds_no_height() -> None:
    async def test() -> None:
        async with pair() as (peer, client):
            await hopping(peer, client)
            for thrust, sign in ((HOVER * 1.1, 1.0), (HOVER * 0.9, -1.0)):
                before = peer.truth().climb_mps
                await client.fly(0.5, thrust=thrust, yaw_rad=0.7)
                gained = sign * (peer.truth().climb_mps - before)
                assert 0.2 < gained < 0.6  # 0.1 g for half a second, less lag and drag

    virtual(test())


def test_mask_3_is_natural_and_the_yaw_rate_is_not_integrated() -> None:
    async def test() -> None:
        async with pair() as (peer, client):
            await hopping(peer, client)
            start = peer.truth().yaw_rad
            await client.fly(
                2.0, thrust=HOVER, yaw_rad=0.7, roll_deg=5, mask=3, rates=(0, 0, math.radians(30))
            )
            truth = peer.truth()
            assert math.degrees(truth.roll_rad) == pytest.approx(5, abs=0.7)
            assert math.degrees(truth.yaw_rad - start) == pytest.approx(6.5, abs=1.5)

    virtual(test())


def test_a_missing_thrust_is_none_and_a_zero_quaternion_does_no_harm() -> None:
    async def test() -> None:
        async with pair() as (peer, client):
            await hopping(peer, client)
            client.attitude(norm=0.0)
            await client.fly(0.4, thrust=HOVER, mask=64 + 7)
            assert peer.truth().climb_mps < -2.0

    virtual(test())


def test_it_lands_only_when_the_thrust_is_cut_and_then_disarms() -> None:
    async def test() -> None:
        async with pair() as (peer, client):
            await hopping(peer, client)
            while peer.truth().height_m > 0.11:
                await client.fly(0.1, thrust=HOVER * 0.9, yaw_rad=0.7)
            await client.fly(10.0, thrust=HOVER * 0.5, yaw_rad=0.7)
            assert in_air(peer)  # on the floor, but it does not know
            assert await client.command(ARM, 0) == 1
            assert client.last("STATUSTEXT").text == "Disarming denied: not landed"
            await client.fly(2.0, thrust=0.0, yaw_rad=0.7)
            assert not in_air(peer)
            assert armed(peer)
            await client.fly(2.0, thrust=0.0, yaw_rad=0.7)
            assert not armed(peer)

    virtual(test())


def test_armed_and_never_flown_it_disarms_after_ten_seconds() -> None:
    async def test() -> None:
        async with pair() as (peer, client):
            await offboard(client)
            assert await client.command(ARM, 1) == 0
            await client.fly(9.0, thrust=0.0)
            assert armed(peer)
            await client.fly(2.0, thrust=0.0)
            assert not armed(peer)

    virtual(test())


def test_whole_parameters_travel_as_bytes() -> None:
    async def test() -> None:
        async with pair() as (peer, client):
            client.send(dialect.MAVLink_param_request_read_message(1, 1, b"COM_OBL_RC_ACT", -1))
            client.send(dialect.MAVLink_param_request_read_message(1, 1, b"MPC_THR_HOVER", -1))
            coded = struct.unpack("<f", struct.pack("<i", 5))[0]
            client.send(dialect.MAVLink_param_set_message(1, 1, b"COM_OBL_RC_ACT", coded, 6))
            await asyncio.sleep(0.1)
            first, second, third = client.all("PARAM_VALUE")
            assert first.param_type == 6
            assert struct.unpack("<i", struct.pack("<f", first.param_value))[0] == 4
            assert second.param_value == 0.5
            assert struct.unpack("<i", struct.pack("<f", third.param_value))[0] == 5
            assert peer.parameters["COM_OBL_RC_ACT"] == 5

    virtual(test())


def test_the_local_position_goes_on_where_the_height_above_home_leaps_at_arming() -> None:
    async def test() -> None:
        async with pair() as (peer, client):
            await client.stream(32, 50)
            await hopping(peer, client)
            told: Any = client.last("LOCAL_POSITION_NED")
            assert -told.z == pytest.approx(peer.truth().height_m - 0.1, abs=0.06)
            above = [message.relative_alt for message in client.all("GLOBAL_POSITION_INT")]  # unasked
            steps = [abs(after - before) for before, after in pairwise(above)]
            assert max(steps) > 1300
            assert sorted(steps)[-2] < 200

    virtual(test())


def test_its_heartbeat_keeps_its_rate_and_comes_when_it_is_asked_for() -> None:
    async def test() -> None:
        async with pair() as (_, client):
            assert await client.command(511, 0, 50_000) == 4
            await asyncio.sleep(5.0)
            assert 4 <= len(client.all("HEARTBEAT")) <= 7
            before = len(client.all("HEARTBEAT"))
            for _ in range(5):
                assert await client.command(512, 0) == 0
            assert len(client.all("HEARTBEAT")) >= before + 5

    virtual(test())
