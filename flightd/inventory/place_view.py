"""What is shown of a place: the state that the inventory gives it, and what its looks say besides."""

from __future__ import annotations

import enum
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from flightd.core.inventory import LocationRecord, Observation, Standing
from flightd.core.told_codes import codes_of

Look: TypeAlias = tuple[Observation, Standing]


class ShownState(enum.StrEnum):
    """`LocationState`, and what only the looks that do not count can tell."""

    READ = "read"
    SEVERAL = "several"
    EMPTY = "empty"
    UNREADABLE = "unreadable"
    OCCLUDED = "occluded"
    CONTRADICTED = "contradicted"
    """Seen, and withdrawn: where the drone was, was contradicted.  No look counts yet."""
    NOT_VISITED = "not_visited"


@dataclass(frozen=True, slots=True)
class PlaceView:
    """One place.  `pending`: what is shown is not booked yet, the place of the look is not proven."""

    code: str
    state: ShownState
    texts: tuple[str, ...] = ()
    confidence: float | None = None
    pending: bool = False
    utc_ns: int = 0


def place_views(records: Sequence[LocationRecord], looks: Iterable[Look]) -> tuple[PlaceView, ...]:
    """Every place, in the order of `records`; `looks` are all looks, oldest first."""
    newest: defaultdict[str, dict[Standing, Observation]] = defaultdict(dict)
    for seen, standing in looks:
        newest[seen.location][standing] = seen
    return tuple(_view(record, newest[record.code]) for record in records)


def _view(record: LocationRecord, newest: dict[Standing, Observation]) -> PlaceView:
    booked, pending = record.observation, newest.get(Standing.PENDING)
    if pending is not None and (booked is None or pending.utc_ns > booked.utc_ns):
        return _of_look(pending, pending=True)
    if booked is not None:
        return _of_look(booked, pending=False)
    if Standing.WITHDRAWN in newest:
        return PlaceView(record.code, ShownState.CONTRADICTED, utc_ns=newest[Standing.WITHDRAWN].utc_ns)
    return PlaceView(record.code, ShownState.NOT_VISITED)


def _of_look(seen: Observation, *, pending: bool) -> PlaceView:
    texts = tuple(dict.fromkeys(read.text for read in seen.reads))
    return PlaceView(
        seen.location, ShownState(seen.state.value), texts, seen.confidence, pending, seen.utc_ns
    )


def view_of_told(told: dict[str, str]) -> PlaceView:
    """A place as a drone tells it over its ground link; one whose state is not known here is not visited."""
    try:
        state = ShownState(told.get("state", ""))
    except ValueError:
        state = ShownState.NOT_VISITED
    pending = told.get("standing") == "pending"
    return PlaceView(told.get("location", ""), state, codes_of(told), pending=pending)
