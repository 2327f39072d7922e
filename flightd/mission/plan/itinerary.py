"""The stops of a mission: what is done, what is flown to, what is left for another battery.  Pure."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace

from flightd.config.mission import Heading
from flightd.core.geometry import wrap_pi
from flightd.core.types import EventLevel, GridPose
from flightd.mission.event_log import EventLog
from flightd.mission.plan.flight_plan import FlightPlan, HeadingPolicy, Stop, make_plan, run_of
from flightd.mission.plan.sweep_leg import SweepLeg
from flightd.mission.reasons import Reason, in_words
from flightd.site.site import Site
from flightd.site.ways import NoWayError

_WAY_SHOWN = 32
"""So many nodes ahead are told."""
_OVER_NODE_M = 0.15
"""A node that is flown over so near was visited."""
_STOPS_M = 0.8
"""The way in which a drone that flies past a shelf comes to rest."""


class Itinerary:
    """The stops in order, re-planned on the way; says to `events` what became of an order or a doubt."""

    def __init__(self, site: Site, plan: FlightPlan, policy: HeadingPolicy, events: EventLog) -> None:
        self._site = site
        self._home = plan.home
        self._policy = policy
        self._events = events
        self._stops: list[Stop] = list(plan.stops)
        self._next = 0
        self._left_over: tuple[str, ...] = ()
        self.why_home: Reason | None = None
        """Why it turned home last; None where it never did."""
        self.stand = (plan.start, plan.start_yaw_rad)
        """The node on which the drone stands before it flies, and its heading there."""
        self.visited: list[str] = []
        self.visits = 0
        """How often a node was visited; of those in `visited` some may be taken out again."""
        self._run: tuple[str, ...] = ()
        self._waits = plan.waits
        self._told_pad = ""
        self.wanted: Callable[[str], bool] = lambda _node: False
        """Whether anything is left to count at a node."""

    def begin(self, plan: FlightPlan) -> None:
        """Fly this plan instead, on the ground; nothing of it is visited yet."""
        self._stops, self._next, self._run, self.visited = list(plan.stops), 0, (), []
        self.stand = (plan.start, plan.start_yaw_rad)
        self._waits, self._left_over, self._told_pad = plan.waits, (), ""

    @property
    def goal(self) -> Stop:
        """The stop flown to or hovered at."""
        return self._stops[min(self._next, len(self._stops) - 1)]

    @property
    def is_last(self) -> bool:
        """No stop follows the goal."""
        return self._next + 1 >= len(self._stops)

    @property
    def next_stop(self) -> Stop:
        """The stop after the goal, which must not be the last one."""
        return self._stops[self._next + 1]

    @property
    def ahead(self) -> tuple[str, ...]:
        """The nodes to visit after the goal, in order."""
        return tuple(stop.node for stop in self._stops[self._next + 1 :] if stop.visit)

    @property
    def onward(self) -> tuple[str, ...]:
        """What is to be visited after the goal: also what is being flown past, as far as it is not done."""
        return (*self._run_left, *self.ahead)

    @property
    def next_end(self) -> Stop | None:
        """The next stop after the goal that is a visit, or the end of a leg past a shelf."""
        ahead = self._stops[self._next + 1 :]
        return next((stop for stop in ahead if stop.visit or stop.sweep is not None), None)

    @property
    def run(self) -> tuple[str, ...]:
        """The goal and the visits that follow it in its aisle without another stop between."""
        return run_of(self._site, self._stops[self._next :])

    @property
    def _run_left(self) -> tuple[str, ...]:
        run = dict.fromkeys(self._run)
        return tuple(node for node in run if node not in self.visited or self.wanted(node))

    @property
    def way(self) -> tuple[str, ...]:
        """The nodes that are flown over next, the goal first; those far ahead are left out."""
        return tuple(stop.node for stop in self._stops[self._next : self._next + _WAY_SHOWN])

    @property
    def waits_at(self) -> str:
        """The node ahead where it will hold, or holds, until it is told where to fly on; empty: it flies
        home."""
        return next((stop.node for stop in self._stops[self._next :] if stop.waits), "")

    @property
    def lands_at(self) -> str:
        """The node of the pad on which it comes down at last."""
        return self._stops[-1].node

    @property
    def lands_as_told(self) -> bool:
        """It comes down on a pad that it was told, and waits there for another flight."""
        return self._told_pad == self.lands_at

    @property
    def left_over(self) -> tuple[str, ...]:
        """What the way home leaves unvisited."""
        return self._left_over

    @property
    def remaining(self) -> tuple[str, ...]:
        """The stops that this mission still wants to visit, in order."""
        ahead = (stop.node for stop in self._stops[self._next :] if stop.visit)
        return self._left_over or (*self._run_left, *ahead)

    def advance(self, pose: GridPose | None, *, either_side: bool) -> None:
        """Go on to the next stop; backwards where that saves half a turn: from aisle to aisle with the nose
        to the shelf within them, and along one where `either_side` may be faced, after a scan that ended
        facing one of them."""
        before, stop = self.goal, self.next_stop
        self._next += 1
        if self._policy.heading is not Heading.SHELF or pose is None or stop.sweep is not None:
            return
        sideways = self._site.nodes[before.node].aisle == self._site.nodes[stop.node].aisle
        goes = stop.visit or stop.node != before.node
        if sideways and goes and not either_side and before.sweep is None:
            return
        if abs(wrap_pi(stop.yaw_rad - pose.yaw_rad)) > math.pi * 0.75:
            self._stops[self._next] = replace(stop, yaw_rad=wrap_pi(stop.yaw_rad + math.pi))

    def note_visit(self, now_ns: int) -> None:
        """The goal was visited, if it was a wanted one."""
        if self.goal.visit:
            self.visited.append(self.goal.node)
            self.visits += 1
            self._events.report(now_ns, EventLevel.INFO, "visited", self.goal.node)

    # Counting in passing

    def sweep(self, now_ns: int, legs: Sequence[SweepLeg]) -> None:
        """Fly past the shelves of the `run` that begins here, by these legs."""
        run = self.run
        rest = [stop.node for stop in self._stops[self._next + len(run) :] if stop.visit]
        end = self._sweep_stop(legs[-1])
        onward = self._onward(end, rest)
        self._stops[self._next + 1 :] = [*(self._sweep_stop(leg) for leg in legs), *onward.stops]
        self._stops[self._next] = replace(self.goal, visit=False)
        self._run = run
        speed_mps = min(leg.speed_mps for leg in legs)
        text = f"aisle {legs[0].aisle}: {len(legs)} legs at {speed_mps:.2f} m/s, {len(run)} nodes"
        self._events.report(now_ns, EventLevel.INFO, "sweep", text)

    def note_passed(self, now_ns: int, pose: GridPose) -> None:
        """Nodes that are flown over on the last leg past what is counted there are visited."""
        sweep, node = self.goal.sweep, pose.node
        if sweep is None or node not in sweep.nodes or node not in self._run or node in self.visited:
            return
        later = (stop.sweep for stop in self._stops[self._next + 1 :] if stop.sweep is not None)
        if any(node in leg.nodes for leg in later) or abs(pose.along_m) > _OVER_NODE_M:
            return
        self.visited += [node] * self._run.count(node)
        self.visits += 1
        self._events.report(now_ns, EventLevel.INFO, "visited", node)

    def visit_undecided(self, now_ns: int) -> None:
        """The legs are flown: stop before what they left open, in the best order, and go on from there."""
        due, rest = self._run_left, self.ahead
        again = [node for node in due for _ in range(self._run.count(node) - 1)]
        self._run = ()
        here = self.goal
        due, rest = in_best_order(self._site, here.node, due, rest, self._home)
        self._stops[self._next + 1 :] = self._onward(here, [*due, *rest]).stops
        self.visited = [*(node for node in self.visited if node not in due), *again]
        if due:
            self._events.report(now_ns, EventLevel.INFO, "sweep", f"{', '.join(due)} to stop at")

    def shorten(self, pose: GridPose | None) -> None:
        """Stop at the next node of a leg past a shelf rather than at its end."""
        sweep, goal = self.goal.sweep, self.goal
        if sweep is None or pose is None:
            return
        towards = math.copysign(1.0, goal.x_m - pose.x_m)
        nodes = (self._site.nodes[node] for node in sweep.nodes)
        ahead = [node for node in nodes if towards * (node.x_m - pose.x_m) > _STOPS_M]
        node = min(ahead, key=lambda node: abs(node.x_m - pose.x_m), default=self._site.nodes[goal.node])
        self._stops[self._next] = Stop(node.id, node.x_m, node.y_m, goal.yaw_rad, visit=False)

    def _onward(self, here: Stop, visits: Sequence[str]) -> FlightPlan:
        """From a stop over the visits home; against one-way lines where there is no legal way."""
        ends, yaw_rad = (here.node, self._home), here.yaw_rad
        try:
            return make_plan(self._site, visits, *ends, self._policy, yaw_rad, waits=self._waits)
        except NoWayError:
            return make_plan(
                self._site, visits, *ends, self._policy, yaw_rad, in_need=True, waits=self._waits
            )

    def _sweep_stop(self, leg: SweepLeg) -> Stop:
        at = self._site.nodes[leg.end]
        return Stop(at.id, at.x_m, at.y_m, leg.yaw_rad, visit=False, sweep=leg)

    def leave(self, nodes: Sequence[str]) -> None:
        """Visit these later, on another battery."""
        self._left_over = tuple(nodes)

    def turn_home(self, now_ns: int, reason: Reason, *, in_need: bool, pad: str | None = None) -> None:
        """Fly to the home pad or another; by the shortest way, against one-way lines too, `in_need` and where
        no legal way leads there."""
        self._left_over, self._told_pad = self.remaining, ""
        self.why_home = reason
        self._events.report(now_ns, EventLevel.WARNING, "home", in_words(reason))
        try:
            self._replan([], in_need=in_need, home=pad)
        except NoWayError:
            self._replan([], in_need=True, home=pad)

    def go_to(
        self, now_ns: int, node: str, *, waits: bool = False, lands: bool = False, halted: bool = False
    ) -> bool:
        """Fly over `node` home, as ordered, or hold there (`waits`), or land on the pad there (`lands`): an
        order to fly home from where it would hold flies home.  False for one that cannot be followed: it
        changes nothing.  `halted`: it begins its leg anew."""
        if node not in self._site.nodes:
            why = f"no node {node!r} on site {self._site.name}"
        else:
            holds = self.goal.waits
            ends = lands or (not waits and self.goal.node == node == self.waits_at)
            try:
                if lands:  # its next flight leads home from there
                    self._site.path(node, self._home)
                self._replan([] if ends else [node], waits=waits, home=node if lands else None)
            except NoWayError as err:
                why = f"goto {node} refused: {err}"
            else:
                self._waits, self._told_pad = waits, node if lands else ""
                self._next += holds and halted  # it is there already
                return True
        self._events.report(now_ns, EventLevel.WARNING, "command", why)
        return False

    def leads_on_from(self, pose: GridPose | None) -> bool:
        """Whether open lines lead to the goal from where the drone turned out to be."""
        if pose is None or pose.node not in self._site.nodes:
            return False
        try:
            self._site.path(pose.node, self.goal.node, against_one_way=True)
        except NoWayError:
            return False
        return True

    def rejoin(self, now_ns: int, pose: GridPose) -> None:
        """From where the drone turned out to be, which must lead on: over the nearest node, by open lines, to
        the goal."""
        goal = self.goal
        self._events.report(now_ns, EventLevel.INFO, "position", f"sure again: {pose.node}")
        node = self._site.nodes[pose.node]
        if node.id == goal.node:
            return
        way = make_plan(
            self._site, [goal.node], node.id, goal.node, self._policy, pose.yaw_rad, in_need=True
        ).stops[:-1]
        first = Stop(node.id, node.x_m, node.y_m, way[0].yaw_rad, False)
        self._stops[self._next : self._next + 1] = [first, *way[:-1], goal]

    def recount(self, now_ns: int, due: Sequence[str], *, returning: bool) -> None:
        """Put nodes whose count was withdrawn before what is left, near as they are; they are left for the
        next battery where the way leads home already.  One that is led from node to node flies to none by
        itself."""
        due = self._may_recount(now_ns, due)
        if not due:
            return
        if not returning:
            left = (stop.node for stop in self._stops[self._next :] if stop.visit)
            nodes = [*due, *(node for node in self._run_left if node not in due), *left]
            try:
                ends, yaw_rad = (due[0], self._home), self.goal.yaw_rad
                rest = make_plan(self._site, nodes, *ends, self._policy, yaw_rad, waits=self._waits)
            except NoWayError as err:
                self._leave_out(now_ns, due, err)
                return
            self._stops[self._next :] = rest.stops
            self._run = ()
        else:
            self._left_over = (*due, *(node for node in self._left_over if node not in due))
        self._note_recount(now_ns, due)

    def recount_next(self, now_ns: int, due: Sequence[str]) -> None:
        """Visit nodes again whose count was taken back, from the goal, at which the drone rests, as soon as
        its aisle is done; one that is led from node to node flies to none by itself."""
        due = self._may_recount(now_ns, due)
        if not due:
            return
        aisle = self._site.nodes[self.goal.node].aisle
        here = list(itertools.takewhile(lambda node: self._site.nodes[node].aisle == aisle, self.ahead))
        rest = self._onward(self.goal, [*here, *due, *self.ahead[len(here) :]])
        self._stops[self._next + 1 :] = rest.stops
        self._note_recount(now_ns, due)

    def _may_recount(self, now_ns: int, nodes: Sequence[str]) -> list[str]:
        """Those that were visited, or that an earlier flight of the count has done, for the others lie ahead;
        and to which open lines lead from the goal: of the rest it is told that they are left out.  None where
        the drone is led."""
        if self._waits:
            return []
        reached = []
        for node in nodes:
            if node in self.remaining and node not in self.visited:
                continue
            try:
                self._site.path(self.goal.node, node, against_one_way=True)
            except NoWayError as err:
                self._leave_out(now_ns, [node], err)
            else:
                reached.append(node)
        return reached

    def _note_recount(self, now_ns: int, due: Sequence[str]) -> None:
        self.visited = [node for node in self.visited if node not in due]
        self._events.report(now_ns, EventLevel.WARNING, "recount", f"{', '.join(due)} to visit again")

    def _leave_out(self, now_ns: int, due: Sequence[str], err: NoWayError) -> None:
        text = f"{', '.join(due)} left out: {err}"
        self._events.report(now_ns, EventLevel.WARNING, "recount", text)

    def resume_from_pad(self, now_ns: int) -> None:
        """Stand on the pad that was flown to, with what was left over ahead."""
        pad = self.goal
        self.stand = (pad.node, pad.yaw_rad)
        ends, yaw_rad = (pad.node, self._home), pad.yaw_rad
        rest = make_plan(self._site, self._left_over, *ends, self._policy, yaw_rad, waits=self._waits)
        self._stops, self._next = list(rest.stops), 0
        text = f"{len(self._left_over)} stops left; change the battery on the pad at {pad.node}"
        self._events.report(now_ns, EventLevel.WARNING, "swap", text)
        self._left_over = ()

    def _replan(
        self, visits: list[str], *, in_need: bool = False, home: str | None = None, waits: bool = False
    ) -> None:
        """Finish the present leg, then fly over `visits` home, or hold at the last of them.  NoWayError
        leaves everything as it is."""
        here = self.goal
        onward = make_plan(
            self._site,
            visits,
            here.node,
            home or self._home,
            self._policy,
            here.yaw_rad,
            in_need=in_need,
            waits=waits,
        )
        self._stops[self._next :] = [replace(here, waits=False), *onward.stops]
        self._run = ()


def in_best_order(
    site: Site, here: str, due: Sequence[str], rest: Sequence[str], home: str
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The nodes `due` of one aisle, for a drone over its node `here`, and the visits after them, in the order
    of the least way: to one end of them and along to the other, and from there to that end of the next
    aisle's visits that is nearer."""
    aisle = site.nodes[rest[0]].aisle if rest else ""
    following = tuple(itertools.takewhile(lambda node: site.nodes[node].aisle == aisle, rest))
    ways = [tuple(rest)]
    if len(following) > 1:
        ways.append((*following[::-1], *rest[len(following) :]))
    along = sorted(due, key=lambda node: site.nodes[node].x_m)
    orders = [tuple(along), tuple(along[::-1])]

    def metres(choice: tuple[tuple[str, ...], tuple[str, ...]]) -> float:
        order, way = choice
        try:
            return site.length_m((here, *order, way[0] if way else home))
        except NoWayError:
            return math.inf

    best = min(itertools.product(orders, ways), key=lambda choice: round(metres(choice), 3))
    return best if math.isfinite(metres(best)) else (tuple(due), tuple(rest))
