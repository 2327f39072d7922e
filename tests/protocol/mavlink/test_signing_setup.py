"""The key on its way to the autopilot, and what a signed link does with restarts."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect
from typer.testing import CliRunner

from flightd.adapters.vehicle.mavlink.ardupilot import ArduPilotVehicle
from flightd.adapters.vehicle.mavlink.examination import Examination
from flightd.adapters.vehicle.mavlink.key_transfer import give_key, refuse_overheard
from flightd.adapters.vehicle.mavlink.link.codec import Codec, FrameParser
from flightd.adapters.vehicle.mavlink.link.signing import Signing
from flightd.adapters.vehicle.mavlink.vehicle import MavlinkOptions
from flightd.cli.main import app
from flightd.core.errors import InputError, RunError, UnavailableError
from flightd.runtime.clock import LoopClock
from flightd.sim.autopilot.autopilot import AutopilotPeer, PeerConfig
from flightd.sim.autopilot.copter import ArduCopterPeer, CopterMode
from flightd.sim.autopilot.px4 import Px4Peer
from flightd.sim.plant.airframe import Airframe
from tests.protocol.mavlink.test_codec import StoppedClock
from tests.rigs.event_loops import virtual
from tests.rigs.vehicles import Rig

KEY = bytes(range(32))
NOW_UNIX_S = 1_795_000_000.0


async def with_peer(make: type[ArduCopterPeer | Px4Peer], test: Any) -> None:
    clock = LoopClock()
    peer = make(clock, Airframe(), PeerConfig(ready_s=0.5))
    host, port = await peer.open()
    serving = asyncio.create_task(peer.run())
    try:
        await test(peer, f"udpout://{host}:{port}", clock)
    finally:
        serving.cancel()
        await asyncio.gather(serving, return_exceptions=True)


def test_a_key_that_was_given_signs_the_flight_and_locks_others_out() -> None:
    async def flight(peer: AutopilotPeer, url: str, clock: LoopClock) -> None:
        assert await give_key(url, KEY, clock, NOW_UNIX_S)
        signed = ArduPilotVehicle(url, clock, MavlinkOptions(signing=Signing(KEY, clock, NOW_UNIX_S + 9)))
        bare = ArduPilotVehicle(url, clock)
        tasks = [asyncio.create_task(vehicle.run()) for vehicle in (signed, bare)]
        await Rig(signed, peer, lambda: None, lambda apart: None).take_off(1.0)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        with pytest.raises(UnavailableError):  # an unsigned link takes no other key any more
            await give_key(url, bytes(32), clock, NOW_UNIX_S)

    virtual(with_peer(ArduCopterPeer, flight))


def test_an_examination_without_the_key_says_that_one_is_needed() -> None:
    async def test(peer: AutopilotPeer, url: str, clock: LoopClock) -> None:
        examination = Examination(url, clock)
        async with examination.connected():
            peer.link.sign(KEY, 0)
            await asyncio.sleep(1.5)
            with pytest.raises(UnavailableError, match=r"signs its messages.*vehicle\.signing_key"):
                await examination.report()

    virtual(with_peer(ArduCopterPeer, test))


def test_an_autopilot_that_does_not_sign_is_not_said_to() -> None:
    async def test(_peer: AutopilotPeer, url: str, clock: LoopClock) -> None:
        assert not await give_key(url, KEY, clock, NOW_UNIX_S)

    virtual(with_peer(Px4Peer, test))


def test_an_armed_vehicle_and_a_silent_one_get_no_key() -> None:
    async def test(peer: AutopilotPeer, url: str, clock: LoopClock) -> None:
        await asyncio.sleep(1.0)
        assert peer.pilot_mode(CopterMode.ALT_HOLD)
        assert peer.pilot_arm()
        with pytest.raises(RunError, match="armed"):
            await give_key(url, KEY, clock, NOW_UNIX_S)
        peer.link.muted = True
        with pytest.raises(UnavailableError, match="no ArduPilot or PX4"):
            await give_key(url, KEY, clock, NOW_UNIX_S)

    virtual(with_peer(ArduCopterPeer, test))


@pytest.mark.parametrize(
    "url", ["udpout://192.168.1.9:14550", "tcp://drone.local:5760", "udpin://0.0.0.0:14550"]
)
def test_a_key_is_not_sent_where_others_can_hear_it(url: str) -> None:
    with pytest.raises(InputError, match="in the clear"):
        refuse_overheard(url)


def test_keygen_makes_a_file_once_and_sends_it_over_a_cable_only(tmp_path: Path) -> None:
    runner, path = CliRunner(), tmp_path / "mavlink.key"
    made = runner.invoke(app, ["keygen", "--mavlink", str(path), "--json"])
    assert json.loads(made.stdout) == {"key": str(path)}
    key = path.read_text()
    with pytest.raises(InputError, match="there already"):
        runner.invoke(app, ["keygen", "--mavlink", str(path)], catch_exceptions=False)
    with pytest.raises(InputError, match="cable"):
        runner.invoke(
            app, ["keygen", "--mavlink", str(path), "--send", "tcp://10.0.0.1:5760"], catch_exceptions=False
        )
    assert path.read_text() == key


def test_restarts_in_quick_succession_do_not_lock_the_autopilot_out(tmp_path: Path) -> None:
    """Each restart begins at the claimed stamp; an autopilot that heard none of it stays behind."""
    state = tmp_path / "stamp"

    autopilot = Codec(1, 1, Signing(KEY, StoppedClock(), NOW_UNIX_S))
    beat = dialect.MAVLink_heartbeat_message(2, 3, 1, 20, 4, 3)
    for _ in range(3):
        companion = Codec(1, 191, Signing(KEY, StoppedClock(), NOW_UNIX_S, state))
        assert FrameParser(companion).datagram(autopilot.pack(beat))
        companion.pack(beat)


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

    virtual(test())
