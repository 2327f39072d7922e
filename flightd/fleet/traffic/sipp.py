"""Safe-interval path planning: the earliest way of one drone between the reservations of all others.

M. Phillips and M. Likhachev, "SIPP: Safe Interval Path Planning for Dynamic Environments", ICRA 2011.  A
drone at cruising speed cannot wait, so that an early arrival there is not better than a late one: such
states keep the interval of all their possible arrivals, as in Z. Ali and K. Yakovlev, "Safe Interval Path
Planning with Kinodynamic Constraints" (SIPP-IP), AAAI 2023.  Both together are complete and optimal over
the motions.
"""

from __future__ import annotations

import heapq
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from flightd.fleet.traffic.distances import Distances
from flightd.fleet.traffic.motions import NEVER, Act, Motion, MotionNet, Part
from flightd.fleet.traffic.plan import Action, Stop, actions_of
from flightd.fleet.traffic.reservations import ALWAYS, Interval, ReservationTable

_State: TypeAlias = tuple[int, int, int, Motion | None]
"""Configuration, earliest arrival, number of the state before (-1: the start), motion from there."""
_Queued: TypeAlias = tuple[int, int, int, int, int, int, int, Motion | None]


@dataclass(frozen=True, slots=True)
class Leg:
    """The way to one goal: its actions, and the configuration and time at their end."""

    actions: tuple[Action, ...]
    configuration: int
    end_ms: int


class Effort:
    """How many states may still be expanded, over several searches."""

    def __init__(self, most: int) -> None:
        self.left = most
        self.spent = 0

    def take(self) -> bool:
        """One more; False when there is none left."""
        if self.left <= 0:
            return False
        self.left -= 1
        self.spent += 1
        return True


class Sipp:
    """Searches over one net of motions and one table of reservations."""

    def __init__(
        self, net: MotionNet, distances: Distances, table: ReservationTable, weight: float = 1.0
    ) -> None:
        self._net = net
        self._weight = weight
        self._distances = distances
        self._table = table

    def legs(self, configuration: int, at_ms: int, goal: Stop, effort: Effort) -> Iterator[Leg]:
        """Ways from rest at `at_ms` to the goal, done there, the earliest first: one for each safe interval
        in which it ends.  A goal without dwelling is one to stay at for good."""
        rest_ms = self._distances.to(goal.vertex)
        search = _Search(self._net, self._table, rest_ms, goal, effort, self._weight)
        yield from search.run(configuration, at_ms)


