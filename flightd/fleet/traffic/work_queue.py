"""What is to be counted, by value, and who counts what: tours that fit a battery, split over the drones."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Final

from flightd.fleet.traffic.motions import NEVER

_VALUE_SPAN_MS: Final = 3_600_000
"""A class of value outweighs the way to it up to so long."""
_MOST_OF_TOUR: Final = 40
"""A drone is not given more nodes at a time."""
HOURS_UNKNOWN: Final = "the schedule is read anew"


class Value(IntEnum):
    """Why a place is to be counted; the higher, the sooner."""

    OLD = 1
    NEVER_COUNTED = 2
    CONTRADICTED = 3
    ASKED = 4


@dataclass(frozen=True, slots=True)
class NodeWork:
    """The places that are counted from one node, and how long that takes.  Of equal `value` the one with the
    greater `age_s` goes first.  Only that `drone` does it, if one is named.  Counted are these shelf `levels`
    (none: all); `run` is the schedule's run that alone asked for it, if one did."""

    node: str
    aisle: str
    index: int
    places: tuple[str, ...]
    dwell_ms: int
    value: Value = Value.NEVER_COUNTED
    age_s: float = 0.0
    drone: str = ""
    levels: tuple[int, ...] = ()
    run: str = ""

    def covers(self, other: NodeWork) -> bool:
        """Whether all levels of the other are counted with this."""
        return not self.levels or (bool(other.levels) and {*other.levels} <= {*self.levels})


@dataclass(frozen=True, slots=True)
class TourTimes:
    """What a tour takes: from the pad to the first node, from one node to another, from a node to a pad."""

    out_ms: Callable[[str], int]
    between_ms: Callable[[str, str], int]
    home_ms: Callable[[str], int]


@dataclass(frozen=True, slots=True)
class KeptWork:
    """All of a queue that outlives the process that has it: who was given what does not, for nobody knows
    whether he still does it."""

    work: tuple[NodeWork, ...]
    done: tuple[str, ...]
    reasons: Mapping[str, str]
    given_up: tuple[str, ...] = ()


