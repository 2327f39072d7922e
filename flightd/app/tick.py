"""One control tick: gather what arrived, let the pilot step, obey it, publish one snapshot."""

from __future__ import annotations

from dataclasses import replace

from flightd.adapters.store.progress import LeftOver
from flightd.app.flight import Flight
from flightd.app.guarded_step import GuardedStep
from flightd.app.last_answers import LastAnswers
from flightd.core.flight_order import ChosenPlan
from flightd.core.outlook import NO_OUTLOOK
from flightd.core.snapshot import Snapshot
from flightd.core.tick import TickInput, TickOutput
from flightd.core.topics import Topic
from flightd.core.types import LOOKING, Command, CommandKind, Health
from flightd.ports import CountsDrops


class Tick:
    """Ticks a flight; who calls `run` gives the time, so that the same tick flies and simulates."""

    def __init__(self, flight: Flight) -> None:
        self._flight = flight
        self._orders: list[Command] = []
        self._call = flight.publishers.barrier.call
        self._step = GuardedStep(flight.pilot)
        self._last = LastAnswers()
        self.dropped: dict[str, int] = {}
        """What full queues and lost workers had cost at the newest tick, by their names."""
        self.restarts: dict[str, int] = {}
        """What had died and was brought back by then, by the part's name."""
        # once: to look for a protocol's members takes as long as a tick's whole status
        self._counts_drops = flight.vehicle if isinstance(flight.vehicle, CountsDrops) else None

    @property
    def output(self) -> TickOutput:
        """What the newest tick answered."""
        return self._step.output

    def order(self, command: Command) -> None:
        """Hand an operator's order to the next tick."""
        self._orders.append(command)

    def run(self, now_ns: int, late_s: float = 0.0) -> TickOutput:
        """Tick once, `late_s` after the tick was due.  A part that fails loses its turn."""
        tick = self._gather(now_ns)
        output = self._step.step(tick)
        self._obey(output)
        if any(command.kind is CommandKind.PLAN for command in tick.commands):
            self._call("recorder", lambda: self._record_plan(now_ns), None)
        self._call(
            "status", lambda: self._flight.publishers.publish(self._snapshot(tick, output, late_s)), None
        )
        return output

    def _gather(self, now_ns: int) -> TickInput:
        """What arrived since the last tick; nothing from a part that fails, and nothing good of it."""
        flight, call, last = self._flight, self._call, self._last
        return TickInput(
            now_ns,
            call("detection", lambda: flight.vision.fresh(now_ns), ()),
            last.vehicle(call("vehicle", lambda: (flight.vehicle.state(),), None)),
            call("vehicle", lambda: tuple(flight.vehicle.attitudes()), ()),
            call("ground link", self._take_commands, ()),
            last.ground_silent_s(now_ns, call("ground link", lambda: flight.ground.silent_s(now_ns), None)),
            call("count", flight.counting.take, ()),
            call("count", flight.counting.take_counted, ()),
            last.health(
                now_ns,
                call("detection", lambda: self._vision_health(now_ns), None),
                call("recorder", self._recorder_health, None),
            ),
            flight.fitness.unfit,
            call("interlock", lambda: flight.interlock.is_closed, False),
        )

    def _vision_health(self, now_ns: int) -> Health:
        vision = self._flight.vision
        return Health(vision.latency_p99_s(now_ns), vision.replaced)

    def _recorder_health(self) -> Health:
        recorder = self._flight.recorder
        return Health(recorder_restarts=recorder.restarts, recorder_error=recorder.error)

    def _take_commands(self) -> tuple[Command, ...]:
        taken = self._flight.ground.take_commands()  # first: where it fails no order is lost
        orders, self._orders = [*self._orders, *taken], []
        if self._flight.startup_fault is not None:  # it may land what flies, and starts nothing
            orders = [order for order in orders if order.kind is not CommandKind.START]
        return tuple(orders)

    def _obey(self, output: TickOutput) -> None:
        """Give each part what the pilot answered for it."""
        flight, call = self._flight, self._call
        call("vehicle", lambda: flight.vehicle.demand(output.demand), None)
        call("setpoints", lambda: flight.setpoints.set(output.setpoint), None)
        if output.setpoint is None:
            call("detection", flight.vision.not_flying, None)
        call("pose output", lambda: flight.share_pose(output.shared), None)
        call("count", lambda: flight.counting.keep(output), None)
        call("front camera", lambda: flight.front_camera.expose(*flight.pilot.exposure), None)
        call("lamp", lambda: flight.lamp.shine(flight.pilot.looks and output.phase in LOOKING), None)
        call("progress", self._keep, None)

    def _keep(self) -> None:
        """What is to last beyond the daemon's end."""
        pilot = self._flight.pilot
        self._flight.progress.put(LeftOver(pilot.left_over, *pilot.mission.stand))
        if pilot.learnt is not None:
            self._flight.learnt.put(pilot.learnt)

    def _record_plan(self, now_ns: int) -> None:
        """What is flown in the order's place, for whoever reads the log."""
        standing = self._flight.pilot.mission.standing
        nodes = standing.nodes if standing.id else ()
        chosen = ChosenPlan(standing.id, nodes, standing.levels, standing.counts)
        self._flight.recorder.record(Topic.PLAN, now_ns, chosen)

    def _possible_commands(self) -> frozenset[CommandKind]:
        return frozenset() if self._step.escaped else self._flight.pilot.possible_commands

    def _count_losses(self, health: Health) -> None:
        """Newly fill in `dropped` and `restarts`."""
        flight = self._flight
        dropped = {
            **flight.vision.dropped,
            "recorder": flight.recorder.dropped,
            "refused": flight.camera.refused + flight.front_camera.refused,
            "setpoints": flight.setpoints.failed,
            **self._call("count", lambda: flight.counting.dropped, {}),
        }
        if self._counts_drops is not None:
            dropped["vehicle"] = self._counts_drops.dropped
        self.dropped = dropped
        self.restarts = {
            "detector": health.detectors_replaced,
            "reader": self._call("count", lambda: flight.counting.replaced, 0),
            "recorder": health.recorder_restarts,
        }

    def _snapshot(self, tick: TickInput, output: TickOutput, late_s: float) -> Snapshot:
        """What the record needs of a tick, and all the rest at those that are told to people."""
        self._count_losses(tick.health)
        flight = self._flight
        snapshot = Snapshot(
            tick,
            output,
            tick_late_s=(late_s,),
            latencies_ms=flight.vision.drain_latencies_ms(),
            failure=self._step.failure,
        )
        return self._with_outlook(snapshot) if flight.publishers.tells(snapshot) else snapshot

    def _with_outlook(self, snapshot: Snapshot) -> Snapshot:
        flight, pilot, call = self._flight, self._flight.pilot, self._call
        vision, now_ns = flight.vision, snapshot.stamp_ns
        return replace(
            snapshot,
            nodes_done=call("mission", lambda: len(set(pilot.mission.visited)), 0),
            nodes_planned=pilot.plan.nodes,
            frames=flight.camera.frames,
            frames_dropped=sum(vision.dropped.values()),
            fps=vision.fps,
            latency_ms=vision.latency_ms,
            dropped=self.dropped,
            restarts=self.restarts,
            repeated_level=flight.setpoints.stale,
            possible=call("mission", self._possible_commands, frozenset()),
            height_goal_m=call("mission", lambda: pilot.mission.height_goal_m, 0.0),
            view_m=call("mission", lambda: pilot.mission.view_m, None),
            outlook=call("mission", lambda: pilot.mission.outlook(now_ns), NO_OUTLOOK),
        )
