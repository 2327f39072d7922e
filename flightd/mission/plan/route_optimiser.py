"""In which order to visit: a directed travelling salesman over the wanted nodes, in seconds.

The way between two nodes and the turns where two ways meet both cost time, so that the cost of a stop
depends on the stop before it as well.  Tours are built by nearest neighbour and aisle by aisle, and improved
by moving chains of stops (Or-opt) and reversing them (2-opt), the best change first.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from flightd.mission.plan.flight_plan import HeadingPolicy
from flightd.mission.plan.leg_times import ANY_QUARTER, Legs, Pace, Travel, check_reach, to_quarter
from flightd.site.site import Site

Order: TypeAlias = NDArray[np.int64]
Rows: TypeAlias = NDArray[np.int64]

_CHAIN = 3
"""Longest chain of stops that is moved at once on large routes; short routes move any."""
_SMALL = 14
"""Up to so many stops every change is tried, from many beginnings."""
_NEAR = 10
"""On large routes a chain is moved only next to this many of the stops nearest to its ends."""
_KICKS = 40
_STEPS = 400
_TRIED = 6
_LEAST_S = 1e-9


@dataclass(frozen=True, slots=True)
class Tour:
    """A tour's nodes, its given ends included, and its seconds from the first heading on."""

    nodes: tuple[str, ...]
    seconds: float


def best_order(
    legs: Legs,
    visits: Sequence[str],
    start: str,
    home: str | None,
    start_quarter: int = ANY_QUARTER,
) -> Tour:
    """The order of `visits` (each once) from `start` to `home`, or to wherever it ends with None.

    NoWayError when closed lines keep one stop from another.  The same input gives the same order.
    """
    wanted = [node for node in dict.fromkeys(visits) if node not in {start, home}]
    ends = [start] if home in {None, start} else [start, str(home)]
    if len(wanted) > _SMALL:
        place = {node: i for i, node in enumerate(legs.sweep())}
        wanted.sort(key=lambda node: place.get(node, len(place)))
    travel = legs.travel([*ends, *wanted])
    check_reach(travel)
    problem = Problem(legs, travel, start_quarter, closed=home is not None, apart=len(ends) == 2)
    order = problem.solve()
    nodes = tuple(travel.nodes[i] for i in problem.stops(order))
    return Tour(nodes, problem.seconds(order))


def ordered_best(
    site: Site,
    visits: Sequence[str],
    ends: tuple[str, str],
    policy: HeadingPolicy,
    pace: Pace,
    start_yaw_rad: float,
) -> tuple[str, ...]:
    """The visits, each once, in the quickest order between the two ends.  NoWayError."""
    for node in visits:
        site.require(node)
    tour = best_order(Legs(site, policy, pace), visits, *ends, to_quarter(start_yaw_rad))
    return tuple(node for node in tour.nodes[:-1] if node in set(visits))


