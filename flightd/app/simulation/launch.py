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
from collections.abc import Coroutine
from contextlib import AsyncExitStack, ExitStack
from dataclasses import replace
from typing import Any

from flightd.adapters.ground_link.camera_optics import camera_optics
from flightd.adapters.recent_log import RecentLog
from flightd.adapters.recorder.recorder import McapRecorder, WhenFull, drop_newest, wait_for_disk
from flightd.adapters.recorder.writer_watch import HUNG_S
from flightd.app.absent_parts import NO_GROUND
from flightd.app.build import build, detector_pool, ground_link
from flightd.app.counting.flight_count import FlightCount
from flightd.app.daemon import Daemon, FlightResult
from flightd.app.detection.detector_pool import DetectorPool
from flightd.app.flight import Flight
from flightd.app.flight_identity import FlightIdentity
from flightd.app.maintenance.checks import DroneChecks
from flightd.app.maintenance.maintainer import DroneMaintainer
from flightd.app.maintenance.shown_settings import ShownSettings
from flightd.app.recording import record_setting
from flightd.app.service import monitors
from flightd.app.simulation.lockstep import LockstepDetectors, LockstepReaders
from flightd.app.simulation.ports import WorldPorts, free_ports, peers_at
from flightd.app.simulation.process_faults import LauncherFaults, needs_ground
from flightd.app.simulation.simulation import Simulation, world_spec
from flightd.app.simulation.world_process import run_world, watch_world
from flightd.config.ground import GroundConfig
from flightd.core.errors import RunError, UnavailableError
from flightd.core.topics import Document, Topic
from flightd.runtime.clock import Hold, LoopClock
from flightd.runtime.datagrams import open_paced_datagrams
from flightd.runtime.ending_signals import end_on_signals, handlers_kept
from flightd.runtime.event_loops import ScaledLoop, VirtualLoop
from flightd.runtime.message_channel import Channel
from flightd.runtime.undisturbed_start import undisturbed
from flightd.sim.world import World

DETECTION_S = 0.008
"""Modelled time of a detection in lockstep: what a companion computer needs."""
READING_S = 0.15
"""And of reading the codes of one picture."""

_SCAN_S = 30.0
"""More than the count of one location can take, re-takes included."""
_PORT_TRIES = 5
_DRONE = "simulated"


class FlightInterruptedError(RunError):
    """A signal ended the flight; `result` is how it stood then, None before it began."""

    def __init__(self, number: signal.Signals, result: FlightResult | None) -> None:
        phase = "before it began" if result is None else f"in phase {result.phase}"
        super().__init__(f"interrupted by {number.name} {phase}")
        self.signal = number
        self.result = result


def fly(simulation: Simulation) -> FlightResult:
    """Fly it and leave `flight.mcap` and `truth.mcap` in the folder.  RunError when it was ended early, of
    these FlightInterruptedError by SIGINT or SIGTERM; where its orderly end takes too long for whoever sends
    one, a second one ends the process at once."""
    ended_by: list[signal.Signals] = []
    with handlers_kept():
        try:
            if simulation.speed is None:
                virtual = VirtualLoop()
                with asyncio.Runner(loop_factory=lambda: virtual) as runner:
                    return runner.run(_lockstep(simulation, virtual.hold, ended_by))
            factor = simulation.speed
            with asyncio.Runner(loop_factory=lambda: ScaledLoop(factor)) as runner:
                return runner.run(_real_time(simulation, factor, ended_by))
        except asyncio.CancelledError:
            raise FlightInterruptedError(ended_by[0], None) from None


def _this_task() -> asyncio.Task[Any]:
    task = asyncio.current_task()
    assert task is not None
    return task


async def _lockstep(simulation: Simulation, hold: Hold, ended_by: list[signal.Signals]) -> FlightResult:
    end_on_signals(_this_task(), ended_by, again_at_once=True)
    clock, config, site = LoopClock(), simulation.config, simulation.site
    identity = FlightIdentity.of(simulation.setting, _DRONE, clock.now_ns())
    with ExitStack() as stack:
        recorder = stack.enter_context(_flight_recorder(simulation, identity, wait_for_disk))
        truth = stack.enter_context(McapRecorder(simulation.truth_log, when_full=wait_for_disk))
        pool = stack.enter_context(detector_pool(config, site, clock, hold))
        faults = LauncherFaults(simulation.scenario.fault, pool, recorder)
        world, ports = await _opened(simulation, clock, hold, truth, faults, pool)
        count = FlightCount(config, site, simulation.folder, stack, run=identity.run)
        counting = await count.begun(clock, lambda readers: LockstepReaders(readers, READING_S, hold), hold)
        await pool.ready()
        flight = build(
            config,
            site,
            simulation.setting.order,
            clock=clock,
            detectors=LockstepDetectors(pool, clock, DETECTION_S, hold),
            recorder=recorder,
            counting=counting,
            observers=[simulation.observer],
            peers=peers_at(ports, config, simulation.camera),
            hold=hold,
            interlock=faults.interlock,
        )
        faults.mission = flight.pilot.mission
        return await _beside(simulation, flight, ended_by, world.run(), faults.run())


