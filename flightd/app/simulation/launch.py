"""A simulated flight: the world's peers and the daemon, put together in one of two ways.

In lockstep both share one event loop on virtual time, one process, real loopback sockets: repeatable and
as fast as the machine goes.  In real time the world is a process of its own and time runs by the clock,
or a multiple of it; only then does the ground link run, whose sockets have threads of their own.
"""

from __future__ import annotations

import asyncio
import math
import multiprocessing
import signal
from collections.abc import Callable
from contextlib import ExitStack, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from flightd.adapters.recorder.recorder import McapRecorder
from flightd.app.build import detector_pool, ground_link, plan_of, start_of
from flightd.app.counting.flight_count import FlightCount
from flightd.app.daemon import Daemon, FlightResult
from flightd.app.simulation.lockstep import LockstepDetectors, LockstepReaders
from flightd.app.simulation.ports import WorldPorts, connected, free_ports, has_front_camera
from flightd.app.simulation.process_faults import LauncherFaults, attended
from flightd.app.simulation.world_process import run_world, watch_world
from flightd.config.schema import Config
from flightd.core.errors import RunError, UnavailableError
from flightd.core.topics import Document, Topic
from flightd.core.types import Status
from flightd.runtime.clock import LoopClock
from flightd.runtime.event_loops import ScaledLoop, VirtualLoop
from flightd.sim.racks.stock_truth import LocationTruth, stock_truth
from flightd.sim.scenario.scenario import Scenario
from flightd.sim.world import FrontSpec, World, WorldSpec
from flightd.site.site import Site
from flightd.site.site_file import site_toml

DETECTION_S = 0.008
"""Modelled time of a detection in lockstep: what a companion computer needs."""
READING_S = 0.15
"""And of reading the codes of one picture."""

_SCAN_S = 30.0
"""More than the count of one location can take, re-takes included."""
_PORT_TRIES = 5


@dataclass(frozen=True, slots=True)
class Simulation:
    """One simulated flight to be flown; `speed` None is lockstep."""

    config: Config
    site: Site
    scenario: Scenario
    seed: int
    speed: float | None
    folder: Path
    observer: Callable[[Status], None] = lambda _: None
    truth_url: str = ""
    """An external simulator's truth link; the configuration then says where its vehicle is flown."""

    @property
    def flight_log(self) -> Path:
        return self.folder / "flight.mcap"

    @property
    def truth_log(self) -> Path:
        return self.folder / "truth.mcap"


def fly(simulation: Simulation) -> FlightResult:
    """Fly it and leave `flight.mcap` and `truth.mcap` in the folder.  RunError when it was ended early."""
    try:
        if simulation.speed is None:
            with asyncio.Runner(loop_factory=VirtualLoop) as runner:
                return runner.run(_lockstep(simulation))
        factor = simulation.speed
        with asyncio.Runner(loop_factory=lambda: ScaledLoop(factor)) as runner:
            return runner.run(_real_time(simulation, factor))
    except asyncio.CancelledError:
        raise RunError("ended by a signal") from None


def _end_on_sigterm() -> None:
    """SIGTERM ends the flight as an interrupt does: everything is closed on the way out."""
    task = asyncio.current_task()
    assert task is not None
    asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, task.cancel)


async def _lockstep(simulation: Simulation) -> FlightResult:
    _end_on_sigterm()
    clock = LoopClock()
    with ExitStack() as stack:
        recorder = stack.enter_context(_flight_recorder(simulation, clock, lossless=True))
        truth = stack.enter_context(McapRecorder(simulation.truth_log, lossless=True))
        pool = stack.enter_context(detector_pool(simulation.config, simulation.site, clock))
        faults = LauncherFaults(simulation.scenario.fault, pool, recorder)
        world, ports = await _opened(simulation, clock, truth, faults)
        config = connected(simulation.config, ports)
        count = FlightCount(config, simulation.site, simulation.folder, stack)
        counting = await count.begun(clock, lambda readers: LockstepReaders(readers, clock, READING_S))
        await pool.ready()
        daemon = Daemon(
            config,
            simulation.site,
            clock,
            LockstepDetectors(pool, clock, DETECTION_S),
            recorder,
            [simulation.observer],
            counting=counting,
        )
        beside = [asyncio.ensure_future(part) for part in (world.run(), faults.run())]
        try:
            return await _within_limit(simulation, daemon, *beside)
        finally:
            for part in beside:
                part.cancel()
            await asyncio.wait(beside)


async def _opened(
    simulation: Simulation, clock: LoopClock, truth: McapRecorder, faults: LauncherFaults
) -> tuple[World, WorldPorts]:
    """A world that listens, and its ports.  A port that was free a moment ago may have been taken by
    another simulation: then others are tried."""
    for attempt in range(1, _PORT_TRIES + 1):
        ports = free_ports(simulation.config, simulation.site)
        world = World(_spec(simulation, ports), clock, truth, faults.tell)
        try:
            await world.open()
        except UnavailableError:
            if attempt == _PORT_TRIES or simulation.truth_url:
                raise
        else:
            return world, ports
    raise AssertionError("unreachable")


