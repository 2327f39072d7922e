"""Who may fly where now: plans, their order, what of them is released, and what happens when one does not
go on.

What was released is a promise: a drone without a link flies it to its end and waits there.  Only what comes
after it is ever planned anew, round all promises.  So the courses of all drones are free of conflicts at
any time, and there is always one that can go on.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Final, TypeAlias

from flightd.fleet.traffic.action_graph import (
    ActionGraph,
    ConflictingPlansError,
    Course,
    CyclicDependenciesError,
)
from flightd.fleet.traffic.cells import CellSize, Conflicts, conflicts_of, within
from flightd.fleet.traffic.closures import ClosedAir
from flightd.fleet.traffic.drone_course import DroneCourse
from flightd.fleet.traffic.lanes import LaneGraph
from flightd.fleet.traffic.motions import NEVER, Act, MotionNet, at_rest
from flightd.fleet.traffic.plan import Action, Plan, Stop, occupancy
from flightd.fleet.traffic.prioritised import FixedBookings, PrioritisedPlanner
from flightd.fleet.traffic.pushing import Pushed, cut_off, plan_by_pushing
from flightd.fleet.traffic.tours import Request
from flightd.mission.plan.leg_times import Pace

ComesHome: TypeAlias = Callable[[str, int, int], bool]
"""Whether a drone comes home with its reserve from a vertex that it reaches after so many milliseconds."""
HORIZON_MS: Final = 12_000
"""Actions are released until those that are not done last so long: what a drone flies without a link."""
UNKNOWN_M: Final = 3.0
"""By how much a drone may be off that does not know by how much: a node beside its own."""
LATE_MS: Final = 90_000
"""Who does not get on is expected to be so late."""


class TrafficControl:
    """The traffic on one floor.  Times are milliseconds from any one origin."""

    def __init__(self, lanes: LaneGraph, pace: Pace, cell: CellSize) -> None:
        self.lanes = lanes
        self.net = MotionNet(lanes, pace)
        self.conflicts: Conflicts = conflicts_of(lanes, cell)
        self._cell = cell
        self._planner = PrioritisedPlanner(self.net, self.conflicts)
        self.drones: dict[str, DroneCourse] = {}
        self.closed = ClosedAir(lanes)
        self._avoided: dict[str, frozenset[int]] = {}
        self._graph = ActionGraph({}, self.conflicts)
        self.replans = 0

    def enter(self, drone: str, place: int, quarter: int = 0, ends: Sequence[int] = ()) -> None:
        """A drone that stands, or hovers, on a vertex of its own, usually a pad; `ends` are those on which it
        may stay for good, that vertex where none is named."""
        self.drones[drone] = DroneCourse(place, quarter, ends=tuple(ends) or (place,))
        self._avoided.pop(drone, None)
        self._rebuild()

    def may_enter(self, drone: str, place: int, holding: Mapping[str, int] | None = None) -> bool:
        """Whether nobody else is, or is to come, where the drone would stand.  `holding` are those that do
        not fly by this traffic yet, but stand where it can fly them on from, each on a vertex."""
        near = set(self.conflicts[place])
        holding = holding or {}
        for other, course in self.drones.items():
            if course.roams and other in holding:
                taken: Collection[int] = {holding[other]}
            else:
                ahead = (action.resource for action in course.ahead)
                taken = course.wreck or {course.place, *ahead, *_ends_of(course)}
            if other != drone and not near.isdisjoint(taken):
                return False
        return True

    def is_clear(self, drone: str, air: Iterable[int], here: Collection[int] = ()) -> bool:
        """Whether nobody else may be in this air now, or was released into it, and nothing of it is closed
        for who leaves from `here`."""
        wanted = frozenset(air)
        if not wanted.isdisjoint(self.closed.shut_for(here)):
            return False
        near = wanted.union(*(self.conflicts[resource] for resource in wanted))
        zones = self.closed_by()
        return all(
            near.isdisjoint(course.wreck or course.air) and wanted.isdisjoint(zones.get(other, ()))
            for other, course in self.drones.items()
            if other != drone
        )

    def roam(
        self, drone: str, place: int, air: Collection[int], doubt_m: float, now_ms: int
    ) -> tuple[str, ...]:
        """A drone flies by somebody else's will, is near `place` and may be anywhere in `air`, or `doubt_m`
        beside: others are planned round that, and who was released into it stands still, until the drone
        enters anew.  Returns those for which there is no way."""
        course = self.drones[drone]
        projected = self.projected(now_ms)
        before = self.avoided(drone) if course.roams else frozenset()
        course.place, course.wreck, course.roams = place, frozenset((place, *air)), True
        course.ahead, course.stops, course.doubt_m, course.released = [], (), 0.0, course.done
        reach_m = self._cell.separation_m + doubt_m
        zone = within(self.lanes, tuple(course.wreck), reach_m, self._cell.upright_m)
        self._avoided[drone] = zone
        if zone <= before:
            return ()
        projected[drone] = []
        return self._replan_met(projected, zone, now_ms)

    def done(self, drone: str, number: int, now_ms: int) -> list[int]:
        """The first `number` actions of a drone's life are done.  Returns the vertices at which it
        counted."""
        course = self.drones[drone]
        visited: list[int] = []
        while course.done < min(number, course.released):
            action = course.ahead.pop(0)
            course.done += 1
            course.late_ms = 0
            course.place, course.quarter, course.since_ms = action.vertex, action.quarter, now_ms
            if action.act is Act.COUNT:
                visited.append(action.vertex)
                course.stops = tuple(stop for stop in course.stops if stop.vertex != action.vertex)
        return visited

    def release(self, now_ms: int, comes_home: ComesHome | None = None) -> dict[str, list[Action]]:
        """What each drone may do beyond what it was told: all that its predecessors are done for, as far as
        the horizon, and no further than it `comes_home` from."""
        zones = self.closed_by()
        told: dict[str, list[Action]] = {}
        for drone, course in self.drones.items():
            if course.failed or course.doubt_m > 0.0:
                continue
            base_ms = sum(action.duration_ms for action in course.base)
            fresh: list[Action] = []
            for number, action in enumerate(course.tail, start=course.released):
                if base_ms >= HORIZON_MS or not self._is_free(drone, number, action, zones):
                    break
                base_ms += action.duration_ms
                if comes_home is not None and not comes_home(drone, action.vertex, base_ms):
                    break
                fresh.append(action)
            if fresh:
                if not course.base:
                    course.since_ms = now_ms
                course.released += len(fresh)
                told[drone] = fresh
        return told

    def _is_free(self, drone: str, number: int, action: Action, zones: Mapping[str, frozenset[int]]) -> bool:
        if any(action.resource in zone for other, zone in zones.items() if other != drone):
            return False
        return all(self.drones[other].done > its for other, its in self._graph.waits_for((drone, number)))

    def closed_by(self) -> dict[str, frozenset[int]]:
        """Into which air nobody else is released on account of each drone: the grown cells of those whose
        position is doubted, and the air of those that roam."""
        return {
            drone: self._avoided[drone] if course.roams else self._zone(course)
            for drone, course in self.drones.items()
            if course.roams or course.doubt_m > 0.0
        }

    def _zone(self, course: DroneCourse) -> frozenset[int]:
        reach_m = self._cell.separation_m + course.doubt_m
        return within(self.lanes, course.air, reach_m, self._cell.upright_m)

    def paused(self) -> frozenset[str]:
        """The drones that must stand where they are: in doubt themselves, or released into a grown cell that
        they are not in yet."""
        found = {drone for drone, course in self.drones.items() if course.doubt_m > 0.0}
        for doubted, zone in self.closed_by().items():
            for drone, course in self.drones.items():
                if drone != doubted and any(action.resource in zone for action in course.base):
                    found.add(drone)
        return frozenset(found)

    def waits(self, drone: str) -> tuple[str, ...]:
        """For whom a drone waits with its next action."""
        course = self.drones[drone]
        if not course.tail:
            return ()
        return tuple(
            other
            for other, its in self._graph.waits_for((drone, course.released))
            if self.drones[other].done <= its
        )

    def projected(self, now_ms: int) -> dict[str, list[Action]]:
        """What is ahead of each drone, at the times that are to be expected by now."""
        begun = {
            (drone, course.done): max(now_ms + 1, course.since_ms + course.ahead[0].duration_ms)
            for drone, course in self.drones.items()
            if course.base
        }
        done = {drone: course.done for drone, course in self.drones.items()}
        late_ms = {drone: course.late_ms for drone, course in self.drones.items()}
        projected = self._graph.projected(now_ms, done, begun, late_ms)
        return {drone: projected.get(drone, []) for drone in self.drones}

    def give(self, drone: str, stops: Sequence[Stop], ends: Sequence[int], now_ms: int) -> bool:
        """Plan a drone's stops, and an end to stay on, round all others.  False, and nothing has changed,
        where no way was found."""
        course = self.drones[drone]
        old = course.stops, course.ends
        course.late_ms = 0
        course.stops, course.ends = tuple(stops), tuple(ends)
        self.replans += 1
        projected = self.projected(now_ms)
        request = self._request(drone, projected, now_ms)
        planned = self._planner.plan([request], self._fixed(projected, {drone}, ()))
        if drone in planned.without:
            course.stops, course.ends = old
            return False
        self._adopt(projected, planned.plans)
        return True

    def replan(self, drones: Iterable[str], now_ms: int) -> tuple[str, ...]:
        """Plan what is not released of these drones anew, all together.  Those for which there is no way,
        even without stops, hold where their base ends or go on making room, and are returned."""
        return self._replan(set(drones), self.projected(now_ms), now_ms)

    def _replan(
        self, todo: set[str], projected: Mapping[str, Sequence[Action]], now_ms: int
    ) -> tuple[str, ...]:
        todo = {drone for drone in todo if not self.drones[drone].failed}
        aside = self._making_room(todo, projected, now_ms)
        todo -= aside
        holding: set[str] = set()
        at_large: set[str] = set()
        may_push = True
        shut, _ = self._shut(())
        for drone in todo:
            course = self.drones[drone]
            course.stops = tuple(stop for stop in course.stops if stop.vertex not in shut)
        while True:
            self.replans += 1
            fixed = self._fixed(projected, todo - holding, holding, at_large)
            requests = [self._request(drone, projected, now_ms) for drone in sorted(todo - holding)]
            planned = self._planner.plan(requests, fixed)
            stopless = [drone for drone in planned.without if self.drones[drone].stops]
            for drone in stopless:
                self.drones[drone].stops = ()
            if stopless:
                continue
            if not planned.without:
                break
            closed = self.closed.air
            if barred := {d for d in planned.without if not closed.isdisjoint(self.drones[d].air)} - at_large:
                at_large |= barred
                continue
            stuck = cut_off(self.net, self._to_push(planned.without, projected, now_ms))
            if not stuck and may_push:
                may_push = False
                if self._push_home(projected, now_ms):
                    return tuple(sorted(holding | aside))
            holding |= stuck or set(planned.without)
            todo |= holding | self._met_by(holding, projected)
        plans = {**planned.plans, **{drone: Plan(()) for drone in holding}}
        self._adopt(projected, plans)
        return tuple(sorted(holding | aside))

    def _making_room(
        self, drones: Collection[str], projected: Mapping[str, Sequence[Action]], now_ms: int
    ) -> frozenset[str]:
        """Those of them that are cut off and were pushed out of others' way: planned anew they would stop
        in it."""
        pushed = [drone for drone in drones if self.drones[drone].is_pushed_aside]
        return cut_off(
            self.net,
            [
                each
                for each in self._to_push(pushed, projected, now_ms)
                if each.shut.isdisjoint(action.resource for action in self.drones[each.drone].tail)
            ],
        )

    def _push_home(self, projected: Mapping[str, Sequence[Action]], now_ms: int) -> bool:
        """Everybody goes home by pushing, whatever he had ahead; False, and nothing has changed, where no way
        was found."""
        flying = [drone for drone, course in self.drones.items() if not course.failed]
        plans = plan_by_pushing(self.net, self.conflicts, self._to_push(flying, projected, now_ms))
        if plans is None:
            return False
        for drone in flying:
            self.drones[drone].stops = ()
        self._adopt(projected, plans)
        return True

    def _to_push(
        self, drones: Collection[str], projected: Mapping[str, Sequence[Action]], now_ms: int
    ) -> list[Pushed]:
        """These drones where their bases end, with what is closed for each."""
        wrecks = {
            other for course in self.drones.values() for r in course.wreck for other in self.conflicts[r]
        }
        shut, inside = self._shut(drones, drones)
        found: list[Pushed] = []
        for drone in drones:
            request = self._request(drone, projected, now_ms)
            base = tuple(action.resource for action in self.drones[drone].base)
            avoided = frozenset(inside.get(drone, shut) | wrecks)
            found.append(Pushed(drone, request.configuration, request.at_ms, request.ends, base, avoided))
        return found

    def _met_by(self, holding: Collection[str], projected: Mapping[str, Sequence[Action]]) -> set[str]:
        """Who would pass where one of these drones holds."""
        places: set[int] = set()
        for drone in holding:
            course = self.drones[drone]
            places.update(self.conflicts[course.base_end])
        return {
            drone
            for drone, actions in projected.items()
            if drone not in holding
            and any(a.resource in places for a in actions[len(self.drones[drone].base) :])
        }

    def _request(self, drone: str, projected: Mapping[str, Sequence[Action]], now_ms: int) -> Request:
        course = self.drones[drone]
        base = projected[drone][: len(course.base)]
        place, quarter, at_ms = course.place, course.quarter, now_ms + course.late_ms
        if base:
            place, quarter, at_ms = base[-1].vertex, base[-1].quarter, base[-1].end_ms
        counted = {action.vertex for action in base if action.act is Act.COUNT}
        stops = tuple(stop for stop in course.stops if stop.vertex not in counted)
        return Request(drone, at_rest(place, quarter), at_ms, stops, course.ends, course.priority)

    def _fixed(
        self,
        projected: Mapping[str, Sequence[Action]],
        without: Collection[str],
        holding: Collection[str],
        at_large: Collection[str] = (),
    ) -> FixedBookings:
        """What stays as it is while drones `without` are planned anew."""
        taken: list[tuple[str, int, int, int]] = []
        for drone, course in self.drones.items():
            n = len(course.base)
            actions = projected[drone]
            taken += [(drone, action.resource, 0, action.end_ms) for action in actions[:n]]
            if drone in without:
                continue
            place, since_ms = (actions[n - 1].vertex, actions[n - 1].end_ms) if n else (course.place, 0)
            rest = () if drone in holding else actions[n:]
            taken += [(drone, *each) for each in occupancy(rest, place, since_ms, NEVER)]
            taken += [(drone, resource, 0, NEVER) for resource in course.wreck]
        return FixedBookings(taken, *self._shut(without, at_large))

    def _shut(
        self, drones: Iterable[str], at_large: Collection[str] = ()
    ) -> tuple[frozenset[int], dict[str, frozenset[int]]]:
        """What is closed, and what for those who stand in it: what people closed they leave by the shortest
        way, those `at_large` by any."""
        zones = tuple(self._avoided.values())
        avoided, closed = frozenset().union(*zones), self.closed.air
        inside: dict[str, frozenset[int]] = {}
        for drone in drones:
            course = self.drones[drone]
            at = set(course.air)
            others = [zone for zone in zones if at.isdisjoint(zone)]
            if drone in at_large:
                shut = self.closed.shut_for(at)
            elif at.isdisjoint(closed):
                shut = closed
            else:
                shut = self.closed.shut_round_way_out(at, course.base_end, course.ends)
            if len(others) < len(zones) or shut != closed:
                inside[drone] = shut.union(*others)
        return avoided | closed, inside

    def _adopt(self, projected: Mapping[str, Sequence[Action]], plans: Mapping[str, Plan]) -> None:
        before = {drone: course.ahead for drone, course in self.drones.items()}
        for drone, course in self.drones.items():
            n = len(course.base)
            actions = list(projected[drone])
            course.ahead = [*actions[:n], *plans[drone].actions] if drone in plans else actions
        try:
            self._rebuild()
        except (ConflictingPlansError, CyclicDependenciesError):
            for drone, ahead in before.items():
                self.drones[drone].ahead = ahead
            raise

    def _rebuild(self) -> None:
        courses = {
            drone: Course(course.place, course.done, tuple(course.ahead))
            for drone, course in self.drones.items()
            if not course.roams
        }
        self._graph = ActionGraph(courses, self.conflicts)

    def fail(self, drone: str, now_ms: int, air: Collection[int] = ()) -> tuple[str, ...]:
        """A drone does not go on: where it may be (`air`, all that it was released to if that is not known)
        is closed, others are planned round it.  Returns those for which there is no way."""
        projected = self.projected(now_ms)
        course = self.drones[drone]
        course.wreck = frozenset(air or course.air)
        reach_m = self._cell.separation_m + course.doubt_m
        self._avoided[drone] = within(self.lanes, tuple(course.wreck), reach_m, self._cell.upright_m)
        course.ahead, course.stops, course.doubt_m, course.released = [], (), 0.0, course.done
        projected[drone] = []
        return self._replan_met(projected, self._avoided[drone], now_ms)

    def _replan_met(
        self, projected: Mapping[str, Sequence[Action]], air: frozenset[int], now_ms: int
    ) -> tuple[str, ...]:
        met = {
            drone
            for drone, course in self.drones.items()
            if any(action.resource in air for action in course.tail)
        }
        return self._replan(met, projected, now_ms)

    @property
    def zones(self) -> tuple[frozenset[int], ...]:
        """All where nobody is planned who is not in it, each by itself."""
        return (*self._avoided.values(), *self.closed.zones)

    def avoided(self, drone: str) -> frozenset[int]:
        """Where nobody is planned on account of this drone."""
        return self._avoided.get(drone, frozenset())

    def close(self, name: str, lanes: Collection[int], now_ms: int) -> tuple[str, ...]:
        """Nobody enters these any more; who is in there leaves.  Returns those for which there is no way."""
        zone = self.closed.close(name, lanes)
        ends = {vertex for lane in lanes for vertex in self.lanes.ends_of(lane)}
        for course in self.drones.values():
            course.stops = tuple(stop for stop in course.stops if stop.vertex not in ends)
        return self._replan_met(self.projected(now_ms), zone, now_ms)

    def open(self, name: str) -> None:
        """They may be flown again."""
        self.closed.open(name)

    def inside(self) -> dict[str, tuple[str, ...]]:
        """For each closure, by its name, the drones that may be in its air, or were released into it."""
        if not self.closed.zones:
            return {}
        zones = self.closed_by()
        airs = {
            drone: zones[drone] if course.doubt_m > 0.0 else course.wreck or course.air
            for drone, course in self.drones.items()
        }
        return self.closed.within(airs)

    def is_cut_off(self, drone: str) -> bool:
        """Whether no way leads to its pad but through what is closed, what it is in and leaves left out."""
        course = self.drones[drone]
        return not any(self.closed.comes_home(course.air, course.base_end, end) for end in course.ends)

    def doubt(self, drone: str, doubt_m: float, now_ms: int) -> None:
        """A drone may be so far beside where it should be, beyond what its cell allows for; 0: it is sure."""
        course, doubt_m = self.drones[drone], doubt_m if math.isfinite(doubt_m) else UNKNOWN_M
        if doubt_m > 0.0 and course.doubt_m <= 0.0:
            course.doubt_since_ms = now_ms
        course.doubt_m = doubt_m
        if doubt_m <= 0.0:
            self._avoided.pop(drone, None)
            course.late_ms = 0

    def avoid(self, drone: str, now_ms: int) -> tuple[str, ...]:
        """Plan others round all the air in which a drone may be, until it is heard and sure, and before it
        where they would wait for it."""
        air = self._avoided[drone] = self._zone(self.drones[drone])
        met = {
            other
            for other, course in self.drones.items()
            if other != drone and any(action.resource in air for action in course.tail)
        }
        return self._replan(met | self._late(drone), self.projected(now_ms), now_ms)

    def overtake(self, drones: Iterable[str], now_ms: int) -> tuple[str, ...]:
        """Plan those anew who would wait for these drones, which do not get on."""
        waiting = set().union(*(self._late(drone) for drone in drones))
        return self._replan(waiting, self.projected(now_ms), now_ms)

    def _late(self, drone: str) -> set[str]:
        """Expect a drone to be late.  Returns who would wait for it."""
        self.drones[drone].late_ms = LATE_MS
        return {
            other
            for other, course in self.drones.items()
            if other != drone and self._ever_waits(other, course, drone)
        }

    def _ever_waits(self, drone: str, course: DroneCourse, late: str) -> bool:
        return any(
            other == late and its >= self.drones[late].done
            for number in range(course.released, course.done + len(course.ahead))
            for other, its in self._graph.waits_for((drone, number))
        )


def _ends_of(course: DroneCourse) -> tuple[int, ...]:
    return (course.ahead[-1].vertex,) if course.ahead else ()