class Problem:
    """The search for one order.  Rows of `travel`: the start, the end when `apart` from it, the stops."""

    def __init__(self, legs: Legs, travel: Travel, start_quarter: int, *, closed: bool, apart: bool) -> None:
        n = len(travel.nodes)
        self._turn_s = legs.turn_s
        # the end is a row of its own: a copy of the start, the node apart, or nowhere (free to reach)
        self._time_s = np.zeros((n + 1, n + 1))
        self._departs = np.full((n + 1, n + 1), ANY_QUARTER)
        self._arrives = np.full((n + 1, n + 1), ANY_QUARTER)
        self._time_s[:n, :n] = travel.time_s
        self._departs[:n, :n], self._arrives[:n, :n] = travel.departs, travel.arrives
        self._end = n
        self._row_of_end = 1 if apart else 0 if closed else None
        if self._row_of_end is not None:
            self._time_s[:n, n] = travel.time_s[:, self._row_of_end]
            self._departs[:n, n] = travel.departs[:, self._row_of_end]
        self._first = 2 if apart else 1
        self._start_quarter = start_quarter
        stops = n - self._first
        self._small = stops <= _SMALL
        self._near = self._nearest(stops if self._small else min(_NEAR, stops))

    def stops(self, order: Order) -> list[int]:
        """The rows of `travel` in order, the real end included."""
        inner = [int(i) for i in order[:-1]]
        return inner if self._row_of_end is None else [*inner, self._row_of_end]

    def seconds(self, order: Order) -> float:
        """The whole tour's time: ways, and the turns between them."""
        return float(self._seconds(order[None, :])[0])

    def solve(self) -> Order:
        given = np.array([0, *range(self._first, self._end), self._end])
        if len(given) <= 3:
            return given
        tours = [given, self._by_nearest()]
        if not self._small:
            return self._improve(min(tours, key=self.seconds))
        best = min((self._improve(tour) for tour in tours), key=self.seconds)
        rng = random.Random(0)
        for _ in range(_KICKS):
            tour = self._improve(_kicked(_kicked(best, rng), rng))
            best = min((best, tour), key=self.seconds)
        return best

    def _seconds(self, orders: Rows) -> NDArray[np.float64]:
        """Times of many orders, one in each row."""
        a, b = orders[:, :-1], orders[:, 1:]
        departs, arrives = self._departs[a, b], self._arrives[a, b]
        turns = self._turn_s[arrives[:, :-1], departs[:, 1:]].sum(axis=1)
        first = self._turn_s[self._start_quarter, departs[:, 0]]
        total: NDArray[np.float64] = self._time_s[a, b].sum(axis=1) + turns + first
        return total

    def _nearest(self, count: int) -> Rows:
        """(rows, count): for each row the stops soonest reached from it."""
        time_s = self._time_s[: self._end, self._first : self._end].copy()
        rows = np.arange(self._first, self._end)
        time_s[rows, rows - self._first] = np.inf
        return np.argsort(time_s, axis=1, kind="stable")[:, :count] + self._first

    def _by_nearest(self) -> Order:
        """Always on to the stop soonest reached, turns included."""
        left = np.ones(self._end + 1, bool)
        left[: self._first] = False
        left[self._end] = False
        order, quarter = [0], self._start_quarter
        while left.any():
            here = order[-1]
            choices = np.flatnonzero(left)
            seconds = self._time_s[here, choices] + self._turn_s[quarter, self._departs[here, choices]]
            there = int(choices[np.argmin(seconds)])
            quarter = int(self._arrives[here, there])
            left[there] = False
            order.append(there)
        return np.array([*order, self._end])

    def _improve(self, order: Order) -> Order:
        """Make the best change again and again until none helps."""
        seconds = self.seconds(order)
        for _ in range(_STEPS):
            changed = np.array(list(self._changes(order)))
            if not len(changed):
                break
            times = self._seconds(changed)
            best = int(np.argmin(times))
            if times[best] > seconds - _LEAST_S:
                break
            order, seconds = changed[best], float(times[best])
        return order

    def _changes(self, order: Order) -> Iterator[Order]:
        """The most promising changed orders, by what their ends would cost."""
        moves = self._moves(order)
        gains = self._gains(order, moves)
        likely = np.argsort(gains, kind="stable")[: len(gains) if self._small else _TRIED]
        for i in likely:
            if self._small or gains[i] < -_LEAST_S:
                yield _moved(order, *(int(value) for value in moves[i]))

    def _moves(self, order: Order) -> Rows:
        """(moves, 4): a chain's first and last position, the position after which it goes, and whether it
        is reversed.  A chain that stays where it is, reversed, is a 2-opt change."""
        stops = len(order) - 2
        place = np.empty(self._end + 1, np.int64)
        place[order] = np.arange(len(order))
        found = []
        for length in range(1, (stops if self._small else min(_CHAIN, stops)) + 1):
            first = np.arange(1, stops - length + 2)
            last = first + length - 1
            if self._small:
                targets = np.broadcast_to(np.arange(0, stops + 1), (len(first), stops + 1))
            else:  # beside the stops that are near the chain's ends
                near_first, near_last = place[self._near[order[first]]], place[self._near[order[last]]]
                targets = np.concatenate([near_first, near_last - 1], axis=1)
            begin = np.repeat(first, targets.shape[1])
            end = np.repeat(last, targets.shape[1])
            after = targets.ravel()
            kept = (after < begin - 1) | (after > end)
            for reverse in (0, 1) if length > 1 else (0,):
                columns = (begin[kept], end[kept], after[kept], np.full(kept.sum(), reverse))
                found.append(np.stack(columns, axis=1))
        if self._small:
            begin, end = (index + 1 for index in np.triu_indices(stops, 1))
        else:  # what is then beside the stop before the chain, or the one behind it, is near it
            near = place[self._near[order[1:-1]]].ravel()
            here = np.repeat(np.arange(1, stops + 1), self._near.shape[1])
            begin, end = np.concatenate([[here + 1, near], [near, here - 1]], axis=1)
            begin, end = begin[begin < end], end[begin < end]
        found.append(np.stack([begin, end, begin - 1, np.ones_like(begin)], axis=1))
        return np.concatenate(found)

    def _gains(self, order: Order, moves: Rows) -> NDArray[np.float64]:
        """Change of the tour's time by each move, the turns at its ends and inside reversed chains included,
        but not what two of its ends do to each other when they are neighbours."""
        first, last, after, reverse = moves.T
        forward, backward = self._sums(order)
        begin, end = order[first], order[last]
        head, tail = np.where(reverse == 1, end, begin), np.where(reverse == 1, begin, end)
        inside = np.where(
            reverse == 1, backward[last] - backward[first] - forward[last] + forward[first], 0.0
        )
        before, behind = order[first - 1], order[last + 1]
        stays = after == first - 1
        left, right = np.where(stays, before, order[after]), np.where(stays, behind, order[after + 1])
        cut = self._time_s[before, begin] + self._time_s[end, behind]
        join = np.where(stays, 0.0, self._time_s[before, behind] - self._time_s[left, right])
        put = self._time_s[left, head] + self._time_s[tail, right]
        gains: NDArray[np.float64] = put - cut + join + inside
        return gains

    def _sums(self, order: Order) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Time from the tour's beginning to each position, forward and for the way back, turns included."""
        a, b = order[:-1], order[1:]
        forward, backward = self._time_s[a, b].copy(), self._time_s[b, a].copy()
        departs, arrives = self._departs[a, b], self._arrives[a, b]
        forward[1:] += self._turn_s[arrives[:-1], departs[1:]]
        departs, arrives = self._departs[b, a], self._arrives[b, a]
        backward[1:] += self._turn_s[arrives[1:], departs[:-1]]
        return np.concatenate([[0.0], np.cumsum(forward)]), np.concatenate([[0.0], np.cumsum(backward)])


def _moved(order: Order, first: int, last: int, after: int, reverse: int) -> Order:
    """The order with the chain first..last put after position `after`, reversed or not."""
    chain = order[first : last + 1]
    chain = chain[::-1] if reverse else chain
    if after < first:
        return np.concatenate([order[: after + 1], chain, order[after + 1 : first], order[last + 1 :]])
    return np.concatenate([order[:first], order[last + 1 : after + 1], chain, order[after + 1 :]])


def _kicked(order: Order, rng: random.Random) -> Order:
    """The order with two neighbouring chains exchanged (double bridge), to leave a local optimum."""
    stops = len(order) - 2
    cuts = sorted(rng.choices(range(1, stops + 2), k=3))
    a, b, c = cuts
    return np.concatenate([order[:a], order[b:c], order[a:b], order[c:]])
