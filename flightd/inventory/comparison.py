"""The count against what the books say: every difference named, nothing called missing that nobody saw."""

from __future__ import annotations

import enum
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from flightd.core.inventory import KnownLocations, LocationRecord, LocationState
from flightd.vision.shelf.code_equality import code_key


class ComparisonOutcome(enum.StrEnum):
    """What became of one expected code, or what one code found means."""

    MATCH = "match"
    MISSING = "missing"
    """Its location was counted, and it is not found anywhere."""
    UNEXPECTED = "unexpected"
    """Found where nobody expects it, and not missed elsewhere."""
    MOVED = "moved"
    """Found at another location than the books say."""
    WRONG = "wrong"
    """Another code, that nobody expects anywhere, is in its place."""
    EMPTY_BUT_EXPECTED = "empty_but_expected"
    UNCOUNTED = "uncounted"
    """Its location was not visited, occluded or unreadable: nothing can be said."""


@dataclass(frozen=True, slots=True)
class Difference:
    """One line of the comparison.  `location` is where it must be put right: the expected one, or for an
    unexpected code where it is.  `found` is what lies there instead, `found_at` where a moved code is."""

    outcome: ComparisonOutcome
    location: str
    text: str
    found: str = ""
    found_at: str = ""
    confidence: float = 0.0


def compare_stock(
    records: Iterable[LocationRecord], expected: Mapping[str, Sequence[str]]
) -> tuple[Difference, ...]:
    """Every expected code and every code found, each with its one outcome, by location.

    `expected` gives the codes of each location; an empty list says that nothing may be there.  A location
    of the books that the count does not know is uncounted.  Codes are the same by `code_equality`, and told
    as the books write them; locations are the same whatever their case.
    """
    spellings: dict[str, str] = {}

    def spelled(texts: Iterable[str]) -> tuple[str, ...]:
        return tuple(dict.fromkeys(spellings.setdefault(code_key(text), text) for text in texts))

    known = {record.code: record for record in records}
    wanted: dict[str, frozenset[str]] = {}
    places_known = KnownLocations(known)
    for written, codes in expected.items():
        location = places_known.spelled(written)
        wanted[location] = wanted.get(location, frozenset()) | frozenset(spelled(codes))
    seen = {code: spelled(record.texts) for code, record in known.items()}
    places: defaultdict[str, list[str]] = defaultdict(list)
    for code, texts in seen.items():
        for text in texts:
            places[text].append(code)
    wanted_anywhere = frozenset(text for texts in wanted.values() for text in texts)
    lines: list[Difference] = []
    explained: set[tuple[str, str]] = set()
    for location in sorted(wanted):
        counted = known.get(location)
        unexpected = [t for t in seen.get(location, ()) if t not in wanted_anywhere]
        for text in sorted(wanted[location]):
            line = _expected_code(location, text, counted, unexpected, places[text], wanted, explained)
            explained |= {(line.location, text), (line.found_at, text), (location, line.found)}
            lines.append(line)
    lines += [
        Difference(ComparisonOutcome.UNEXPECTED, record.code, text, confidence=_confidence(record))
        for record in known.values()
        for text in seen[record.code]
        if (record.code, text) not in explained
    ]
    return tuple(sorted(lines, key=lambda line: (line.location, line.text)))


def _expected_code(
    location: str,
    text: str,
    record: LocationRecord | None,
    unexpected: list[str],
    places: Sequence[str],
    wanted: Mapping[str, frozenset[str]],
    explained: set[tuple[str, str]],
) -> Difference:
    confidence = _confidence(record) if record else 0.0
    if location in places:
        return Difference(ComparisonOutcome.MATCH, location, text, confidence=confidence)
    # each stray label explains one missing code, and never a label that belongs where it is
    strays = [p for p in places if text not in wanted.get(p, ()) and (p, text) not in explained]
    if strays:
        return Difference(ComparisonOutcome.MOVED, location, text, found_at=strays[0], confidence=confidence)
    if record is None or not record.state.is_counted:
        return Difference(ComparisonOutcome.UNCOUNTED, location, text, confidence=confidence)
    if record.state is LocationState.EMPTY:
        return Difference(ComparisonOutcome.EMPTY_BUT_EXPECTED, location, text, confidence=confidence)
    if unexpected:
        return Difference(
            ComparisonOutcome.WRONG, location, text, found=unexpected.pop(0), confidence=confidence
        )
    return Difference(ComparisonOutcome.MISSING, location, text, confidence=confidence)


def _confidence(record: LocationRecord) -> float:
    return record.observation.confidence if record.observation else 0.0


def comparison_document(
    lines: Sequence[Difference], doubtful: Mapping[str, str], without_node: Sequence[str]
) -> dict[str, object]:
    """The comparison as JSON has it; `without_node` are the doubtful locations that no mission reaches."""
    return {
        "outcomes": {outcome.value: count for outcome, count in outcome_counts(lines).items()},
        "lines": [
            {
                "outcome": line.outcome.value,
                "location": line.location,
                "text": line.text,
                "found": line.found,
                "found_at": line.found_at,
                "confidence": line.confidence,
            }
            for line in lines
        ],
        "recount": dict(doubtful),
        "recount_without_node": list(without_node),
    }


def outcome_counts(lines: Iterable[Difference]) -> dict[ComparisonOutcome, int]:
    """How many lines have each outcome, none left out."""
    counts = Counter(line.outcome for line in lines)
    return {outcome: counts[outcome] for outcome in ComparisonOutcome}


def doubtful_locations(
    lines: Iterable[Difference], records: Iterable[LocationRecord], least_confidence: float
) -> dict[str, str]:
    """The locations that must be counted again, each with its reason, in the order of their codes.

    Those of every difference (both ends of a moved code), those that were not counted at all, and matches
    seen with less than `least_confidence`.
    """
    reasons: dict[str, str] = {}
    for line in lines:
        if line.outcome is ComparisonOutcome.MATCH:
            if line.confidence < least_confidence:
                reasons.setdefault(line.location, f"confidence {line.confidence:.2f}")
            continue
        reasons.setdefault(line.location, line.outcome.value)
        if line.found_at:
            reasons.setdefault(line.found_at, line.outcome.value)
    for record in records:
        if not record.state.is_counted:
            reasons.setdefault(record.code, record.state.value)
    return dict(sorted(reasons.items()))
