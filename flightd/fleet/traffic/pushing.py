"""What is left where prioritised planning finds no way: all are pushed to their goals, step by step.

Slow, for each move is from rest to rest and of two whose cells meet one is flown after the other, but it
untangles what nobody can plan alone.  Its moves become ordinary plans in time, so that they are flown in the
same order as all others.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from flightd.fleet.traffic.cells import Conflicts
from flightd.fleet.traffic.distances import Distances
from flightd.fleet.traffic.lacam import moves_home
from flightd.fleet.traffic.lanes import Arc
from flightd.fleet.traffic.motions import NEVER, Motion, MotionNet, at_rest, vertex_of
from flightd.fleet.traffic.pibt import Mover
from flightd.fleet.traffic.plan import Action, Plan, actions_of


@dataclass(frozen=True, slots=True)
class Pushed:
    """A drone at rest in a configuration from `at_ms` on; until then it may be on the resources `base`.  It
    wants to the first of its `ends` to which a way leads, and does not enter the resources `shut`."""

    drone: str
    configuration: int
    at_ms: int
    ends: tuple[int, ...]
    base: tuple[int, ...] = ()
    shut: frozenset[int] = frozenset()


def cut_off(net: MotionNet, drones: Iterable[Pushed]) -> frozenset[str]:
    """Those from which no way leads to any of their ends, were they alone."""
    return frozenset(drone for drone, each in _movers(net, drones).items() if each.goal is None)


def plan_by_pushing(net: MotionNet, conflicts: Conflicts, drones: Sequence[Pushed]) -> dict[str, Plan] | None:
    """Plans after which every drone stands on its end for good, all of them together; who is cut off from
    his only makes room.  None where none were found."""
    start = tuple(vertex_of(each.configuration) for each in drones)
    moves = moves_home(net.lanes, conflicts, tuple(_movers(net, drones).values()), start)
    if moves is None:
        return None
    timed = _Timed(net, conflicts, drones)
    for number, arc in moves:
        timed.fly(drones[number].drone, arc)
    return timed.plans()


def _movers(net: MotionNet, drones: Iterable[Pushed]) -> dict[str, Mover]:
    distances: dict[frozenset[int], Distances] = {}
    found: dict[str, Mover] = {}
    for each in drones:
        known = distances.get(each.shut)
        if known is None:
            known = distances[each.shut] = Distances(net, each.shut)
        here = vertex_of(each.configuration)
        goal = next((end for end in each.ends if known.to(end)[here] < NEVER), None)
        if goal is None:
            left_ms: Sequence[int] = [min(ms, NEVER - 1) for ms in known.to(here)]
        else:
            left_ms = known.to(goal)
        found[each.drone] = Mover(goal, each.shut, left_ms)
    return found


class _Timed:
    """Moves one after the other, each as early as the air that it takes is left by those before it."""

    def __init__(self, net: MotionNet, conflicts: Conflicts, drones: Sequence[Pushed]) -> None:
        self._net = net
        self._conflicts = conflicts
        self._at = {each.drone: each.configuration for each in drones}
        self._ready_ms = {each.drone: each.at_ms for each in drones}
        self._actions: dict[str, list[Action]] = {each.drone: [] for each in drones}
        self._left_ms: dict[int, int] = {}
        for each in drones:
            for resource in (vertex_of(each.configuration), *each.base):
                self._leave(resource, each.at_ms)

    def plans(self) -> dict[str, Plan]:
        """Of all moves until now."""
        return {drone: Plan(tuple(actions)) for drone, actions in self._actions.items()}

    def fly(self, drone: str, arc: Arc) -> None:
        """A turn where one is needed, and one lane from rest to rest."""
        for motion in self._motions(self._at[drone], arc):
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

    def _motions(self, here: int, arc: Arc) -> list[Motion]:
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
