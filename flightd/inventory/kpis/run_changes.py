"""What changed between two runs, place by place; of what one of them could not see, nothing is said."""

from __future__ import annotations

import enum
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass

from flightd.core.inventory import Observation
from flightd.vision.shelf.code_equality import code_key


class ChangeKind(enum.StrEnum):
    """What became of a place that both runs counted, or that one of them could not."""

    SAME = "same"
    FILLED = "filled"
    EMPTIED = "emptied"
    REPLACED = "replaced"
    """Other codes than before."""
    UNKNOWN = "unknown"
    """One of both runs did not see what is there."""


@dataclass(frozen=True, slots=True)
class PlaceChange:
    """`before` and `after` are the codes; `moved_from` and `moved_to` say where else a code of this place was
    before, or is now, by its text."""

    location: str
    kind: ChangeKind
    before: tuple[str, ...] = ()
    after: tuple[str, ...] = ()
    moved_from: tuple[tuple[str, str], ...] = ()
    moved_to: tuple[tuple[str, str], ...] = ()


def run_changes(
    earlier: Mapping[str, Observation], later: Mapping[str, Observation]
) -> tuple[PlaceChange, ...]:
    """Every place that a run looked at, by its code.  A code has moved where it is gone from one place and
    came to exactly one other."""
    places = sorted(earlier.keys() | later.keys())
    plain = {place: _plain_change(place, earlier.get(place), later.get(place)) for place in places}
    gone: defaultdict[str, list[str]] = defaultdict(list)
    come: defaultdict[str, list[str]] = defaultdict(list)
    for change in plain.values():
        if change.kind is not ChangeKind.UNKNOWN:
            before, after = _keys(change.before), _keys(change.after)
            for key in before.keys() - after.keys():
                gone[key].append(change.location)
            for key in after.keys() - before.keys():
                come[key].append(change.location)
    return tuple(_with_ways(change, gone, come) for change in plain.values())


def _plain_change(place: str, before: Observation | None, after: Observation | None) -> PlaceChange:
    was, now = _texts(before), _texts(after)
    if before is None or after is None or not (before.state.is_counted and after.state.is_counted):
        kind = ChangeKind.UNKNOWN
    elif _keys(was).keys() == _keys(now).keys():
        kind = ChangeKind.SAME
    elif not was:
        kind = ChangeKind.FILLED
    else:
        kind = ChangeKind.REPLACED if now else ChangeKind.EMPTIED
    return PlaceChange(place, kind, was, now)


def _with_ways(
    change: PlaceChange, gone: Mapping[str, list[str]], come: Mapping[str, list[str]]
) -> PlaceChange:
    here = change.location

    def ways(texts: tuple[str, ...], ends: Mapping[str, list[str]], others: Mapping[str, list[str]]) -> Ways:
        return tuple(
            (text, others[key][0])
            for key, text in _keys(texts).items()
            if ends.get(key) == [here] and len(others.get(key, ())) == 1
        )

    moved_to, moved_from = ways(change.before, gone, come), ways(change.after, come, gone)
    return PlaceChange(here, change.kind, change.before, change.after, moved_from, moved_to)


Ways = tuple[tuple[str, str], ...]
"""Codes, each with the other place."""


def _texts(seen: Observation | None) -> tuple[str, ...]:
    return tuple(dict.fromkeys(read.text for read in seen.reads)) if seen else ()


def _keys(texts: tuple[str, ...]) -> dict[str, str]:
    return {code_key(text): text for text in texts}
