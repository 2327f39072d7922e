"""The daemon as a service manager runs it: `flightd run` as a process of its own, in real time, beside a
simulated world in another; it can be killed and started anew."""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
import multiprocessing
import os
import signal
import socket
import sys
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.ground_link.client import Address, GroundClient
from flightd.adapters.ground_link.messages.published import StatusReport
from flightd.adapters.vehicle.mavlink.link.codec import Codec
from flightd.app.simulation.world_process import run_world
from flightd.core.geometry import Mount
from flightd.core.topics import Topic
from flightd.replay.log import read_log
from flightd.runtime.free_ports import free_ports
from flightd.runtime.message_channel import Channel
from flightd.runtime.within import Within
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.sensors.optics import SimCamera, wide_lens
from flightd.sim.world import WorldSpec
from flightd.site.site_file import load_site
from tests.rigs.brisk import BRISK

ROOT = Path(__file__).parents[2]
SITE_FILE = ROOT / "configs" / "site-demo.toml"
CAMERA = SimCamera(lens=wide_lens().scaled(320, 180), fps=20.0)
"""Small and slow enough for a busy machine to draw in real time."""


class ServiceRig:
    """One world, and one daemon after the other in it.  `said` is what the daemons told the manager."""

    def __init__(self, folder: Path, nodes: tuple[str, ...], *, fps: float = CAMERA.fps) -> None:
        """A drone that only stands needs few pictures: with `fps` of 5 it costs half."""
        self.folder = folder
        self._camera = replace(CAMERA, fps=fps)
        self.flights = folder / "flights"
        self.ports = free_ports(2)
        status_port, command_port = free_ports(2, socket.SOCK_STREAM)
        self.address = Address("127.0.0.1", status_port, command_port)
        self.said: list[dict[str, str]] = []
        self._manager = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._manager.bind(str(folder / "notify"))
        self._manager.setblocking(False)
        self.config = folder / "flightd.toml"
        self.config.write_text(self._toml(nodes))
        (folder / "run").mkdir()
        self.process: asyncio.subprocess.Process | None = None

    def _toml(self, nodes: tuple[str, ...]) -> str:
        camera = self._camera
        lens = camera.lens
        sections: dict[str, dict[str, Any]] = {
            "mission": {
                "site": str(SITE_FILE),
                "nodes": list(nodes),
                "autostart": True,
                "autostart_countdown_s": 0.0,
                **BRISK,
            },
            "camera": {
                "url": f"udp://127.0.0.1:{self.ports[0]}",
                "mount_yaw_deg": 90,
                "fps": camera.fps,
                "latency_s": camera.capture_delay_s,
                **{key: getattr(lens, key) for key in ("width_px", "height_px", "fx_px", "fy_px")},
                **{key: getattr(lens, key) for key in ("cx_px", "cy_px")},
                "distortion": list(lens.distortion),
            },
            "vision": {"workers": 1},
            "vehicle": {"url": f"udpout://127.0.0.1:{self.ports[1]}"},
            "recorder": {"folder": str(self.flights)},
            "ground": {
                "listen": "127.0.0.1",
                "status_port": self.address.status_port,
                "command_port": self.address.command_port,
            },
        }
        lines = []
        for name, keys in sections.items():
            lines += [f"[{name}]", *(f"{key} = {json.dumps(value)}" for key, value in keys.items()), ""]
        return "\n".join(lines)

    @asynccontextmanager
    async def world(self, **parameters: float) -> AsyncIterator[None]:
        """The simulated vehicle, with the parameters that are shipped but for these, and camera, alive
        meanwhile."""
        context = multiprocessing.get_context("spawn")
        channel = Channel()
        spec = WorldSpec(
            site=load_site(SITE_FILE),
            seed=3,
            camera_address=("127.0.0.1", self.ports[0]),
            vehicle_ports=(self.ports[1],),
            parameters=parameters,
            camera=replace(self._camera, mount=_turned(self._camera.mount)),
        )
        log = self.folder / "truth.mcap"
        process = context.Process(target=run_world, args=(spec, 1.0, log, channel.theirs), name="world")
        process.start()
        channel.theirs.close()
        try:
            yield
        finally:
            if self.process is not None and self.process.returncode is None:
                self.process.kill()  # a test that failed leaves nothing behind to trouble the next one
                await self.process.wait()
            channel.close()
            process.join(30)
            assert process.exitcode == 0
            self._manager.close()

    def set_parameters(self, **values: float) -> None:
        """Change the autopilot's parameters, as a ground station does: also in flight."""
        codec = Codec(255, dialect.MAV_COMP_ID_MISSIONPLANNER)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
            for name, value in values.items():
                kind = dialect.MAV_PARAM_TYPE_REAL32
                message = dialect.MAVLink_param_set_message(1, 1, name.encode(), value, kind)
                sock.sendto(codec.pack(message), ("127.0.0.1", self.ports[1]))

    async def start(self) -> asyncio.subprocess.Process:
        """`flightd run` as systemd would start it."""
        environment = {
            "NOTIFY_SOCKET": str(self.folder / "notify"),
            "WATCHDOG_USEC": "2000000",
            "RUNTIME_DIRECTORY": str(self.folder / "run"),
        }
        with (self.folder / "stderr").open("ab") as stderr:
            self.process = await asyncio.create_subprocess_exec(
                sys.executable,
                *("-m", "flightd", "run", "--config", str(self.config)),
                cwd=ROOT,
                stderr=stderr,
                env=os.environ | environment,
            )
        return self.process

    def listen(self) -> list[dict[str, str]]:
        """Everything the manager was told so far."""
        with contextlib.suppress(BlockingIOError):
            while datagram := self._manager.recv(1 << 16).decode():
                self.said.append(dict(line.split("=", 1) for line in datagram.split("\n")))
        return self.said

    async def until(self, condition: Callable[[StatusReport], bool], within_s: float = 60.0) -> StatusReport:
        """The first status of which `condition` holds."""
        async with Within(within_s):
            async for status in self.statuses():
                if condition(status):
                    return status
        raise AssertionError("unreachable")

    async def statuses(self) -> AsyncIterator[StatusReport]:
        async with GroundClient(self.address, timeout_s=60.0) as client:
            async for message in client.published():
                if isinstance(message, StatusReport):
                    self.listen()
                    yield message

    def kill(self) -> float:
        """kill -9 of the daemon; the time at which."""
        assert self.process is not None
        self.process.send_signal(signal.SIGKILL)
        return time.monotonic()

    def children(self) -> dict[int, str]:
        """Command lines of all that descends from the daemon."""
        assert self.process is not None
        found: dict[int, str] = {}
        parents = {self.process.pid}
        while parents:
            parents = {pid for pid in _processes() if _parent(pid) in parents}
            found |= {pid: Path(f"/proc/{pid}/cmdline").read_text().replace("\0", " ") for pid in parents}
        return found

    def truth(self) -> list[Kinematics]:
        """Where the drone was; complete once the world has ended."""
        names = [field.name for field in fields(Kinematics)]
        entries = read_log(self.folder / "truth.mcap", {Topic.TRUTH}).entries
        messages = [entry.message for entry in entries]
        return [Kinematics(**{name: m[name] for name in names}) for m in messages if isinstance(m, dict)]


def _turned(mount: Mount) -> Mount:
    """The picture's long side along the nose, as in the shipped configuration of the simulator."""
    return replace(mount, yaw_rad=math.pi / 2.0)


def _processes() -> list[int]:
    return [int(path.name) for path in Path("/proc").iterdir() if path.name.isdigit()]


def _parent(pid: int) -> int:
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except OSError:  # gone meanwhile
        return 0
    return int(stat.rpartition(")")[2].split()[1])
