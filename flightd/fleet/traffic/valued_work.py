"""What is worth most to be counted next: the nodes of a floor by what is known of their places."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from flightd.fleet.traffic.work_queue import NodeWork, Value


@dataclass(frozen=True, slots=True)
class PlaceFacts:
    """Of one place: the node from which it is counted, how long ago that was done (None: nobody knows what
    lies there), whether what was found is not what the books say, and whether somebody asks for it."""

    node: str
    age_s: float | None
    contradicted: bool = False
    asked: bool = False


@dataclass(frozen=True, slots=True)
class Worth:
    """Why a node is to be counted, and how old the oldest count of its places is."""

    value: Value
    age_s: float = 0.0

    @property
    def order(self) -> tuple[int, float]:
        """The greater, the sooner."""
        return self.value, self.age_s


UNKNOWN = Worth(Value.NEVER_COUNTED)
"""Of a node of which no place is known."""


def worth_of(places: Iterable[PlaceFacts]) -> dict[str, Worth]:
    """Each node is worth what its most valuable place is."""
    found: dict[str, Worth] = {}
    for place in places:
        value = Value.OLD if place.age_s is not None else Value.NEVER_COUNTED
        if place.contradicted:
            value = Value.CONTRADICTED
        if place.asked:
            value = Value.ASKED
        age_s = place.age_s or 0.0
        known = found.get(place.node)
        if known is not None:
            value, age_s = max(value, known.value), max(age_s, known.age_s)
        found[place.node] = Worth(value, age_s)
    return found


def most_valuable(
    work: Sequence[NodeWork], nodes: int | None = None, aisles: int | None = None
) -> tuple[NodeWork, ...]:
    """Of this work the so many most valuable `nodes`, or all of the so many `aisles` in which the most
    valuable lie; all of it where neither is said.  Of equal ones those that come first."""
    ranked = sorted(work, key=lambda one: (-one.value, -one.age_s))
    if aisles is not None:
        kept = list(dict.fromkeys(one.aisle for one in ranked))[:aisles]
        ranked = [one for one in ranked if one.aisle in kept]
    return tuple(ranked[:nodes])
