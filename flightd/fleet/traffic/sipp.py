"""Safe-interval path planning: the earliest way of one drone between the reservations of all others.

M. Phillips and M. Likhachev, "SIPP: Safe Interval Path Planning for Dynamic Environments", ICRA 2011.  A
drone at cruising speed cannot wait, so that an early arrival there is not better than a late one: such
states keep the interval of all their possible arrivals, as in Z. Ali and K. Yakovlev, "Safe Interval Path
Planning with Kinodynamic Constraints" (SIPP-IP), AAAI 2023.  Both together are complete and optimal over
the motions.  With a weight above 1, sections of aisles in which the drone neither begins nor ends are flown
through without a stop, unless there is no other way, and a search that takes long is hurried.
"""

from __future__ import annotations

import heapq
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

from flightd.fleet.traffic.distances import Distances
from flightd.fleet.traffic.motions import NEVER, Act, Motion, MotionNet, Part
from flightd.fleet.traffic.plan import Action, Stop, actions_of
from flightd.fleet.traffic.reservations import FREE_FROM, ReservationTable
from flightd.fleet.traffic.sections import NONE
from flightd.fleet.traffic.steps import Step, StepTable, Sweep

PATIENT_STATES: Final = 200
"""A search with a weight above 1 that has looked at so many states is hurried: by far the most are over
before, and those that are not would take three quarters of the time of all."""
HURRIED: Final = 32.0
"""The weight from then on: nearly whatever is nearest to the goal is looked at first."""

_Window: TypeAlias = tuple[int, int]
"""From and to, milliseconds; both ends belong to it."""
_Onward: TypeAlias = Callable[[int], Sequence[Step]]
"""The steps that begin in a configuration."""
_State: TypeAlias = tuple[float, int, int, int, int, int, int, Motion | None]
"""Estimate, -arrival, tie, configuration (-1: the goal, done), earliest and latest arrival, number of the
state before (-1: the start), motion from there."""


@dataclass(frozen=True, slots=True)
class Leg:
    """The way to one goal: its actions, and the configuration and time at their end."""

    actions: tuple[Action, ...]
    configuration: int
    end_ms: int


@dataclass(slots=True)
class Effort:
    """How many states may be expanded, and were, over several searches."""

    most: int
    spent: int = 0


class Sipp:
    """Searches over one net of motions and one table of reservations; `steps` are those of the net."""

    def __init__(
        self,
        net: MotionNet,
        distances: Distances,
        table: ReservationTable,
        weight: float = 1.0,
        steps: StepTable | None = None,
    ) -> None:
        self._steps = steps or StepTable(net)
        self._weight = weight
        self._distances = distances
        self._table = table

    def legs(self, configuration: int, at_ms: int, goal: Stop, effort: Effort) -> Iterator[Leg]:
        """Ways from rest at `at_ms` to the goal, done there, the earliest first: one for each safe interval
        in which it ends.  A goal without dwelling is one to stay at for good.  With a weight above 1, first
        those that stop in no section but those of their ends."""
        rest_ms = self._distances.to(goal.vertex)
        if rest_ms[configuration >> 3] >= NEVER:
            return
        guide = _Guide(self._steps, rest_ms, goal.vertex, self._weight)
        done: set[int] = set()
        if self._weight > 1.0:
            onward = self._through(configuration >> 3, goal.vertex)
            yield from _Search(onward, self._table, guide, goal, effort).run(configuration, at_ms, done)
        everywhere = self._steps.onward
        yield from _Search(everywhere, self._table, guide, goal, effort).run(configuration, at_ms, done)

    def _through(self, start: int, goal: int) -> _Onward:
        """The steps of a drone that stops in no section of an aisle but in those of its start and goal."""
        stays_in = {self._steps.sections[start], self._steps.sections[goal]} - {NONE}
        onward, through, sections = self._steps.onward, self._steps.through, self._steps.sections

        def steps(configuration: int) -> tuple[Step, ...]:
            if sections[configuration >> 3] != NONE:
                return onward(configuration)
            found, entered = through(configuration)
            return onward(configuration) if entered in stays_in else found

        return steps


class _Guide:
    """What is left to the goal: `weight` times the sum of a vertex's and what is more from everywhere.  A
    stop is sure where the drone moves, a launch and a stop where it stands over another node than the
    goal's."""

    def __init__(self, steps: StepTable, rest_ms: Sequence[int], goal: int, weight: float) -> None:
        self.weight = weight
        self.moving_more_ms = steps.stop_ms
        self.resting_more_ms = steps.launch_ms + steps.stop_ms
        self.moving_ms = rest_ms
        self.resting_ms = list(rest_ms)
        for vertex in steps.beside(goal):
            self.resting_ms[vertex] -= self.resting_more_ms


