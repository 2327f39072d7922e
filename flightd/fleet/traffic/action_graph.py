"""The action-dependency graph: in which order drones take the resources that they share, whatever time it
is.

W. Hönig, S. Kiesel, A. Tinka, J. W. Durham and N. Ayanian, "Persistent and Robust Execution of MAPF
Schedules in Warehouses", RA-L 2019.  A drone begins an action when its own one before is done, and all
actions of others that had a conflicting resource before it in the plans.  Who is late then delays others
and meets nobody. As long as the graph has no cycle some drone can always go on: there is no deadlock.  That
it has none follows from plans without conflicts, and is checked whenever a graph is made.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from flightd.core.errors import FlightdError
from flightd.fleet.traffic.cells import Conflicts
from flightd.fleet.traffic.plan import Action

ActionKey: TypeAlias = tuple[str, int]
"""A drone and the number of its action, counted over its whole life."""
_Spell: TypeAlias = tuple[int, int, str, int]
"""For which a resource is taken: from and to, milliseconds; by whom, for which of its actions."""


class CyclicDependenciesError(FlightdError):
    """Actions wait for each other in a circle: a deadlock.  It cannot come of plans without conflicts."""


class ConflictingPlansError(FlightdError):
    """Two plans take conflicting resources at the same time."""


@dataclass(frozen=True, slots=True)
class Course:
    """What a drone has ahead: it stands (or is under way from) the vertex `place`; `actions` are numbered
    from `first` on, those before it are done."""

    place: int
    first: int
    actions: Sequence[Action]


class ActionGraph:
    """Made of the courses of all drones.  CyclicDependenciesError, ConflictingPlansError."""

    def __init__(self, courses: Mapping[str, Course], conflicts: Conflicts) -> None:
        self._courses = dict(courses)
        self._waits: dict[ActionKey, tuple[ActionKey, ...]] = {}
        self._depend(conflicts)
        self.order: tuple[ActionKey, ...] = self._topological()
        """Every action after all that it waits for."""

    def action(self, key: ActionKey) -> Action:
        """KeyError for one that is not ahead."""
        course = self._courses[key[0]]
        if not 0 <= key[1] - course.first < len(course.actions):
            raise KeyError(key)
        return course.actions[key[1] - course.first]

    def waits_for(self, key: ActionKey) -> tuple[ActionKey, ...]:
        """The actions of other drones that must be done before this one begins."""
        return self._waits.get(key, ())

    def edges(self) -> Iterable[tuple[ActionKey, ActionKey]]:
        """Every (before, after), those of one drone after another included."""
        for drone, course in self._courses.items():
            for number in range(course.first, course.first + len(course.actions)):
                if number > course.first:
                    yield (drone, number - 1), (drone, number)
                for before in self.waits_for((drone, number)):
                    yield before, (drone, number)

    def _depend(self, conflicts: Conflicts) -> None:
        users: dict[int, list[_Spell]] = {}
        for drone, course in self._courses.items():
            for number, action in enumerate(course.actions, start=course.first):
                users.setdefault(action.resource, []).append((action.start_ms, action.end_ms, drone, number))
        for spells in users.values():
            spells.sort()
        near: dict[int, list[list[_Spell]]] = {}
        for drone, course in self._courses.items():
            for number, action in enumerate(course.actions, start=course.first):
                taken = near.get(action.resource)
                if taken is None:
                    taken = [users[other] for other in conflicts[action.resource] if other in users]
                    near[action.resource] = taken
                if before := _before(action, drone, taken):
                    self._waits[drone, number] = tuple(before.items())
        self._check_ends(users, conflicts)

    def _check_ends(self, users: Mapping[int, Sequence[_Spell]], conflicts: Conflicts) -> None:
        """Nobody passes where another drone stays at the end of its course."""
        for drone, course in self._courses.items():
            last = course.actions[-1] if course.actions else None
            place, since_ms = (last.vertex, last.end_ms) if last else (course.place, 0)
            for resource in conflicts[place]:
                for _, end_ms, other, _ in users.get(resource, ()):
                    if other != drone and end_ms > since_ms:
                        raise ConflictingPlansError(f"{other} passes where {drone} stays")

    def _topological(self) -> tuple[ActionKey, ...]:
        """Kahn's algorithm."""
        keys = [
            (drone, number)
            for drone, course in self._courses.items()
            for number in range(course.first, course.first + len(course.actions))
        ]
        places = {key: place for place, key in enumerate(keys)}
        after: list[list[int]] = [[] for _ in keys]
        missing = [0] * len(keys)
        for before, then in self.edges():
            place = places[then]
            after[places[before]].append(place)
            missing[place] += 1
        ready = [place for place, count in enumerate(missing) if count == 0]
        order: list[ActionKey] = []
        while ready:
            place = ready.pop()
            order.append(keys[place])
            for then_at in after[place]:
                missing[then_at] -= 1
                if missing[then_at] == 0:
                    ready.append(then_at)
        if len(order) < len(keys):
            stuck = sorted(drone for drone, number in set(keys) - set(order))
            raise CyclicDependenciesError(
                f"{', '.join(dict.fromkeys(stuck))} wait for each other in a circle"
            )
        return tuple(order)

    def projected(
        self,
        now_ms: int,
        done: Mapping[str, int],
        ends_ms: Mapping[ActionKey, int],
        late_ms: Mapping[str, int],
    ) -> dict[str, list[Action]]:
        """The actions that are not done (`done` has the number of each drone's first one), at the times
        that come of the order alone, from now on, when each takes as long as planned.  `ends_ms` has when
        those that were begun will be done, `late_ms` by how much a drone is expected to be late with its
        first one."""
        ends: dict[ActionKey, int] = {}
        found: dict[str, list[Action]] = {drone: [] for drone in self._courses}
        for key in self.order:
            drone, number = key
            if number < done[drone]:
                continue
            action = self.action(key)
            start_ms = max((ends.get(before, now_ms) for before in self.waits_for(key)), default=now_ms)
            start_ms = max(start_ms, ends.get((drone, number - 1), now_ms + late_ms.get(drone, 0)))
            end_ms = start_ms + action.duration_ms
            if key in ends_ms:
                end_ms = max(ends_ms[key], start_ms + 1)
                start_ms = end_ms - action.duration_ms
            ends[key] = end_ms
            found[drone].append(_at(action, start_ms, end_ms))
        return found


def _before(action: Action, drone: str, taken: Iterable[Iterable[_Spell]]) -> dict[str, int]:
    """Of each other drone the last action before this one among the spells, each list of which rises.
    ConflictingPlansError."""
    latest: dict[str, int] = {}
    start_ms, end_ms = action.start_ms, action.end_ms
    for spells in taken:
        for from_ms, to_ms, other, number in spells:
            if from_ms >= end_ms:
                break
            if other == drone:
                continue
            if to_ms > start_ms:
                raise ConflictingPlansError(f"{drone} and {other} take conflicting air at {start_ms} ms")
            if latest.get(other, -1) < number:
                latest[other] = number
    return latest


def _at(action: Action, start_ms: int, end_ms: int) -> Action:
    return Action(action.act, action.resource, action.vertex, action.quarter, start_ms, end_ms, action.moving)