async def _opened(
    simulation: Simulation,
    clock: LoopClock,
    hold: Hold,
    truth: McapRecorder,
    faults: LauncherFaults,
    pool: DetectorPool,
) -> tuple[World, WorldPorts]:
    """A world that listens, and its ports; what its down camera draws the `pool` looks at ahead.

    A port that was free a moment ago may have been taken by another simulation: then others are tried."""
    for attempt in range(1, _PORT_TRIES + 1):
        ports = free_ports(simulation.config)
        world = World(world_spec(simulation, ports), clock, truth, faults.tell, hold, pool.look_ahead)
        try:
            await world.open()
        except UnavailableError:
            if attempt == _PORT_TRIES or simulation.truth_url:
                raise
        else:
            return world, ports
    raise AssertionError("unreachable")


async def _real_time(simulation: Simulation, factor: float, ended_by: list[signal.Signals]) -> FlightResult:
    end_on_signals(_this_task(), ended_by, again_at_once=True)
    clock, config, site = LoopClock(), simulation.config, simulation.site
    ports = free_ports(config)
    peers = peers_at(ports, config, simulation.camera)
    identity = FlightIdentity.of(simulation.setting, _DRONE, clock.now_ns())
    if simulation.truth_url:
        peers = replace(peers, vehicle=config.vehicle.url)
    recent = RecentLog()
    checks = DroneChecks(config, site, f"a simulation on site {site.name}", recent)
    maintainer = DroneMaintainer(checks, ShownSettings(config), restarts=False)
    watching = monitors(config.metrics, {}, journal=False, recent=recent)
    async with watching as watchers, AsyncExitStack() as stack:
        recorder = stack.enter_context(_flight_recorder(simulation, identity, drop_newest))
        process, channel = _started_world(simulation, ports, factor, stack)
        pool = stack.enter_context(detector_pool(config, site, clock))
        count = FlightCount(config, site, simulation.folder, stack, run=identity.run)
        checks.newest_ns = count.newest_ns
        counting = await count.begun(clock)
        link = ground_link(
            _ground_settings(simulation), site, clock, counting, maintainer, camera_optics(config)
        )
        ground = NO_GROUND if link is None else stack.enter_context(link)
        faults = LauncherFaults(simulation.scenario.fault, pool, recorder, link)
        await pool.ready()
        flight = build(
            config,
            site,
            simulation.setting.order,
            clock=clock,
            detectors=pool,
            recorder=recorder,
            ground=ground,
            counting=counting,
            monitors=watchers,
            observers=[simulation.observer],
            peers=peers,
            opener=open_paced_datagrams,
            interlock=faults.interlock,
        )
        faults.mission, maintainer.flight = flight.pilot.mission, flight
        return await _beside(
            simulation, flight, ended_by, watch_world(process, channel, faults.tell), faults.run()
        )


def _started_world(
    simulation: Simulation, ports: WorldPorts, factor: float, stack: AsyncExitStack
) -> tuple[Any, Channel]:
    """The world's process and the channel from it; it ends when that closes, however this process ends."""
    context = multiprocessing.get_context("spawn")
    channel = Channel()
    spec = world_spec(simulation, ports)
    arguments = (spec, factor, simulation.truth_log, channel.theirs)
    process = context.Process(target=run_world, args=arguments, name="world")
    with undisturbed():
        process.start()
    channel.theirs.close()
    stack.callback(process.join, 15.0)
    stack.callback(channel.close)
    return process, channel


def _ground_settings(simulation: Simulation) -> GroundConfig:
    """The configured link, or one on any free ports where a fault needs it."""
    configured = simulation.config.ground
    if configured.listen or not needs_ground(simulation.scenario.fault):
        return configured
    return GroundConfig(listen="127.0.0.1", status_port=0, command_port=0)


async def _beside(
    simulation: Simulation,
    flight: Flight,
    ended_by: list[signal.Signals],
    *others: Coroutine[Any, Any, None],
) -> FlightResult:
    """The flight, with what runs beside it for as long.  FlightInterruptedError when a signal ends it."""
    daemon, beside = Daemon(flight), [asyncio.ensure_future(part) for part in others]
    try:
        return await _within_limit(simulation, daemon, *beside)
    except asyncio.CancelledError:
        if ended_by:
            raise FlightInterruptedError(ended_by[0], daemon.result()) from None
        raise
    finally:
        for part in beside:
            part.cancel()
        await asyncio.wait(beside)


async def _within_limit(
    simulation: Simulation, daemon: Daemon, *beside: asyncio.Future[None]
) -> FlightResult:
    """The flight, unless it takes far longer than its plan can, or what runs beside it fails."""
    plan = simulation.plan()
    limit_s = 120.0 + 60.0 * (len(plan.stops) + 1)
    if simulation.config.front_camera.is_fitted:
        limit_s += _SCAN_S * sum(place.node in plan.to_visit for place in simulation.site.locations.values())
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


def _flight_recorder(simulation: Simulation, identity: FlightIdentity, when_full: WhenFull) -> McapRecorder:
    metadata = {**identity.metadata(), "seed": str(simulation.seed)}
    hung_s = math.inf if when_full is wait_for_disk else HUNG_S
    recorder = McapRecorder(simulation.flight_log, metadata=metadata, when_full=when_full, hung_s=hung_s)
    now_ns = identity.clock_ns
    record_setting(recorder, now_ns, simulation.setting)
    recorder.record(Topic.SCENARIO, now_ns, Document(simulation.scenario.model_dump_json(indent=1)))
    return recorder
