"""A daemon that is started while its vehicle flies, in virtual time and over real sockets."""

from __future__ import annotations

import asyncio
import contextlib
import math
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import pytest
from prometheus_client import generate_latest

from flightd.adapters.metrics.metrics import MetricsBook
from flightd.app.build import build
from flightd.app.counting.flight_count import FlightCount
from flightd.app.daemon import Daemon, FlightResult
from flightd.app.detection.detector_pool import Detection
from flightd.app.flight_orders import configured_order
from flightd.app.startup_faults import StartupFaults
from flightd.config.schema import Config, load_config
from flightd.core.errors import FlightdError, InputError, UnavailableError
from flightd.core.snapshot import Snapshot
from flightd.core.types import Command, CommandKind, Demand, Event, Phase
from flightd.ports import Monitor
from flightd.runtime.clock import LoopClock
from flightd.runtime.frame_ring import FrameTicket
from flightd.runtime.free_ports import free_port
from flightd.runtime.within import Within
from flightd.sim.autopilot.copter import CopterMode
from flightd.site.site_file import load_site
from tests.rigs.event_loops import virtual
from tests.rigs.vehicles import PATIENT_COPTER, Rig, ardupilot_rig

ROOT = Path(__file__).parents[3]
SITE = load_site(ROOT / "configs" / "site-demo.toml")


class NoDetectors:
    """Nothing is seen, so nobody asks."""

    replaced = 0

    async def detect(self, ticket: FrameTicket, with_jpeg: bool = False) -> Detection | None:
        raise AssertionError("there is no camera")


async def config_of(rig: Rig, *, camera_gone: bool) -> Config:
    """A flight that would start by itself, and if wanted a camera that cannot be had: its port is taken."""
    config = load_config(ROOT / "configs" / "sim.toml")
    host, port = await rig.peer.open()
    vehicle = config.vehicle.model_copy(update={"url": f"udpout://{host}:{port}"})
    url = f"udp://{host}:{port}" if camera_gone else f"udp://127.0.0.1:{free_port()}"
    camera = config.camera.model_copy(update={"url": url})
    return config.model_copy(update={"vehicle": vehicle, "camera": camera})


async def died(rig: Rig) -> None:
    """The process that flew is gone without a word."""
    rig.cut(True)
    assert rig.flying_task is not None
    rig.flying_task.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await rig.flying_task
    rig.cut(False)


async def restarted(
    rig: Rig, *monitors: Monitor, fault: FlightdError | None = None, camera_gone: bool = True
) -> tuple[FlightResult, list[Phase]]:
    phases: list[Phase] = []

    def note(status: Snapshot) -> None:
        phases.extend([status.phase] if status.phase not in phases[-1:] else [])

    config = await config_of(rig, camera_gone=camera_gone)
    daemon = Daemon(
        build(
            config,
            SITE,
            configured_order(config),
            clock=LoopClock(),
            detectors=NoDetectors(),
            observers=[note],
            monitors=monitors,
            startup_fault=fault,
        )
    )
    async with Within(120):
        return await daemon.fly(), phases


@pytest.mark.parametrize("alone_s", [0.3, 5.0])
def test_it_keeps_the_vehicle_level_reports_and_lands_it(alone_s: float) -> None:
    async def test() -> None:
        async with ardupilot_rig(patience=PATIENT_COPTER) as rig:
            await rig.take_off(1.5)
            await died(rig)
            await asyncio.sleep(alone_s)
            tilts, heights = [], []

            async def watch() -> None:
                while True:
                    truth = rig.peer.truth()
                    tilts.append(max(abs(truth.roll_rad), abs(truth.pitch_rad)))
                    heights.append(truth.height_m)
                    await asyncio.sleep(0.02)

            watching = asyncio.create_task(watch())
            book = MetricsBook()
            result, phases = await restarted(rig, book)
            watching.cancel()
            assert phases[-3:] == [Phase.RECOVER, Phase.LAND, Phase.ABORTED]
            assert result.phase is Phase.ABORTED
            assert not rig.peer.armed
            assert rig.peer.truth().height_m < 0.15
            assert max(tilts) < math.radians(3)
            assert max(heights) < 1.9, "it never climbs away"
            told = generate_latest(book.registry).decode()
            assert 'flightd_phase{phase="aborted"} 1.0' in told
            assert 'flightd_events_total{level="error",name="restart"} 1.0' in told
            assert 'flightd_events_total{level="error",name="failure"}' in told, "the camera's"
            assert 'flightd_dropped_total{queue="vehicle"}' in told

    virtual(test())


def test_a_vehicle_that_the_pilot_has_is_left_alone() -> None:
    async def test() -> None:
        async with ardupilot_rig() as rig:
            await rig.take_off(1.5)
            rig.take_over()
            await died(rig)
            daemon = asyncio.create_task(restarted(rig))
            await asyncio.sleep(8.0)
            assert rig.peer.mode == CopterMode.ALT_HOLD
            assert rig.peer.armed
            assert rig.peer.truth().height_m > 1.0
            daemon.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await daemon
            assert rig.peer.armed, "handing back takes nothing from the pilot"

    virtual(test())


def test_on_the_floor_a_camera_that_is_gone_is_an_error() -> None:
    async def test() -> None:
        async with ardupilot_rig() as rig:
            await died(rig)
            with pytest.raises(UnavailableError):
                await restarted(rig)
            assert not rig.peer.armed

    virtual(test())


