"""Somebody else's client flies the emulated drone: npm's `ar-drone`, in real time.

Install it anywhere (`npm install ar-drone`) and name the folder in ARDRONE_NODE_MODULES.
"""

from __future__ import annotations

import asyncio
import os
import shutil
from pathlib import Path

import numpy as np
import pytest

from flightd.runtime.clock import LoopClock
from flightd.runtime.within import Within
from flightd.sim.ardrone.server import ArDroneServer
from tests.rigs.ardrone import ANY_PORTS, ended, make_drone
from tests.rigs.event_loops import real

MODULES = os.environ.get("ARDRONE_NODE_MODULES", "")
SCRIPT = Path(__file__).with_name("npm_flight.js")

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which("node") is None, reason="node is not installed"),
    pytest.mark.skipif(
        not (Path(MODULES) / "ar-drone").is_dir(), reason="ARDRONE_NODE_MODULES names no folder with ar-drone"
    ),
]


async def film(server: ArDroneServer) -> None:
    """Thirty pictures a second, a grey level for each camera."""
    while True:
        await asyncio.sleep(1 / 30)
        server.show(np.full((360, 640, 3), 60 + 120 * int(server.channel), np.uint8))


def test_the_npm_client_flies_it() -> None:
    async def main() -> list[str]:
        async with ArDroneServer(make_drone(), LoopClock(), ANY_PORTS) as server:
            tasks = [asyncio.create_task(server.run()), asyncio.create_task(film(server))]
            ports = server.ports
            node = await asyncio.create_subprocess_exec(
                "node",
                str(SCRIPT),
                *(str(port) for port in (ports.at, ports.navdata, ports.video)),
                env={**os.environ, "NODE_PATH": MODULES, "NODE_NO_WARNINGS": "1"},
                stdout=asyncio.subprocess.PIPE,
            )
            try:
                async with Within(120):
                    out, _ = await node.communicate()
            finally:
                if node.returncode is None:
                    node.kill()
                    await node.wait()
                for task in tasks:
                    await ended(task)
            assert node.returncode == 0
            assert server.channel == 1
            return out.decode().splitlines()

    said = real(main())
    flight = [
        line for line in said if line.partition(" ")[0] not in ("idr", "config", "first-frame", "hovering")
    ]
    assert flight == [
        "takeoff",
        "battery 100",
        "flying",
        "forward",
        "turned",
        "higher",
        "landing",
        "landed",
        "frames true",
    ]
    assert "first-frame 3" in said, "the first frame leans on one that was before our time"
    assert "config acknowledged" in said
    assert said.count("idr") > 5