class WorkQueue:
    """Nodes that wait, are given to a drone, are done, or cannot be done for a reason."""

    def __init__(self, work: Iterable[NodeWork]) -> None:
        self._work: dict[str, NodeWork] = {each.node: each for each in work}
        self._open: dict[str, None] = dict.fromkeys(self._work)
        self._given: dict[str, str] = {}
        self.done: list[str] = []
        self.reasons: dict[str, str] = {}
        self._given_up: set[str] = set()
        self._again: dict[str, NodeWork] = {}
        """What is to be counted where a drone counts less just now."""
        self.runs: Mapping[str, str] = {}
        """Of a schedule's run why none of its work is begun now; empty where it may be.  Of one that is not
        here none is."""

    @classmethod
    def of(cls, kept: KeptWork) -> WorkQueue:
        """Go on with it; what drones were given waits again."""
        queue = cls(kept.work)
        queue.done, queue.reasons = list(kept.done), dict(kept.reasons)
        queue._given_up = set(kept.given_up)
        for node in (*kept.done, *kept.reasons):
            queue._open.pop(node, None)
        return queue

    def kept(self) -> KeptWork:
        """As it is to be kept."""
        given_up = tuple(sorted(self._given_up))
        work = (_both(each, self._again.get(node)) for node, each in self._work.items())
        return KeptWork(tuple(work), tuple(self.done), dict(self.reasons), given_up)

    def work(self, node: str) -> NodeWork:
        """KeyError for a node without work."""
        return self._work[node]

    @property
    def open(self) -> tuple[str, ...]:
        """The nodes that wait for a drone."""
        return tuple(self._open)

    @property
    def ready(self) -> tuple[str, ...]:
        """Those that may be begun now."""
        return tuple(node for node in self.open if not self._held_for(self._work[node]))

    @property
    def held(self) -> dict[str, str]:
        """The nodes that wait for the hours of their schedule, and why."""
        return {node: why for node in self.open if (why := self._held_for(self._work[node]))}

    @property
    def runs_left(self) -> frozenset[str]:
        """The schedules' runs of which something waits, or is given."""
        runs = {self._work[node].run for node in (*self._open, *self._given)}
        return frozenset(runs - {""})

    def _held_for(self, work: NodeWork) -> str:
        """Why it is not begun now; empty where it may be."""
        return self.runs.get(work.run, HOURS_UNKNOWN) if work.run else ""

    def levels_of(self, node: str) -> tuple[int, ...]:
        """Which are counted there; none: all."""
        return self._work[node].levels if node in self._work else ()

    @property
    def given(self) -> Mapping[str, str]:
        """Node to drone."""
        return self._given

    def ask(self, work: Iterable[NodeWork]) -> None:
        """More of it, or again; what a drone has already stays with it, and what it does not count there
        waits again then.  Of what waits or is given, the higher value stays, of equal ones the drone that is
        named, and the levels of both."""
        for each in work:
            node = each.node
            waits = node in self._open or node in self._given
            known = self._work[node] if waits else None
            if known is not None and node in self._given and not known.covers(each):
                self._again[node] = _both(each, self._again.get(node))
                self._work[node] = replace(_both(each, known), levels=known.levels)
            else:
                self._work[node] = _both(each, known)
            self.reasons.pop(node, None)
            self._given_up.discard(node)
            if node in self.done:
                self.done.remove(node)
            if node not in self._given:
                self._open[node] = None

    def finish(self, node: str) -> None:
        """It is counted; nothing, of a node without work."""
        if node not in self._work:
            return
        self._given.pop(node, None)
        self._open.pop(node, None)
        self.reasons.pop(node, None)
        self._given_up.discard(node)
        if node not in self.done:
            self.done.append(node)
        if node in self._again:
            self.ask([self._again.pop(node)])

    def hand_back(self, nodes: Iterable[str], reason: str = "") -> None:
        """They wait again, or are not to be done, for a reason."""
        for node in nodes:
            self._given.pop(node, None)
            if node in self._again:
                self._work[node] = _both(self._again.pop(node), self._work[node])
            if reason:
                self._open.pop(node, None)
                self.reasons[node] = reason
            else:
                self._open[node] = None

    def give_up(self, node: str, reason: str) -> None:
        """It is not to be done, whatever becomes free, until it is asked for again."""
        self.hand_back([node], reason)
        self._given_up.add(node)

    def not_done_for(self, reason: str) -> list[str]:
        """The nodes that are not to be done for this reason."""
        return [node for node, why in self.reasons.items() if why == reason]

    def retry(self, nodes: Iterable[str]) -> None:
        """What was not to be done may be done now."""
        for node in nodes:
            if node not in self._given_up and self.reasons.pop(node, None) is not None:
                self._open[node] = None

    def take(self, drone: str, nodes: Iterable[str]) -> None:
        """Give nodes to a drone."""
        for node in nodes:
            self._open.pop(node)
            self._given[node] = drone

    def takes_ms(self, times: TourTimes, drone: str = "", without: Collection[str] = ()) -> int:
        """How long all that may be begun now, by this drone and `without` some, takes at least, the way out
        to each aisle with it."""
        aisles: dict[str, list[NodeWork]] = {}
        for node in self.ready:
            work = self._work[node]
            if node not in without and work.drone in {"", drone} and times.out_ms(node) < NEVER:
                aisles.setdefault(work.aisle, []).append(work)
        total_ms = 0
        for works in aisles.values():
            works.sort(key=lambda work: work.index)
            total_ms += min(times.out_ms(works[0].node), times.out_ms(works[-1].node))
            total_ms += sum(times.between_ms(a.node, b.node) for a, b in itertools.pairwise(works))
            total_ms += sum(work.dwell_ms for work in works)
        return total_ms

    def tour(
        self,
        times: TourTimes,
        budget_ms: int,
        busy_aisles: Collection[str] = (),
        share_ms: int | None = None,
        drone: str = "",
        without: Collection[str] = (),
    ) -> tuple[str, ...]:
        """The nodes of one tour of a drone within a budget, `without` some: first the most valuable aisle
        that nobody flies in, or that has work for this drone alone, from its nearer end on, then what lies
        nearest.  It takes as nearly `share_ms` as that gives, a node at least.  Empty where nothing fits."""
        aisles: dict[str, list[NodeWork]] = {}
        for node in self._open:
            work = self._work[node]
            if node in without or self._held_for(work):
                continue
            named = bool(drone) and work.drone == drone
            if named or (not work.drone and work.aisle not in busy_aisles):
                aisles.setdefault(work.aisle, []).append(work)
        ranked = sorted(aisles.values(), key=lambda works: self._rank(works, times))
        nodes: list[str] = []
        left_ms = budget_ms
        for works in ranked:
            if nodes:
                works.sort(key=lambda work: times.between_ms(nodes[-1], work.node))
                if times.between_ms(nodes[-1], works[0].node) > left_ms // 3:
                    break
            for work in self._swept(works, nodes, times):
                way_ms = times.between_ms(nodes[-1], work.node) if nodes else times.out_ms(work.node)
                fits = way_ms + work.dwell_ms + times.home_ms(work.node) <= left_ms
                with_ms = budget_ms - left_ms + way_ms + work.dwell_ms
                is_nearer = share_ms is None or abs(with_ms - share_ms) <= abs(budget_ms - left_ms - share_ms)
                if fits and (is_nearer or not nodes):
                    left_ms -= way_ms + work.dwell_ms
                    nodes.append(work.node)
                if nodes and (not fits or not is_nearer or len(nodes) >= _MOST_OF_TOUR):
                    return tuple(nodes)
        return tuple(nodes)

    @staticmethod
    def _rank(works: Sequence[NodeWork], times: TourTimes) -> tuple[float, float]:
        best = max(work.value for work in works)
        nearest_ms = min(times.out_ms(work.node) for work in works)
        return nearest_ms - best * _VALUE_SPAN_MS, -max(work.age_s for work in works)

    @staticmethod
    def _swept(works: Sequence[NodeWork], before: Sequence[str], times: TourTimes) -> list[NodeWork]:
        """One aisle from the end that is nearer; what is worth more in it is flown first."""
        ordered = sorted(works, key=lambda work: work.index)
        begin = (lambda node: times.between_ms(before[-1], node)) if before else times.out_ms
        if begin(ordered[-1].node) < begin(ordered[0].node):
            ordered.reverse()
        return sorted(ordered, key=lambda work: -work.value)


def _both(asked: NodeWork, known: NodeWork | None) -> NodeWork:
    """What is asked for, where something is to be done there already.  What somebody else asks for, too, is
    not bound to a run."""
    if known is None:
        return asked
    stays = (known.value, known.drone != "") > (asked.value, asked.drone != "")
    kept = known if stays else asked
    levels = {*known.levels, *asked.levels} if known.levels and asked.levels else ()
    return replace(kept, levels=tuple(sorted(levels)), run=kept.run if known.run and asked.run else "")