class BrokenPart:
    """A part that fails each time it is started."""

    frames = refused = 0
    is_closed = True

    def __init__(self, err: Exception) -> None:
        self._err = err
        self.started = 0

    async def run(self) -> None:
        self.started += 1
        raise self._err

    def expose(self, part: float, gain: float) -> None: ...

    def put(self, value: object) -> None: ...


def test_what_is_not_critical_fails_in_the_air_and_the_flight_is_still_ended_by_the_mission() -> None:
    async def test() -> None:
        async with ardupilot_rig(patience=PATIENT_COPTER) as rig:
            await rig.take_off(1.5)
            await died(rig)
            config = await config_of(rig, camera_gone=False)
            flight = build(config, SITE, configured_order(config), clock=LoopClock(), detectors=NoDetectors())
            front = BrokenPart(UnavailableError("no second camera"))
            others = [BrokenPart(OSError(12, "no memory")), BrokenPart(ValueError("a fault"))]
            broken = replace(flight, front_camera=front, interlock=others[0], progress=others[1])
            async with Within(120):
                result = await Daemon(broken).fly()
            assert result.phase is Phase.ABORTED
            assert not rig.peer.armed
            assert rig.peer.truth().height_m < 0.15
            assert min(part.started for part in (front, *others)) > 2

    virtual(test())


class Order:
    """A monitor, and a part that takes its time to close: what came when."""

    def __init__(self) -> None:
        self.came: list[str] = []

    def tell(self, snapshot: Snapshot) -> None:
        self._note("tick")

    def event(self, event: Event) -> None: ...

    def over(self) -> None:
        self._note("over")

    async def run(self) -> None:
        try:
            await asyncio.sleep(math.inf)
        finally:
            self._note("closes")

    def put(self, value: object) -> None: ...

    def _note(self, what: str) -> None:
        self.came += [what] if what not in self.came[-1:] else []


@pytest.mark.parametrize("ends", ["by itself", "by a signal"])
def test_that_no_tick_follows_is_told_before_anything_is_closed(ends: str) -> None:
    async def test() -> None:
        async with ardupilot_rig(patience=PATIENT_COPTER) as rig:
            await rig.take_off(1.5)
            await died(rig)
            config, order = await config_of(rig, camera_gone=False), Order()
            plan = configured_order(config)
            built = build(config, SITE, plan, clock=LoopClock(), detectors=NoDetectors(), monitors=[order])
            flying = asyncio.create_task(Daemon(replace(built, progress=order)).fly())
            await rig.until(lambda: "tick" in order.came)
            if ends == "by a signal":
                flying.cancel()
            async with Within(120):
                await asyncio.wait([flying])
            assert order.came == ["tick", "over", "closes"]

    virtual(test())


def unopened(folder: Path) -> FlightdError:
    """What is wrong with an inventory in a folder that is a file, found by a daemon that was started anew."""
    folder.write_text("no folder")
    config = load_config(ROOT / "configs" / "sim.toml")
    front = config.front_camera.model_copy(update={"url": "udp://127.0.0.1:1"})
    site = load_site(ROOT / "configs" / "site-racks-small.toml")
    with ExitStack() as stack:
        counting = config.model_copy(update={"front_camera": front})
        with pytest.raises((InputError, UnavailableError)):
            FlightCount(counting, site, folder, stack, run="1")
        faults = StartupFaults(in_air=True)
        FlightCount(counting, site, folder, stack, run="1", faults=faults)
    assert faults.first is not None
    return faults.first


def test_an_inventory_that_cannot_be_opened_lands_a_vehicle_found_flying(tmp_path: Path) -> None:
    async def test() -> None:
        async with ardupilot_rig() as rig:
            await rig.take_off(1.5)
            await died(rig)
            book = MetricsBook()
            result, phases = await restarted(rig, book, fault=unopened(tmp_path / "inventory"))
            assert phases[-3:] == [Phase.RECOVER, Phase.LAND, Phase.ABORTED]
            assert result.phase is Phase.ABORTED
            assert rig.peer.truth().height_m < 0.15

    virtual(test())


def test_on_the_floor_an_inventory_that_cannot_be_opened_is_an_error(tmp_path: Path) -> None:
    async def test() -> None:
        async with ardupilot_rig() as rig:
            await died(rig)
            error = unopened(tmp_path / "inventory")
            with pytest.raises(type(error)) as raised:
                await restarted(rig, fault=error, camera_gone=False)
            assert raised.value is error

    virtual(test())


def test_a_vehicle_that_stands_armed_never_takes_off_without_its_inventory(tmp_path: Path) -> None:
    async def test() -> None:
        async with ardupilot_rig() as rig:
            await rig.until(lambda: rig.vehicle.state() is not None)
            rig.vehicle.demand(Demand.FLY)
            await rig.until(lambda: rig.known().armed)
            await died(rig)
            error = unopened(tmp_path / "inventory")
            config = await config_of(rig, camera_gone=False)
            flight = build(
                config,
                SITE,
                configured_order(config),
                clock=LoopClock(),
                detectors=NoDetectors(),
                startup_fault=error,
            )
            daemon = Daemon(flight)
            flying = asyncio.create_task(daemon.fly())
            await asyncio.sleep(1.0)
            assert rig.peer.armed
            assert not flying.done()
            daemon.command(Command("order", CommandKind.START))
            with pytest.raises(type(error)) as raised:
                async with Within(60):
                    await flying
            assert raised.value is error
            assert not rig.peer.armed
            assert rig.peer.truth().height_m < 0.15

    virtual(test())
