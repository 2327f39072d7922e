"""One control tick: gather what arrived, let the pilot step, obey it, publish one snapshot."""

from __future__ import annotations

from flightd.adapters.store.progress import LeftOver
from flightd.app.flight import Flight
from flightd.core.snapshot import Snapshot
from flightd.core.tick import TickInput, TickOutput
from flightd.core.types import Command, CommandKind, Health
from flightd.ports import CountsDrops


class Tick:
    """Ticks a flight; who calls `run` gives the time, so that the same tick flies and simulates."""

    def __init__(self, flight: Flight) -> None:
        self._flight = flight
        self._orders: list[Command] = []

    def order(self, command: Command) -> None:
        """Hand an operator's order to the next tick."""
        self._orders.append(command)

    def run(self, now_ns: int, late_s: float = 0.0) -> TickOutput:
        """Tick once, `late_s` after the tick was due."""
        tick = self._gather(now_ns)
        output = self._flight.pilot.step(tick)
        self._obey(output)
        self._flight.publishers.publish(self._snapshot(tick, output, late_s))
        return output

    def _gather(self, now_ns: int) -> TickInput:
        """What arrived since the last tick."""
        flight = self._flight
        return TickInput(
            now_ns,
            flight.vision.fresh(now_ns),
            flight.vehicle.state(),
            tuple(flight.vehicle.attitudes()),
            self._take_commands(),
            flight.ground.silent_s(now_ns),
            flight.counting.take(),
            flight.counting.take_counted(),
            Health(
                flight.vision.latency_p99_s(now_ns),
                flight.vision.replaced,
                flight.recorder.restarts,
                flight.recorder.error,
            ),
        )

    def _take_commands(self) -> tuple[Command, ...]:
        orders, self._orders = self._orders, []
        orders += self._flight.ground.take_commands()
        if self._flight.startup_fault is not None:  # it may land what flies, and starts nothing
            orders = [order for order in orders if order.kind is not CommandKind.START]
        return tuple(orders)

    def _obey(self, output: TickOutput) -> None:
        """Give each part what the pilot answered for it."""
        flight, mission = self._flight, self._flight.pilot.mission
        flight.vehicle.demand(output.demand)
        flight.setpoints.set(output.setpoint)
        if output.setpoint is None:
            flight.vision.not_flying()
        if output.pose is not None:
            flight.share_pose(output.pose)
        flight.counting.keep(output)
        flight.front_camera.expose(flight.pilot.exposure)
        flight.progress.put(LeftOver(mission.remaining, *mission.stand))

    def _snapshot(self, tick: TickInput, output: TickOutput, late_s: float) -> Snapshot:
        flight, pilot = self._flight, self._flight.pilot
        vision, dropped = flight.vision, dict(flight.vision.dropped)
        lost = sum(dropped.values())
        dropped["recorder"] = flight.recorder.dropped
        dropped["refused"] = flight.camera.refused + flight.front_camera.refused
        if isinstance(flight.vehicle, CountsDrops):
            dropped["vehicle"] = flight.vehicle.dropped
        return Snapshot(
            tick,
            output,
            nodes_done=len(set(pilot.mission.visited)),
            nodes_planned=pilot.plan.nodes,
            frames=flight.camera.frames,
            frames_dropped=lost,
            fps=vision.fps,
            latency_ms=vision.latency_ms,
            tick_late_s=(late_s,),
            latencies_ms=vision.drain_latencies_ms(),
            dropped=dropped,
            restarts={"detector": vision.replaced, "recorder": flight.recorder.restarts},
            repeated_level=flight.setpoints.stale,
            possible=pilot.mission.possible_commands,
            height_goal_m=pilot.mission.height_goal_m,
        )
