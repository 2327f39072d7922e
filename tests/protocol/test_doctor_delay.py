"""`flightd doctor --rock`: an autopilot and a camera on an airframe that somebody rocks by hand."""

from __future__ import annotations

import asyncio
import json
import math
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import pytest

from flightd.core.geometry import Mount
from flightd.doctor.check import CheckLevel
from flightd.doctor.delay import judge_delay
from flightd.runtime.clock import LoopClock
from flightd.runtime.free_ports import free_ports
from flightd.sim.autopilot.autopilot import PeerConfig
from flightd.sim.autopilot.copter import ArduCopterPeer
from flightd.sim.floor.renderer import Renderer
from flightd.sim.plant.airframe import Airframe, AirframeCommand
from flightd.sim.sensors.camera import CameraPeer
from flightd.sim.sensors.optics import SimCamera, wide_lens
from flightd.site.site_file import load_site
from flightd.tracking.delay_by_tilt import DelayByTilt
from tests.command import Command
from tests.rigs.event_loops import real

ROOT = Path(__file__).parents[2]
SITE = load_site(ROOT / "configs" / "site-demo.toml")
LENS = wide_lens(320, 180)
TRUE_S, CONFIGURED_S = 0.110, 0.060


class RockedAirframe(Airframe):
    """In two hands, 1.1 m above a node, rocked by seven degrees and carried about a little."""

    def __init__(self, rocks_rad: float) -> None:
        node = SITE.nodes["A2"]
        super().__init__(x_m=node.x_m, y_m=node.y_m)
        self._home, self._t, self._rocks_rad = (node.x_m, node.y_m), 0.0, rocks_rad

    def step(self, dt_s: float, command: AirframeCommand) -> None:
        self._t += dt_s
        roll, pitch = (math.tau * hz * self._t for hz in (0.9, 0.7))
        self.roll_rad, self.pitch_rad = self._rocks_rad * math.sin(roll), self._rocks_rad * math.cos(pitch)
        self.x_m = self._home[0] + 0.05 * math.sin(0.6 * self._t)
        self.y_m = self._home[1] + 0.15 * self.roll_rad
        self.height_m, self.on_floor = 1.1, False


@contextmanager
def held_drone(camera_port: int, rocks_rad: float) -> Iterator[str]:
    """The autopilot's address; its camera sends to `camera_port`."""
    begun, found = threading.Event(), list[tuple[asyncio.AbstractEventLoop, asyncio.Event, str]]()

    async def serve() -> None:
        clock = LoopClock()
        peer = ArduCopterPeer(clock, RockedAirframe(rocks_rad), PeerConfig(ready_s=0.0))
        host, port = await peer.open()
        camera = SimCamera(lens=LENS, mount=Mount(), capture_delay_s=TRUE_S)
        eye = CameraPeer(
            camera, partial(Renderer, SITE, camera), "eye", ("127.0.0.1", camera_port), peer.truth_at, clock
        )
        stop = asyncio.Event()
        found.append((asyncio.get_running_loop(), stop, f"udpout://{host}:{port}"))
        parts = [asyncio.ensure_future(part) for part in (peer.run(), eye.run())]
        begun.set()
        await stop.wait()
        for part in parts:
            part.cancel()
        await asyncio.wait(parts)

    thread = threading.Thread(target=lambda: real(serve()))
    thread.start()
    try:
        assert begun.wait(20.0)
        yield found[0][2]
    finally:
        found[0][0].call_soon_threadsafe(found[0][1].set)
        thread.join(20.0)


def _config(folder: Path, camera_port: int, url: str) -> Path:
    path = folder / "flightd.toml"
    path.write_text(
        f'[mission]\nsite = "{ROOT / "configs" / "site-demo.toml"}"\n'
        f'[camera]\nurl = "udp://127.0.0.1:{camera_port}"\nwidth_px = {LENS.width_px}\n'
        f"height_px = {LENS.height_px}\nfx_px = {LENS.fx_px}\nfy_px = {LENS.fy_px}\n"
        f"latency_s = {CONFIGURED_S}\n"
        f'[vision]\nworkers = 1\n[vehicle]\nurl = "{url}"\n'
        f'[recorder]\nfolder = "{folder / "flights"}"\nreserve_gb = 0.0\n'
    )
    return path


@pytest.mark.slow
@pytest.mark.parametrize("rocks_deg", [7.0, 0.0])
def test_the_delay_is_measured_of_a_drone_that_is_rocked(
    tmp_path: Path, flightd: Command, rocks_deg: float
) -> None:
    (port,) = free_ports(1)
    with held_drone(port, math.radians(rocks_deg)) as url:
        done = flightd("doctor", "--config", str(_config(tmp_path, port, url)), "--rock", "8", "--json")
    assert done.stdout, done.stderr
    checks = {check["name"]: check for check in json.loads(done.stdout)["checks"]}
    check, latency = checks["delay"], checks["latency"]["text"]
    assert check["level"] == "warning"
    assert ("as measured by rocking it" in latency) is bool(rocks_deg)
    assert ("unmeasured" in latency) is not bool(rocks_deg)
    if rocks_deg:
        assert check["remedy"].startswith("camera.latency_s = ")
        assert float(check["remedy"].rpartition(" ")[2]) == pytest.approx(TRUE_S, abs=0.008)
    else:
        assert check["text"].startswith("not measured: rocked by 0.")


@pytest.mark.parametrize(
    ("told", "level", "says"),
    [
        (DelayByTilt(0.004, 0.001, 0.99, 0.1, 300), CheckLevel.OK, "36 ms"),
        (DelayByTilt(-0.03, 0.001, 0.99, 0.1, 300), CheckLevel.WARNING, "camera.latency_s = 0.070"),
        (DelayByTilt(-0.03, 0.02, 0.9, 0.1, 300), CheckLevel.OK, "sigma 20.0"),
        (DelayByTilt(0.06, 0.001, 0.99, 0.1, 300), CheckLevel.ERROR, "telemetry is late"),
        (DelayByTilt(0.0, 0.001, 0.4, 0.1, 300), CheckLevel.WARNING, "explains 40%"),
        (DelayByTilt(math.nan, math.nan, 0.0, 0.0, 0), CheckLevel.WARNING, "no line was seen"),
    ],
)
def test_what_was_measured_is_held_against_the_configuration(
    told: DelayByTilt, level: CheckLevel, says: str
) -> None:
    check = judge_delay(0.040, told)
    assert check.level is level
    assert says in f"{check.text} -> {check.remedy}"


@pytest.mark.parametrize("options", [("--rock", "2"), ("--rock", "nan"), ("--rock", "20", "--quick")])
def test_a_time_that_makes_no_sense_is_refused(
    tmp_path: Path, flightd: Command, options: tuple[str, ...]
) -> None:
    done = flightd("doctor", "--config", str(_config(tmp_path, 1, "udpin:127.0.0.1:1")), *options)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
