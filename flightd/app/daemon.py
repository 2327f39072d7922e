"""Runs a built flight in one TaskGroup.  The dataflow can be read here.

camera -> latest slot -> detector processes -> tick (pilot) -> pump -> vehicle
front camera -> latest slot -> code reader processes -> tick -> store
vehicle, ground -> tick; tick -> recorder, ground, monitors, observers
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Coroutine, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from flightd.app.flight import Flight, Tasks
from flightd.app.tick import Tick
from flightd.app.tick_pace import TickPace
from flightd.core.errors import FlightdError, TransientError, UnavailableError
from flightd.core.tick import TICK_S
from flightd.core.types import OVER, WAITING, Command, Phase
from flightd.ports import Camera
from flightd.runtime.supervisor import restarted

_FIRST_HEARD_S = 2.0
_SILENT_NS = 30_000_000_000
"""A vehicle that nobody heard for so long after the mission's end is not waited for."""
_LINGER_NS = 1_500_000_000
"""Time after the mission's end in which the vehicle is still watched (disarming)."""


@dataclass(slots=True)
class FlightResult:
    """What the daemon itself knows of a flight when it is over; `visited` are the nodes in order, one to
    which the route comes twice stands there twice."""

    phase: Phase
    reason: str
    visited: tuple[str, ...]
    nodes_planned: int
    frames: int
    frames_dropped: int
    latency_ms: dict[str, float]
    arrival_to_wire_ms: dict[str, float] = field(default_factory=dict)
    setpoint_interval_ms: dict[str, float] = field(default_factory=dict)
    dropped: dict[str, int] = field(default_factory=dict)
    restarts: dict[str, int] = field(default_factory=dict)

    @property
    def nodes_done(self) -> int:
        """Nodes visited, each counted once."""
        return len(set(self.visited))


class Daemon:
    """One flight of one vehicle.  `fly` runs until the mission is over."""

    def __init__(self, flight: Flight) -> None:
        self._flight = flight
        self._tick = Tick(flight)
        self._flew = False

    def command(self, command: Command) -> None:
        """Hand an operator's order to the next tick."""
        self._tick.order(command)

    async def fly(self) -> FlightResult:
        """Run everything until the mission is over; cancelled, the vehicle is handed back."""
        try:
            async with asyncio.TaskGroup() as tasks:
                parts = [tasks.create_task(part, name=name) for name, part in self._parts().items()]
                try:
                    await self._tick_until_over()
                finally:  # also where it is cancelled: what follows is to be waited for
                    self._flight.publishers.over()
                for part in parts:
                    part.cancel()
        except ExceptionGroup as group:
            raise _first(group) from group
        return self.result()

    def _parts(self) -> Mapping[str, Coroutine[Any, Any, None]]:
        """What runs beside the tick.  What is not critical restarts."""
        flight = self._flight
        parts = {
            "vehicle": flight.vehicle.run(),
            "camera": self._kept(partial(self._look, flight.camera)),
            "pump": flight.setpoints.run(),
            **self._all_kept(flight.vision.tasks()),
            "recorder": self._kept(flight.recorder.run),
            "ground": self._kept(flight.ground.run),
            "interlock": self._kept(flight.interlock.run),
            "lamp": self._kept(flight.lamp.run),
            "fitness": self._kept(partial(flight.fitness.run, self._waits)),
            "progress": self._kept(flight.progress.run),
            "learnt sensors": self._kept(flight.learnt.run),
            "front-camera": self._kept(partial(self._look, flight.front_camera)),
            **self._all_kept(flight.counting.tasks(flight.publishers.trouble)),
        }
        if flight.startup_fault is not None:
            parts["startup fault"] = self._only_look_after(flight.startup_fault)
        return parts

    def _waits(self) -> bool:
        return self._tick.output.phase in WAITING

    def _kept(self, part: Callable[[], Awaitable[None]]) -> Coroutine[Any, Any, None]:
        return restarted(part, self.failed)

    def _all_kept(self, tasks: Tasks) -> dict[str, Coroutine[Any, Any, None]]:
        return {name: self._kept(part) for name, part in tasks.items()}

    async def _tick_until_over(self) -> None:
        """The control tick, at its pace."""
        vehicle = self._flight.vehicle
        pace = TickPace(self._flight.clock, self._flight.vision.arrival)
        over_ns: int | None = None
        while True:
            now_ns, late_s = await pace.turn()
            output = self._tick.run(now_ns, late_s)
            if output.phase not in OVER:
                continue
            over_ns = over_ns or now_ns
            state = vehicle.state()
            heard_ns = 0 if state is None else min(state.attitude.stamp_ns, state.heartbeat_ns)
            silent = now_ns - heard_ns > _SILENT_NS  # without heartbeats nobody knows whether it is armed
            down = state is None or not state.armed or silent
            if down and now_ns - over_ns > _LINGER_NS:
                return

    async def _look(self, camera: Camera) -> None:
        """A camera's run.  One that cannot be had ends the daemon, but not in the air."""
        try:
            await camera.run()
        except UnavailableError as err:
            await self._in_air_or(err)
            raise TransientError(str(err)) from err

    async def _only_look_after(self, err: FlightdError) -> None:
        """Look after a vehicle that flies; once one that only stands there is disarmed, the daemon ends."""
        await self._in_air_or(err)
        self._flight.publishers.trouble(str(err))
        while self._tick.output.phase is Phase.PREFLIGHT:
            state = self._flight.vehicle.state()
            if state is not None and not state.armed:
                raise err
            await asyncio.sleep(TICK_S)

    async def _in_air_or(self, err: FlightdError) -> None:
        """Raise an error that the daemon ends with, unless its vehicle flies: that needs the daemon more than
        the daemon what it lacks."""
        clock, vehicle = self._flight.clock, self._flight.vehicle
        give_up_ns = clock.now_ns() + round(_FIRST_HEARD_S * 1e9)
        while (state := vehicle.state()) is None and clock.now_ns() < give_up_ns:  # noqa: ASYNC110
            await asyncio.sleep(TICK_S)
        self._flew |= state is not None and state.armed
        if not self._flew:
            raise err

    def failed(self, err: TransientError) -> None:
        """A part that restarts has failed: tell people."""
        self._flight.publishers.trouble(str(err))

    def result(self) -> FlightResult:
        """How the flight stands after the newest tick."""
        flight, pilot, output = self._flight, self._flight.pilot, self._tick.output
        return FlightResult(
            phase=output.phase,
            reason=output.reason,
            visited=tuple(pilot.mission.visited),
            nodes_planned=pilot.plan.nodes,
            frames=flight.camera.frames,
            frames_dropped=sum(flight.vision.dropped.values()),
            latency_ms=flight.vision.latency_quantiles_ms(),
            arrival_to_wire_ms=flight.vision.arrival_to_wire_ms(),
            setpoint_interval_ms=flight.setpoints.interval_quantiles_ms(),
            dropped=self._tick.dropped,
            restarts=self._tick.restarts,
        )


def _first(group: ExceptionGroup[Exception]) -> Exception:
    """The error that a person can act on, out of a group; the first one if there is none."""
    leaves = list(_leaves(group))
    return next((err for err in leaves if isinstance(err, FlightdError)), leaves[0])


def _leaves(group: ExceptionGroup[Exception]) -> Iterator[Exception]:
    for err in group.exceptions:
        if isinstance(err, ExceptionGroup):
            yield from _leaves(err)
        else:
            yield err
