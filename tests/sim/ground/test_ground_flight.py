"""A simulated flight in real time, flown from the ground: start, look, land."""

from __future__ import annotations

import asyncio
import re
import socket
import sys
from pathlib import Path

import pytest

from flightd.adapters.ground_link.client import Address, GroundClient
from flightd.adapters.ground_link.messages.published import StatusReport
from flightd.core.types import CommandKind, Phase
from flightd.runtime.free_ports import free_ports
from flightd.runtime.within import Within
from tests.rigs.event_loops import in_real_time
from tests.rigs.small_camera import small_camera_file

ROOT = Path(__file__).parents[3]


@pytest.mark.realtime
@in_real_time
async def test_a_flight_is_started_watched_and_landed_from_the_ground(tmp_path: Path) -> None:
    status_port, command_port = free_ports(2, socket.SOCK_STREAM)
    address = Address("127.0.0.1", status_port, command_port)
    settings = {
        "ground.listen": "127.0.0.1",
        "ground.status_port": str(address.status_port),
        "ground.command_port": str(address.command_port),
        "ground.audit": str(tmp_path / "audit.jsonl"),
        "mission.autostart": "false",
    }
    options = [word for key, value in settings.items() for word in ("--set", f"{key}={value}")]
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        *("-m", "flightd", "sim", "--speed", "1", "--out", str(tmp_path), *options),
        *("--scenario", str(small_camera_file(tmp_path))),
        cwd=ROOT,
        stderr=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.DEVNULL,
    )
    phases: list[Phase] = []
    async with GroundClient(address, timeout_s=60.0) as client, Within(240):
        await client.hello()
        async for message in client.published():
            if not isinstance(message, StatusReport):
                continue
            if not phases or phases[-1] is not message.phase:
                phases.append(message.phase)
            if message.phase is Phase.PREFLIGHT and message.reason == "waiting for the start command":
                await client.order(CommandKind.START, order_id="the-only-start")
            if message.phase is Phase.ACQUIRE:
                _, jpeg = await client.picture()
                assert jpeg.startswith(b"\xff\xd8")
                await client.order(CommandKind.LAND)
                break
        _, error = await process.communicate()
    assert phases[:3] == [Phase.PREFLIGHT, Phase.ARMING, Phase.TAKE_OFF]
    assert process.returncode == 1, "an aborted mission"
    assert re.search(rb"flightd: mission aborted: landing ordered", error)
    outcomes = re.findall(r'"command":"(\w+)".*?"outcome":"(\w+)"', (tmp_path / "audit.jsonl").read_text())
    assert outcomes[0] == ("start", "accepted")
    assert outcomes[-1] == ("land", "accepted")
