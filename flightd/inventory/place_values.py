"""What is known of the goods at a place beside their codes: derived from what was read there, never stored.

The elements of GS1 codes come first, printed text second.  Where sources contradict each other, or nothing
is as sure as is demanded, a value is unknown: never guessed, and never left out as if nothing had been there.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable

from flightd.core.inventory import LocationState, Observation
from flightd.core.label_values import (
    LEAST_CONFIDENCE,
    LEAST_TEXT_CONFIDENCE,
    LabelValue,
    PlaceValue,
    UnknownReason,
    ValueKind,
    ValueSource,
)
from flightd.core.types import CodeRead
from flightd.core.utc_time import utc_day
from flightd.vision.shelf.digital_link import elements_of
from flightd.vision.shelf.gs1_values import gs1_values


def place_values(
    seen: Observation | None, least_confidence: float = LEAST_CONFIDENCE
) -> tuple[PlaceValue, ...]:
    """The values of all that one look found, one for each kind that anything was read of, by kind."""
    if seen is None:
        return ()
    told = [value for read in seen.reads for value in _told(read, seen)]
    told += [value for value in seen.texts if value.source is ValueSource.TEXT]
    several = UnknownReason.SEVERAL if seen.state is LocationState.SEVERAL else UnknownReason.CONTRADICTING
    return _settled(told, least_confidence, several)


def code_values(
    read: CodeRead, seen: Observation, least_confidence: float = LEAST_CONFIDENCE
) -> tuple[PlaceValue, ...]:
    """The values that one code of a look tells of its own goods."""
    return _settled(_told(read, seen), least_confidence, UnknownReason.CONTRADICTING)


def _told(read: CodeRead, seen: Observation) -> tuple[LabelValue, ...]:
    return gs1_values(elements_of(read), seen.confidence, utc_day(seen.utc_ns))


def _settled(
    told: Iterable[LabelValue], least_confidence: float, differing: UnknownReason
) -> tuple[PlaceValue, ...]:
    by_kind: defaultdict[ValueKind, list[LabelValue]] = defaultdict(list)
    for value in told:
        by_kind[value.kind].append(value)
    return tuple(
        _of_kind(kind, by_kind[kind], least_confidence, differing) for kind in ValueKind if kind in by_kind
    )


def _is_sure(value: LabelValue, least_confidence: float) -> bool:
    """Nothing vouches for printed text, so more is demanded of it."""
    text = value.source is ValueSource.TEXT
    return value.confidence > 0.0 and value.confidence >= max(
        least_confidence, LEAST_TEXT_CONFIDENCE if text else 0.0
    )


def _of_kind(
    kind: ValueKind, told: list[LabelValue], least_confidence: float, differing: UnknownReason
) -> PlaceValue:
    sure = [value for value in told if _is_sure(value, least_confidence)]
    if not sure:
        return PlaceValue(kind, None, UnknownReason.UNSURE)
    if len({(value.value, value.unit) for value in sure}) > 1:
        codes = {(value.value, value.unit) for value in sure if value.source is ValueSource.GS1}
        return PlaceValue(kind, None, differing if len(codes) > 1 else UnknownReason.CONTRADICTING)
    return PlaceValue(kind, max(sure, key=lambda value: (value.source is ValueSource.GS1, value.confidence)))
