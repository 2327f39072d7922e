"""Prioritised planning: one drone after the other, each round those before it.

M. Erdmann and T. Lozano-Pérez, "On Multiple Moving Objects", 1987; M. Čáp et al., "Prioritized Planning
Algorithms for Trajectory Coordination of Multiple Mobile Robots", 2015.  Where everybody ends on a place of
its own that is on nobody's way, and the others keep clear of where a drone stands until it leaves, a plan is
always found.  A drone for which none is found is raised over those in its way (M. Bennewitz et al., 2001),
which are planned anew.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from flightd.fleet.traffic.cells import Conflicts
from flightd.fleet.traffic.distances import Distances
from flightd.fleet.traffic.motions import NEVER, MotionNet, vertex_of
from flightd.fleet.traffic.plan import Plan, occupancy
from flightd.fleet.traffic.reservations import ReservationTable
from flightd.fleet.traffic.sipp import Effort, Sipp
from flightd.fleet.traffic.steps import StepTable
from flightd.fleet.traffic.tours import Request, plan_tour

_RAISED_AT_MOST: Final = 4
_START: Final = "start of "
"""Before the name of a drone: the holder of the air in which it stands until it is planned."""
WEIGHT: Final = 2.0
"""Of the estimate against the time flown (bounded-suboptimal SIPP, K. Yakovlev et al. 2020): a leg that is
found before its search is hurried (`sipp.PATIENT_STATES`) takes at most so much longer than the shortest one
that stops in no section but those of its ends."""
STATES_FOR_ONE: Final = 20_000
"""States that the search for one drone may expand."""


@dataclass(frozen=True, slots=True)
class Planned:
    """The plans that were found, and the drones for which there is none."""

    plans: Mapping[str, Plan]
    without: tuple[str, ...]
    states: int


@dataclass(frozen=True, slots=True)
class FixedBookings:
    """What is taken whatever is planned: (holder, resource, from, to), and resources that are closed."""

    taken: Sequence[tuple[str, int, int, int]] = ()
    closed: frozenset[int] = frozenset()
    closed_for: Mapping[str, frozenset[int]] = field(default_factory=dict)
    """What is closed for some drones in place of that: for those who stand in it."""


class PrioritisedPlanner:
    """Plans drones of one kind on one graph.  To make one takes a second for 2,000 nodes."""

    def __init__(self, net: MotionNet, conflicts: Conflicts, weight: float = WEIGHT) -> None:
        self._net = net
        self._conflicts = conflicts
        self._steps = StepTable(net)
        self._steps.prepare()
        self.distances = Distances(net)
        self.weight = weight

    def plan(
        self,
        requests: Sequence[Request],
        fixed: FixedBookings | None = None,
        states_for_one: int = STATES_FOR_ONE,
    ) -> Planned:
        """Plans that conflict neither with each other nor with what is fixed."""
        return _Round(self, requests, fixed or FixedBookings(), states_for_one).run()

    def table(self, fixed: FixedBookings, drone: str) -> ReservationTable:
        """The reservations that one drone has to go round, without those of other plans."""
        table = ReservationTable(self._conflicts)
        for holder, resource, from_ms, to_ms in fixed.taken:
            # by another name than its plan: who displaces that does not have what is released
            table.take(f"released to {holder}", resource, from_ms, to_ms)
        for resource in fixed.closed_for.get(drone, fixed.closed):
            table.take("closed", resource, 0, NEVER, (resource,))
        return table

    def sipp(self, table: ReservationTable) -> Sipp:
        """A search in a table."""
        return Sipp(self._net, self.distances, table, self.weight, self._steps)

    def book(self, table: ReservationTable, request: Request, plan: Plan) -> None:
        """Take what a plan takes, the end of it for good."""
        place = vertex_of(request.configuration)
        table.take_all(request.drone, occupancy(plan.actions, place, request.at_ms, NEVER))


class _Round:
    def __init__(
        self, planner: PrioritisedPlanner, requests: Iterable[Request], fixed: FixedBookings, most: int
    ) -> None:
        self._planner = planner
        self._requests = {request.drone: request for request in requests}
        self._fixed = fixed
        self._most = most
        self._rank = {request.drone: -request.priority for request in self._requests.values()}
        self._raised = dict.fromkeys(self._requests, 0)
        self._plans: dict[str, Plan] = {}
        self._states = 0
        self._shared = planner.table(fixed, "")

    def run(self) -> Planned:
        queue = [(self._rank[drone], i, drone) for i, drone in enumerate(self._requests)]
        heapq.heapify(queue)
        ties = len(queue)
        without: list[str] = []
        for drone in self._requests:
            self._hold(drone)
        while queue:
            _, _, drone = heapq.heappop(queue)
            self._shared.give_back(_START + drone)
            plan: Plan | None = self._try(drone, self._table_for(drone))
            if plan is None and self._raised[drone] < _RAISED_AT_MOST:
                plan, displaced = self._raise(drone)
                for other in displaced:
                    ties += 1
                    self._hold(other)
                    heapq.heappush(queue, (self._rank[other], ties, other))
            if plan is None:
                without.append(drone)
            else:
                self._keep(drone, plan)
        return Planned(self._plans, tuple(without), self._states)

    def _hold(self, drone: str) -> None:
        """Keep the air in which a drone stands until it is planned, if it may stay there: so that those
        before it shut it in nowhere."""
        request = self._requests[drone]
        place = vertex_of(request.configuration)
        if place in request.ends:
            self._shared.take(_START + drone, place, 0, NEVER)

    def _table_for(self, drone: str) -> ReservationTable:
        if drone not in self._fixed.closed_for:
            return self._shared
        table = self._planner.table(self._fixed, drone)
        for other, theirs in self._plans.items():
            self._planner.book(table, self._requests[other], theirs)
        return table

    def _raise(self, drone: str) -> tuple[Plan | None, list[str]]:
        """Plan a drone as if only those that were raised as often were there; then who is in its way is to be
        planned anew."""
        self._raised[drone] += 1
        self._rank[drone] = min(self._rank.values()) - 1.0
        table = self._planner.table(self._fixed, drone)
        for other, theirs in self._plans.items():
            if self._raised[other] >= self._raised[drone]:
                self._planner.book(table, self._requests[other], theirs)
        plan = self._try(drone, table)
        if plan is None:
            return None, []
        request = self._requests[drone]
        place = vertex_of(request.configuration)
        met: set[str] = set()
        for resource, from_ms, to_ms in occupancy(plan.actions, place, request.at_ms, NEVER):
            met |= self._shared.holders(resource, from_ms, to_ms) & self._plans.keys()
        for other in met:
            self._shared.give_back(other)
            del self._plans[other]
        return plan, sorted(met)

    def _try(self, drone: str, table: ReservationTable) -> Plan | None:
        effort = Effort(self._most)
        plan = plan_tour(self._planner.sipp(table), self._requests[drone], effort)
        self._states += effort.spent
        return plan

    def _keep(self, drone: str, plan: Plan) -> None:
        self._plans[drone] = plan
        self._planner.book(self._shared, self._requests[drone], plan)