async def _real_time(simulation: Simulation, factor: float) -> FlightResult:
    _end_on_sigterm()
    clock = LoopClock()
    ports = free_ports(simulation.config, simulation.site)
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    spec = _spec(simulation, ports)
    process = context.Process(
        target=run_world, args=(spec, factor, simulation.truth_log, theirs), name="world"
    )
    with ExitStack() as stack:
        recorder = stack.enter_context(_flight_recorder(simulation, clock, lossless=False))
        process.start()
        theirs.close()
        stack.callback(process.join, 15.0)
        stack.callback(ours.close)  # the world ends when its pipe closes, however this process ends
        pool = stack.enter_context(detector_pool(simulation.config, simulation.site, clock))
        config = attended(connected(simulation.config, ports), simulation.scenario.fault)
        if simulation.truth_url:
            config = config.model_copy(update={"vehicle": simulation.config.vehicle})
        counting = await FlightCount(config, simulation.site, simulation.folder, stack).begun(clock)
        ground = stack.enter_context(ground_link(config, simulation.site, clock, counting) or nullcontext())
        faults = LauncherFaults(simulation.scenario.fault, pool, recorder, ground)
        await pool.ready()
        daemon = Daemon(
            config,
            simulation.site,
            clock,
            pool,
            recorder,
            [simulation.observer],
            ground,
            counting=counting,
        )
        parts = watch_world(process, ours, faults.tell), faults.run()
        beside = [asyncio.ensure_future(part) for part in parts]
        try:
            return await _within_limit(simulation, daemon, *beside)
        finally:
            for part in beside:
                part.cancel()
            await asyncio.wait(beside)


async def _within_limit(
    simulation: Simulation, daemon: Daemon, *beside: asyncio.Future[None]
) -> FlightResult:
    """The flight, unless it takes far longer than its plan can, or what runs beside it fails."""
    stops = plan_of(simulation.config, simulation.site).stops
    limit_s = 120.0 + 60.0 * (len(stops) + 1)
    if has_front_camera(simulation.config, simulation.site):
        wanted = {stop.node for stop in stops if stop.visit}
        limit_s += _SCAN_S * sum(place.node in wanted for place in simulation.site.locations.values())
    flight = asyncio.ensure_future(daemon.fly())
    parts: list[asyncio.Future[Any]] = [flight, *beside]
    try:
        await asyncio.wait(parts, return_when=asyncio.FIRST_COMPLETED, timeout=limit_s)
    finally:
        over = flight.done()
        flight.cancel()
        await asyncio.wait([flight])
    if over:
        return flight.result()
    for part in beside:
        if part.done():
            part.result()
    if any(part.done() for part in beside):
        raise RunError("the simulated world ended before the flight")
    raise RunError(f"the flight was not over after {limit_s:.0f} s of its own time")


def _flight_recorder(simulation: Simulation, clock: LoopClock, lossless: bool) -> McapRecorder:
    recorder = McapRecorder(simulation.flight_log, lossless=lossless)
    now_ns = clock.now_ns()
    recorder.record(Topic.MAP, now_ns, Document(site_toml(simulation.site)))
    recorder.record(Topic.CONFIG, now_ns, Document(simulation.config.model_dump_json(indent=1)))
    recorder.record(Topic.SCENARIO, now_ns, Document(simulation.scenario.model_dump_json(indent=1)))
    return recorder


def _spec(simulation: Simulation, ports: WorldPorts) -> WorldSpec:
    scenario, config = simulation.scenario, simulation.config
    adapter = config.vehicle.kind
    return WorldSpec(
        site=scenario.floor.site(simulation.site),
        seed=simulation.seed,
        camera_address=("127.0.0.1", ports.camera),
        vehicle="px4" if adapter == "mavsdk" else adapter,
        vehicle_ports=ports.vehicle,
        start=start_of(config, simulation.site),
        start_yaw_rad=math.radians(config.mission.start_yaw_deg + scenario.vehicle.start_yaw_deg),
        start_offset_m=scenario.vehicle.start_offset_m,
        camera=replace(scenario.camera.camera(), mount=config.camera.mount()),
        front=_front(simulation, ports.front_camera),
        appearance=scenario.floor.look(),
        draught=scenario.wind.draught(),
        battery_frac=scenario.vehicle.battery,
        battery_ah=scenario.vehicle.battery_ah,
        swap_s=scenario.vehicle.swap_s,
        radio=scenario.vehicle.radio(),
        truth_url=simulation.truth_url,
        faults=scenario.fault,
    )


def _front(simulation: Simulation, port: int | None) -> FrontSpec | None:
    if port is None:
        return None
    scenario = simulation.scenario
    camera = replace(scenario.front_camera.camera(), mount=simulation.config.front_camera.mount())
    return FrontSpec(("127.0.0.1", port), camera, scenario.racks.look())


def truth_of(simulation: Simulation) -> dict[str, LocationTruth]:
    """What is really at every location of the simulated racks; empty without a front camera before them."""
    if not has_front_camera(simulation.config, simulation.site):
        return {}
    scenario = simulation.scenario
    focal_px = scenario.front_camera.camera().lens.fx_px
    return stock_truth(simulation.site, scenario.racks.look(), focal_px, simulation.seed)