class _Search:
    """One search.  In the queue are (estimate, -arrival, tie, configuration, earliest, latest, state before,
    motion); configuration -1 is the goal, done."""

    def __init__(
        self,
        net: MotionNet,
        table: ReservationTable,
        rest_ms: Sequence[int],
        goal: Stop,
        effort: Effort,
        weight: float,
    ) -> None:
        self._net = net
        self._table = table
        self._goal = goal
        self._effort = effort
        self._states: list[_State] = []
        self._queue: list[_Queued] = []
        self._tie = 0
        self._best: dict[tuple[int, int], int] = {}
        self._left_ms = _estimates(net, rest_ms, goal.vertex, weight)

    def run(self, configuration: int, at_ms: int) -> Iterator[Leg]:
        safe = _holding(self._table.free(configuration >> 3), at_ms)
        if safe is None or self._left_ms[0][configuration >> 3] >= NEVER:
            return
        self._arrive(configuration, at_ms, safe[1], -1, None)
        passed: dict[int, list[Interval]] = {}
        done: set[int] = set()
        goal_vertex = self._goal.vertex
        queue, states, best, take = self._queue, self._states, self._best, self._effort.take
        while queue:
            _, _, _, here, low, high, before, motion = heapq.heappop(queue)
            if here < 0:
                if high not in done:
                    done.add(high)
                    yield self._traced(before, low, motion)
                continue
            if here & 1:
                seen = passed.setdefault(here, [])
                if any(a <= low and high <= b for a, b in seen):
                    continue
                seen.append((low, high))
            elif best[here, high] < low:  # reached sooner since
                continue
            if not take():
                return
            states.append((here, low, before, motion))
            if here >> 3 == goal_vertex and not here & 1:
                self._finish(here, low, high)
            self._expand(here, low, high)

    def _finish(self, here: int, low: int, high: int) -> None:
        """The goal is reached: what is done there, or staying."""
        goal = self._goal
        if goal.dwell_ms <= 0:
            if high >= NEVER:
                self._push(low, -1, low, high, None)
            return
        part = Part(Act.COUNT, goal.column, goal.vertex, 0, goal.dwell_ms)
        count = Motion(here, goal.dwell_ms, (part,))
        for first, _ in self._departures(count.parts, 0, low, high):
            ends = first + goal.dwell_ms
            safe = _holding(self._table.free(goal.vertex), ends)
            if safe is not None:
                self._push(ends, -1, ends, safe[1], count)

    def _expand(self, here: int, low: int, high: int) -> None:
        """Every safe arrival by the motions that begin here between `low` and `high`."""
        free_of = self._table.free
        at_rest_ms, moving_ms = self._left_ms
        for motion in self._net.onward(here):
            target, duration_ms = motion.target, motion.duration_ms
            vertex = target >> 3
            if at_rest_ms[vertex] >= NEVER:
                continue
            free = free_of(motion.parts[0].resource)
            departures: Sequence[Interval]
            if free is ALWAYS and len(motion.parts) == 1:
                departures = ((low, high),)
            else:
                departures = self._departures(motion.parts, 0, low, high)
            if target & 1:
                left_ms = moving_ms[vertex]
                for first, last in departures:
                    arrival = first + duration_ms
                    latest = min(last + duration_ms, NEVER)
                    self._push(arrival + left_ms, target, arrival, latest, motion)
            elif departures:
                self._rest(target, departures, motion)

    def _rest(self, target: int, departures: Sequence[Interval], motion: Motion) -> None:
        """Arrive at rest: in one safe interval only the earliest arrival matters, for it can wait."""
        free = self._table.free(target >> 3)
        reached = -1
        for first, _ in departures:
            arrival = first + motion.duration_ms
            if arrival > reached:
                safe = _holding(free, arrival)
                if safe is not None:
                    reached = safe[1]
                    self._arrive(target, arrival, reached, len(self._states) - 1, motion)

    def _arrive(self, target: int, arrival: int, until: int, before: int, motion: Motion | None) -> None:
        key = target, until
        if self._best.get(key, NEVER) <= arrival:
            return
        self._best[key] = arrival
        left_ms = self._left_ms[0][target >> 3]
        self._tie += 1
        item = (arrival + left_ms, -arrival, self._tie, target, arrival, until, before, motion)
        heapq.heappush(self._queue, item)

    def _departures(self, parts: Sequence[Part], i: int, low: int, high: int) -> list[Interval]:
        """The parts of low..high at which a motion may begin so that all it sweeps is free, rising."""
        part = parts[i]
        in_ms, out_ms = part.in_ms, part.out_ms
        free = self._table.free(part.resource)
        found: list[Interval] = []
        k = bisect_right(free, (low + in_ms, NEVER + 1)) - 1 if len(free) > 4 else 0
        for starts, ends in free[k:] if k > 0 else free:
            first = starts - in_ms
            if first > high:
                break
            first = max(first, low)
            last = high if ends >= NEVER else min(high, ends - out_ms)
            if first <= last:
                if i + 1 < len(parts):
                    found += self._departures(parts, i + 1, first, last)
                else:
                    found.append((first, last))
        return found

    def _push(self, estimate: int, configuration: int, low: int, high: int, motion: Motion | None) -> None:
        self._tie += 1
        item = (estimate, -low, self._tie, configuration, low, high, len(self._states) - 1, motion)
        heapq.heappush(self._queue, item)

    def _traced(self, number: int, end_ms: int, last: Motion | None) -> Leg:
        """The actions to a state at which the goal was done at `end_ms`."""
        pieces: list[list[Action]] = []
        state = self._states[number]
        arrival_ms = end_ms
        configuration = state[0]
        if last is not None:
            arrival_ms = end_ms - last.duration_ms
            pieces.append(actions_of(last, arrival_ms))
        # who stands may have come as early as can be; who moves came just when the next motion began
        while state[3] is not None:
            moved = state[0] & 1
            reached_ms = arrival_ms if moved else state[1]
            motion = state[3]
            arrival_ms = reached_ms - motion.duration_ms
            pieces.append(actions_of(motion, arrival_ms))
            state = self._states[state[2]]
        actions = tuple(action for piece in reversed(pieces) for action in piece)
        return Leg(actions, configuration, end_ms)


def _holding(free: Sequence[Interval], at_ms: int) -> Interval | None:
    """The safe interval around a time."""
    k = bisect_right(free, (at_ms, NEVER + 1)) - 1
    if k >= 0 and free[k][1] >= at_ms:
        return free[k]
    return None


def _estimates(
    net: MotionNet, rest_ms: Sequence[int], goal: int, weight: float
) -> tuple[list[int], list[int]]:
    """What is left from each vertex, at rest and moving, times `weight`; a stop and a launch are sure where
    the goal is over another node."""
    vertices = net.lanes.vertices
    below = vertices[goal].node
    stop_ms = net.stop_ms if net.ramps_fit else 0
    both_ms = net.launch_ms + net.stop_ms if net.ramps_fit else 0
    resting = [
        NEVER if left >= NEVER else int(weight * (left if vertex.node == below else left + both_ms))
        for left, vertex in zip(rest_ms, vertices, strict=True)
    ]
    moving = [NEVER if left >= NEVER else int(weight * (left + stop_ms)) for left in rest_ms]
    return resting, moving
