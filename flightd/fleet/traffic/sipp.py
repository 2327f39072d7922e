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
        self._rest_ms = rest_ms
        self._goal = goal
        self._effort = effort
        self._states: list[_State] = []
        self._queue: list[tuple[int, int, int, int, int, int, int, Motion | None]] = []
        self._tie = 0
        self._weight = weight
        self._from_rest_ms = net.launch_ms + net.stop_ms if net.ramps_fit else 0
        self._from_move_ms = net.stop_ms
        self._below = net.lanes.vertices[goal.vertex].node
        self._vertices = net.lanes.vertices

    def run(self, configuration: int, at_ms: int) -> Iterator[Leg]:
        vertex = configuration >> 3
        if self._rest_ms[vertex] >= NEVER:
            return
        safe = _holding(self._table.free(vertex), at_ms)
        if safe is None:
            return
        self._push(configuration, at_ms, safe[1], -1, None)
        closed: dict[tuple[int, int], int] = {}
        passed: dict[int, list[Interval]] = {}
        done: set[int] = set()
        queue, states, take = self._queue, self._states, self._effort.take
        while queue:
            _, _, _, here, low, high, before, motion = heapq.heappop(queue)
            if here < 0:
                if high not in done:
                    done.add(high)
                    yield self._traced(before, low, motion)
                continue
            if not here & 1:
                if closed.get((here, high), NEVER) <= low:
                    continue
                closed[here, high] = low
            else:
                seen = passed.setdefault(here, [])
                if any(a <= low and high <= b for a, b in seen):
                    continue
                seen.append((low, high))
            if not take():
                return
            states.append((here, low, before, motion))
            number = len(states) - 1
            if not here & 1 and here >> 3 == self._goal.vertex:
                self._finish(here, low, high, number)
            for onward in self._net.onward(here):
                self._extend(onward, low, high, number)

    def _finish(self, here: int, low: int, high: int, number: int) -> None:
        """The goal is reached: what is done there, or staying."""
        goal = self._goal
        if goal.dwell_ms <= 0:
            if high >= NEVER:
                self._push(-1, low, high, number, None)
            return
        part = Part(Act.COUNT, goal.column, goal.vertex, 0, goal.dwell_ms)
        count = Motion(here, goal.dwell_ms, (part,))
        for first, last in self._departures(count.parts, 0, low, high):
            ends = first + goal.dwell_ms
            safe = _holding(self._table.free(goal.vertex), ends)
            if safe is not None and last >= first:
                self._push(-1, ends, safe[1], number, count)

    def _extend(self, motion: Motion, low: int, high: int, number: int) -> None:
        """Every safe arrival by one motion begun between `low` and `high`."""
        target, duration_ms, parts = motion.target, motion.duration_ms, motion.parts
        if self._rest_ms[target >> 3] >= NEVER:
            return
        if len(parts) == 1 and self._table.free(parts[0].resource) is ALWAYS:
            departures: Sequence[Interval] = ((low, high),)
        else:
            departures = self._departures(parts, 0, low, high)
        if target & 1:
            for first, last in departures:
                self._push(target, first + duration_ms, min(last + duration_ms, NEVER), number, motion)
            return
        free = self._table.free(target >> 3)
        reached = -1
        for first, _ in departures:
            arrival = first + duration_ms
            if arrival > reached:  # in the same safe interval the earlier arrival can wait
                safe = _holding(free, arrival)
                if safe is not None:
                    reached = safe[1]
                    self._push(target, arrival, reached, number, motion)

    def _departures(self, parts: Sequence[Part], i: int, low: int, high: int) -> list[Interval]:
        """The parts of low..high at which a motion may begin so that all it sweeps is free, rising."""
        part = parts[i]
        free = self._table.free(part.resource)
        found: list[Interval] = []
        for k in range(max(bisect_right(free, (low + part.in_ms, NEVER + 1)) - 1, 0), len(free)):
            starts, ends = free[k]
            if starts - part.in_ms > high:
                break
            first = max(low, starts - part.in_ms)
            last = high if ends >= NEVER else min(high, ends - part.out_ms)
            if first <= last:
                if i + 1 < len(parts):
                    found += self._departures(parts, i + 1, first, last)
                else:
                    found.append((first, last))
        return found

    def _push(self, configuration: int, low: int, high: int, before: int, motion: Motion | None) -> None:
        if configuration < 0:
            left_ms = 0
        else:
            left_ms = self._rest_ms[configuration >> 3]
            if configuration & 1:
                left_ms += self._from_move_ms
            elif self._vertices[configuration >> 3].node != self._below:
                left_ms += self._from_rest_ms
        self._tie += 1
        item = (low + int(self._weight * left_ms), -low, self._tie, configuration, low, high, before, motion)
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
