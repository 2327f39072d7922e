"""Priority inheritance with backtracking: step by step, who is in the way of another is pushed on.

K. Okumura, M. Machida, X. Défago and Y. Tamura, "Priority Inheritance with Backtracking for Iterative
Multi-agent Path Finding", Artificial Intelligence 310, 2022.  Here it is what is left where prioritised
planning finds no way: slow, for of two moves whose cells meet one is flown after the other, but it
untangles what nobody can plan alone. Its steps become ordinary plans in time, so that they are flown in the
same order as all others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from flightd.fleet.traffic.cells import Conflicts
from flightd.fleet.traffic.distances import Distances
from flightd.fleet.traffic.lanes import Arc
from flightd.fleet.traffic.motions import NEVER, Motion, MotionNet, at_rest, vertex_of
from flightd.fleet.traffic.plan import Action, Plan, actions_of

STEPS_AT_MOST: Final = 600


@dataclass(frozen=True, slots=True)
class Pushed:
    """A drone at rest in a configuration from `at_ms` on, with the vertex that it wants to; until then it
    may be on the resources `base`.  It does not enter the resources `shut`."""

    drone: str
    configuration: int
    at_ms: int
    goal: int
    base: tuple[int, ...] = ()
    shut: frozenset[int] = frozenset()


def plan_by_pushing(
    net: MotionNet, conflicts: Conflicts, distances: Distances, drones: Sequence[Pushed]
) -> dict[str, Plan] | None:
    """Plans that bring every drone to its goal, all on the vertices that they want at the same time; None
    where that does not come about within the steps."""
    return _Pushing(net, conflicts, distances, drones).run()


class _Pushing:
    def __init__(
        self, net: MotionNet, conflicts: Conflicts, distances: Distances, drones: Sequence[Pushed]
    ) -> None:
        self._net = net
        self._conflicts = [frozenset(each) for each in conflicts]
        self._drones = {each.drone: each for each in drones}
        self._rest_ms = {each.drone: distances.to(each.goal) for each in drones}
        self._at = {each.drone: each.configuration for each in drones}
        self._ready_ms = {each.drone: each.at_ms for each in drones}
        self._waited = dict.fromkeys(self._drones, 0)
        self._actions: dict[str, list[Action]] = {each.drone: [] for each in drones}
        self._left_ms: dict[int, int] = {}
        self._next: dict[str, int] = {}
        for each in drones:
            for resource in (vertex_of(each.configuration), *each.base):
                self._leave(resource, each.at_ms)

    def run(self) -> dict[str, Plan] | None:
        for _ in range(STEPS_AT_MOST):
            if all(vertex_of(self._at[drone]) == each.goal for drone, each in self._drones.items()):
                return {drone: Plan(tuple(actions)) for drone, actions in self._actions.items()}
            if not self._step():
                return None
        return None

    def _step(self) -> bool:
        """Decide the next vertices, and fly there.  False when nobody moves."""
        self._next = {}
        order = sorted(self._drones, key=lambda drone: (-self._waited[drone], drone))
        for drone in order:
            if drone not in self._next:
                self._decide(drone)
        movers = [drone for drone in order if self._next[drone] != vertex_of(self._at[drone])]
        moved = False
        while True:
            free = [drone for drone in movers if self._is_clear(drone)]
            if not free:
                break
            self._fly(free[0])
            movers.remove(free[0])
            moved = True
        for drone, each in self._drones.items():
            self._waited[drone] = 0 if vertex_of(self._at[drone]) == each.goal else self._waited[drone] + 1
        return moved

    def _decide(self, drone: str) -> bool:
        """The drone's next vertex; False where it has to stay in somebody's way."""
        here = vertex_of(self._at[drone])
        each, rest_ms = self._drones[drone], self._rest_ms[drone]
        ways = [arc for arc in self._net.lanes.arcs[here] if arc.resource not in each.shut]
        wanted = sorted((rest_ms[vertex], vertex) for vertex in (here, *(arc.to for arc in ways)))
        for left_ms, there in wanted:
            if left_ms >= NEVER or self._is_taken(drone, here, there):
                continue
            self._next[drone] = there
            pushed = [
                other
                for other in self._drones
                if other not in self._next and vertex_of(self._at[other]) in self._conflicts[there]
            ]
            if all(other in self._next or self._decide(other) for other in pushed):
                return True
        self._next[drone] = here
        return False

    def _is_taken(self, drone: str, here: int, there: int) -> bool:
        """Whether somebody goes there, or comes from there to here."""
        return any(
            next_vertex in self._conflicts[there]
            or (next_vertex == here and vertex_of(self._at[other]) == there)
            for other, next_vertex in self._next.items()
            if other != drone
        )

    def _is_clear(self, drone: str) -> bool:
        """Whether the way to the next vertex meets nobody where all stand now."""
        lane = self._arc(drone).resource
        return not any(
            vertex_of(self._at[other]) in self._conflicts[lane] for other in self._drones if other != drone
        )

    def _arc(self, drone: str) -> Arc:
        there = self._next[drone]
        return next(arc for arc in self._net.lanes.arcs[vertex_of(self._at[drone])] if arc.to == there)

    def _fly(self, drone: str) -> None:
        for motion in self._motions(drone):
            resources = [part.resource for part in motion.parts]
            earliest = [self._left_ms.get(other, 0) for r in resources for other in self._conflicts[r]]
            start_ms = max(self._ready_ms[drone], *earliest)
            self._actions[drone] += actions_of(motion, start_ms)
            self._ready_ms[drone] = start_ms + motion.duration_ms
            self._at[drone] = motion.target
            for resource in resources:
                self._leave(resource, self._ready_ms[drone])

    def _leave(self, resource: int, at_ms: int) -> None:
        self._left_ms[resource] = max(self._left_ms.get(resource, 0), at_ms)

    def _motions(self, drone: str) -> list[Motion]:
        """A turn where one is needed, and one lane from rest to rest."""
        here, arc = self._at[drone], self._arc(drone)
        hop = _hop(self._net.onward(here), arc)
        if hop is not None:
            return [hop]
        turned = at_rest(vertex_of(here), arc.quarter)
        turn = next(motion for motion in self._net.onward(here) if motion.target == turned)
        hop = _hop(self._net.onward(turned), arc)
        assert hop is not None
        return [turn, hop]


def _hop(motions: Sequence[Motion], arc: Arc) -> Motion | None:
    return next(
        (
            motion
            for motion in motions
            if not motion.target & 1
            and vertex_of(motion.target) == arc.to
            and len(motion.parts) == 1
            and motion.parts[0].resource == arc.resource
        ),
        None,
    )