class _Search:
    """One search.  A state at rest is a safe interval and the earliest arrival in it; a moving one is an
    interval of arrivals, of which none was in the queue before."""

    def __init__(
        self,
        onward: _Onward,
        table: ReservationTable,
        guide: _Guide,
        goal: Stop,
        effort: Effort,
    ) -> None:
        self._onward = onward
        self._starts = table.starts
        self._ends = table.ends
        self._goal = goal
        self._effort = effort
        self._states: list[_State] = []
        self._queue: list[_State] = []
        self._tie = 0
        self._best: dict[tuple[int, int], int] = {}
        self._kept: dict[int, Sequence[Step]] = {}
        self._covered: dict[int, tuple[list[int], list[int]]] = {}
        self._guide = guide
        self._weight = guide.weight
        self._looked_at = 0

    def run(self, configuration: int, at_ms: int, done: set[int]) -> Iterator[Leg]:
        """Legs that end in safe intervals whose ends are not in `done`, and are then."""
        until = self._safe_until(configuration >> 3, at_ms)
        if until < 0:
            return
        self._best[configuration, until] = at_ms
        self._push(0, configuration, at_ms, until, None)
        goal_vertex = self._goal.vertex
        queue, states, best, effort = self._queue, self._states, self._best, self._effort
        while queue:
            state = heapq.heappop(queue)
            here, low, high = state[3], state[4], state[5]
            if here < 0:
                if high not in done:
                    done.add(high)
                    yield self._traced(state[6], low, state[7])
                continue
            if not here & 1 and best[here, high] < low:  # reached sooner since
                continue
            if effort.spent >= effort.most:
                return
            effort.spent += 1
            self._looked_at += 1
            if self._looked_at == PATIENT_STATES and self._weight > 1.0:
                self._hurry()
            states.append(state)
            if here >> 3 == goal_vertex and not here & 1:
                self._finish(here, low, high)
            self._expand(here, low, high)

    def _hurry(self) -> None:
        """Go on with a heavier weight, from the states that are there."""
        heavier = HURRIED / self._weight
        self._weight = HURRIED
        waiting = [
            state if state[3] < 0 else (state[4] + (state[0] - state[4]) * heavier, *state[1:])
            for state in self._queue
        ]
        heapq.heapify(waiting)
        self._queue[:] = waiting

    def _safe_until(self, vertex: int, at_ms: int) -> int:
        """The end of the safe interval around a time, -1 where there is none."""
        k = bisect_right(self._starts[vertex], at_ms) - 1
        until = self._ends[vertex][k] if k >= 0 else -1
        return min(until, NEVER) if until >= at_ms else -1

    def _finish(self, here: int, low: int, high: int) -> None:
        """The goal is reached: what is done there, or staying."""
        goal = self._goal
        if goal.dwell_ms <= 0:
            if high >= NEVER:
                self._push(low, -1, low, high, None)
            return
        part = Part(Act.COUNT, goal.column, goal.vertex, 0, goal.dwell_ms)
        count = Motion(here, goal.dwell_ms, (part,))
        for first, _ in self._departures(((goal.column, 0, goal.dwell_ms),), low, high):
            ends = first + goal.dwell_ms
            until = self._safe_until(goal.vertex, ends)
            if until >= 0:
                self._push(ends, -1, ends, until, count)

    def _expand(self, here: int, low: int, high: int) -> None:
        """Every safe arrival by the motions that begin here between `low` and `high`."""
        best, queue, guide = self._best, self._queue, self._guide
        weight = self._weight
        before = len(self._states) - 1
        for target, vertex, duration_ms, sweeps, motion in self._steps(here):
            if guide.moving_ms[vertex] >= NEVER:
                continue
            if target & 1:
                left_ms = weight * (guide.moving_ms[vertex] + guide.moving_more_ms)
                for first, last in self._departures(sweeps, low, high):
                    latest = min(last + duration_ms, NEVER)
                    for arrival, until in self._uncovered(target, first + duration_ms, latest):
                        self._tie += 1
                        item = arrival + left_ms, -arrival, self._tie, target, arrival, until, before, motion
                        heapq.heappush(queue, item)
                continue
            # at rest only the earliest arrival in a safe interval matters, for it can wait
            left_ms = weight * (guide.resting_ms[vertex] + guide.resting_more_ms)
            for arrival, until in self._rests(vertex, duration_ms, sweeps, low, high):
                key = target, until
                if best.get(key, NEVER) > arrival:
                    best[key] = arrival
                    self._tie += 1
                    item = arrival + left_ms, -arrival, self._tie, target, arrival, until, before, motion
                    heapq.heappush(queue, item)

    def _steps(self, here: int) -> Sequence[Step]:
        """Those that begin in a configuration, kept for this search."""
        found = self._kept.get(here)
        if found is None:
            found = self._kept[here] = self._onward(here)
        return found

    def _rests(
        self, vertex: int, duration_ms: int, sweeps: Sequence[Sweep], low: int, high: int
    ) -> Sequence[_Window]:
        """The earliest arrival in each safe interval of a vertex, and its end."""
        if not sweeps:  # a turn ends in the safe interval in which it began
            return ((low + duration_ms, high),) if low + duration_ms <= high else ()
        starts, ends = self._starts[vertex], self._ends[vertex]
        found: list[_Window] = []
        reached = -1
        for first, _ in self._departures(sweeps, low, high):
            arrival = first + duration_ms
            if arrival > reached:
                k = bisect_right(starts, arrival) - 1
                if k >= 0 and ends[k] >= arrival:
                    reached = ends[k]
                    found.append((arrival, min(reached, NEVER)))
        return found

    def _departures(self, sweeps: Sequence[Sweep], low: int, high: int) -> Sequence[_Window]:
        """The parts of low..high at which a motion may begin so that all it sweeps is free, rising."""
        starts_of, ends_of = self._starts, self._ends
        found: list[_Window] = [(low, high)]
        for resource, in_ms, out_ms in sweeps:
            starts = starts_of[resource]
            if starts is FREE_FROM:
                continue
            ends = ends_of[resource]
            narrowed: list[_Window] = []
            for begins, until in found:
                around = bisect_right(starts, begins + in_ms) - 1
                for k in range(max(around, 0), len(starts)):
                    first = starts[k] - in_ms
                    if first > until:
                        break
                    last = ends[k] - out_ms
                    # max() and min() would take longer
                    first = begins if first < begins else first  # noqa: FURB136
                    last = until if last > until else last  # noqa: FURB136
                    if first <= last:
                        narrowed.append((first, last))
            if not narrowed:
                return narrowed
            found = narrowed
        return found

    def _uncovered(self, configuration: int, low: int, high: int) -> Sequence[_Window]:
        """The parts of low..high at which no earlier state in this configuration arrives; from now on, one
        does."""
        spans = self._covered.get(configuration)
        if spans is None:
            self._covered[configuration] = [low], [high]
            return ((low, high),)
        starts, ends = spans
        i, j = bisect_left(ends, low), bisect_right(starts, high)
        if i < j and starts[i] <= low and ends[i] >= high:
            return ()
        found: list[_Window] = []
        at = low
        for k in range(i, j):
            if starts[k] > at:
                found.append((at, starts[k]))
            at = ends[k]
        if at < high or i >= j:
            found.append((at, high))
        starts[i:j], ends[i:j] = [min(low, *starts[i:j], low)], [max(high, *ends[i:j], high)]
        return found

    def _push(self, estimate: float, configuration: int, low: int, high: int, motion: Motion | None) -> None:
        self._tie += 1
        before = len(self._states) - 1
        heapq.heappush(self._queue, (estimate, -low, self._tie, configuration, low, high, before, motion))

    def _traced(self, number: int, end_ms: int, last: Motion | None) -> Leg:
        """The actions to a state at which the goal was done at `end_ms`."""
        pieces: list[list[Action]] = []
        state = self._states[number]
        arrival_ms = end_ms
        configuration = state[3]
        if last is not None:
            arrival_ms = end_ms - last.duration_ms
            pieces.append(actions_of(last, arrival_ms))
        # who stands may have come as early as can be; who moves came just when the next motion began
        while (motion := state[7]) is not None:
            reached_ms = arrival_ms if state[3] & 1 else state[4]
            arrival_ms = reached_ms - motion.duration_ms
            pieces.append(actions_of(motion, arrival_ms))
            state = self._states[state[6]]
        actions = tuple(action for piece in reversed(pieces) for action in piece)
        return Leg(actions, configuration, end_ms)
