"""What was counted on a flight, as the report shows it: the records and the figures people judge them by."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from flightd.core.inventory import LocationRecord, LocationState
from flightd.inventory.comparison import ComparisonOutcome, Difference
from flightd.replay.report.figures import Figure
from flightd.replay.report.markup import number

SETTLED = frozenset({ComparisonOutcome.MATCH, ComparisonOutcome.UNCOUNTED})
"""Outcomes that are no difference: as the books say, or nobody could see."""


def no_picture(_name: str) -> bytes | None:
    """For a count without pictures."""
    return None


@dataclass(frozen=True, slots=True)
class CountedStock:
    """Every location as it stands, the evidence picture (JPEG) of a name, and the comparison with the
    expected stock (None where there was none to compare with)."""

    records: Sequence[LocationRecord]
    picture: Callable[[str], bytes | None] = no_picture
    differences: Sequence[Difference] | None = None

    def states(self) -> Counter[LocationState]:
        return Counter(record.state for record in self.records)

    def outcomes(self) -> dict[str, ComparisonOutcome]:
        """The worst that the comparison says of each location, where it says more than a match."""
        found: dict[str, ComparisonOutcome] = {}
        for line in self.differences or ():
            if line.outcome not in SETTLED:
                found.setdefault(line.location, line.outcome)
                if line.found_at:
                    found.setdefault(line.found_at, line.outcome)
        return found


def count_figures(count: CountedStock, flight_s: float | None) -> tuple[Figure, ...]:
    """Coverage, read rate, pace, confidence and agreement with the books, as far as they can be given.

    `flight_s` is the time in the air, for the pace of the newest run alone.
    """
    made = (
        _coverage(count),
        _read_rate(count),
        _pace(count, flight_s),
        _confidence(count),
        _books(count),
    )
    return tuple(figure for figure in made if figure is not None)


def percent(part: int, whole: int) -> str:
    """A share that is never rounded up to all or down to nothing."""
    share = 100.0 * part / whole
    shown = math.floor(share * 10) / 10
    return number(max(shown, 0.1) if part else 0.0, 1)


def _coverage(count: CountedStock) -> Figure:
    states, whole = count.states(), len(count.records)
    looked = whole - states[LocationState.NOT_VISITED]
    if not whole:
        return Figure("Coverage", "0", "locations", "none is planned", "bad")
    note = f"{looked:,} of {whole:,} locations looked at"
    return Figure("Coverage", percent(looked, whole), "%", note, "good" if looked == whole else "bad")


def _read_rate(count: CountedStock) -> Figure | None:
    states = count.states()
    read = states[LocationState.READ] + states[LocationState.SEVERAL]
    labels = read + states[LocationState.UNREADABLE]
    if not labels:
        return None
    return Figure("Read rate", percent(read, labels), "%", f"{read:,} of {labels:,} labels seen")


def _pace(count: CountedStock, flight_s: float | None) -> Figure | None:
    seen = [record.observation for record in count.records if record.observation]
    if not seen or not flight_s:
        return None
    run = max(seen, key=lambda look: look.utc_ns).run
    looked = sum(look.run == run for look in seen)
    note = f"{looked:,} in {number(flight_s / 60, 1)} min of flight"
    return Figure("Pace", f"{looked * 3600 / flight_s:,.0f}", "locations/h", note)


def _confidence(count: CountedStock) -> Figure | None:
    sure = [
        (record.observation.confidence, record.code)
        for record in count.records
        if record.observation and record.state.is_counted
    ]
    if not sure:
        return None
    mean = sum(confidence for confidence, _ in sure) / len(sure)
    least, where = min(sure)
    shown = math.floor(mean * 1000) / 10
    return Figure("Confidence", number(shown, 1), "%", f"least {least:.0%} at {where}")


def _books(count: CountedStock) -> Figure | None:
    if count.differences is None:
        return None
    wrong = sum(line.outcome not in SETTLED for line in count.differences)
    matches = sum(line.outcome is ComparisonOutcome.MATCH for line in count.differences)
    unknown = sum(line.outcome is ComparisonOutcome.UNCOUNTED for line in count.differences)
    note = f"{matches:,} as expected" + (f", {unknown:,} not countable" if unknown else "")
    return Figure("Differences", f"{wrong:,}", "to the books", note, "bad" if wrong else "good")
