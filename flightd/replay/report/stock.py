"""What was counted on a flight, as the report shows it: the records and the figures people judge them by."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from flightd.core.inventory import LocationRecord, LocationState, Observation, PlaceFill, UndecidedCode
from flightd.inventory.comparison import ComparisonOutcome, Difference
from flightd.replay.report.figures import Figure
from flightd.replay.report.markup import number

SETTLED = frozenset({ComparisonOutcome.MATCH, ComparisonOutcome.UNCOUNTED})
"""Outcomes that are no difference: as the books say, or nobody could see."""


def no_picture(_name: str) -> bytes | None:
    """For a count without pictures."""
    return None


@dataclass(frozen=True, slots=True)
class CountTask:
    """What a flight was to count: the locations of its `nodes` (none: all there are), as part of the count
    `run` (empty: any look at them is one of it)."""

    nodes: frozenset[str] = frozenset()
    run: str = ""

    def includes(self, record: LocationRecord) -> bool:
        return not self.nodes or record.node in self.nodes

    def look(self, record: LocationRecord) -> Observation | None:
        """The look of this count at a location, None where the newest is another's."""
        seen = record.observation
        return seen if seen is not None and self.run in {"", seen.run} else None


WHOLE = CountTask()
"""Everything, by whatever look."""


@dataclass(frozen=True, slots=True)
class CountedStock:
    """Every location as it stands, the evidence picture (JPEG) of a name, and the comparison with the
    expected stock (None where there was none to compare with), which names `unknown` locations, too (each
    with the line of its file)."""

    records: Sequence[LocationRecord]
    picture: Callable[[str], bytes | None] = no_picture
    differences: Sequence[Difference] | None = None
    task: CountTask = WHOLE
    unknown: Sequence[str] = ()

    @property
    def asked(self) -> list[LocationRecord]:
        """The locations that the flight was to count."""
        return [record for record in self.records if self.task.includes(record)]

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
    """Coverage, places settled, read rate, pace, confidence and agreement with the books, as far as they can
    be given.

    `flight_s` is the time in the air, for the pace of the newest run alone.
    """
    made = (
        _coverage(count),
        _settled(count),
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


def share(value: float) -> str:
    """A confidence, 0 to 1, in per cent, never rounded up."""
    return f"{number(math.floor(value * 1000 + _ROUNDING) / 10, 1)} %"


def fill_text(fill: PlaceFill | None) -> str:
    """How full a place is, for people; an empty text where it was not asked."""
    if fill is None:
        return ""
    if fill.share is None:
        return "unknown"
    out = f", {100.0 * fill.overhang_m:.0f} cm over the rack's face" if fill.overhang_m else ""
    aside = f", leans by {100.0 * fill.lean_m:.0f} cm" if fill.lean_m and fill.lean_m >= _LEANS_M else ""
    return f"{100.0 * fill.share:.0f} %{out}{aside}"


def cases_text(fill: PlaceFill | None) -> str:
    """The cases that are seen in the front, for people; an empty text where they are not known."""
    cases = fill.cases if fill else None
    return f"{cases.count} ({cases.columns} by {cases.rows}) in the front" if cases else ""


def undecided_text(codes: Sequence[UndecidedCode]) -> str:
    """What was read beside the codes and does not count, for people; an empty text where nothing was."""
    return ", ".join(map(str, codes))


_LEANS_M = 0.02
"""Goods that lean less are not said to lean: it is measured to about a centimetre."""
_ROUNDING = 1e-9
"""0.29 * 1000 is a little less than 290."""


def _coverage(count: CountedStock) -> Figure:
    """How much of what was asked for was looked at: a flight over two nodes is no bad flight over eight."""
    asked, whole = count.asked, len(count.records)
    if not whole:
        return Figure("Coverage", "0", "locations", "none is planned", "bad")
    if not asked:
        return Figure("Coverage", "0", "locations", "none at the nodes of this flight")
    looked = sum(count.task.look(record) is not None for record in asked)
    note = f"{looked:,} of {len(asked):,} locations looked at"
    earlier = sum(record.observation is not None for record in asked) - looked
    note += f", {earlier:,} known from other counts" if earlier else ""
    note += f"; {whole - len(asked):,} at other nodes" if len(asked) < whole else ""
    return Figure(
        "Coverage", percent(looked, len(asked)), "%", note, "good" if looked == len(asked) else "bad"
    )


def _settled(count: CountedStock) -> Figure | None:
    """How much of what was looked at says what is there.  What cannot be read is no label that was missed:
    goods without one and places in doubt are `unreadable`, too."""
    looked = [record for record in count.asked if count.task.look(record)]
    if not looked:
        return None
    settled = sum(record.state.is_counted for record in looked)
    states = Counter(record.state for record in looked)
    open_ = [
        f"{states[state]:,} {state.value}"
        for state in (LocationState.UNREADABLE, LocationState.OCCLUDED)
        if states[state]
    ]
    note = ", ".join([f"{settled:,} of {len(looked):,} places", *open_])
    return Figure("Places settled", percent(settled, len(looked)), "%", note)


def _read_rate(count: CountedStock) -> Figure | None:
    """Of the labels that the books have in the places looked at, how many were read; without the ones whose
    place was counted and has another code or none, for nobody saw them.  Without the books nobody knows how
    many labels there are."""
    seen = {record.code for record in count.asked if count.task.look(record)}
    labels = [line for line in count.differences or () if line.location in seen and line.outcome in _THERE]
    if not labels:
        return None
    read = sum(line.outcome in _FOUND for line in labels)
    note = f"{read:,} of {len(labels):,} labels of the books"
    return Figure("Read rate", percent(read, len(labels)), "%", note)


_FOUND = frozenset({ComparisonOutcome.MATCH, ComparisonOutcome.MOVED})
_THERE = _FOUND | {ComparisonOutcome.UNCOUNTED}


def _pace(count: CountedStock, flight_s: float | None) -> Figure | None:
    seen = [record.observation for record in count.records if record.observation]
    if not seen or not flight_s:
        return None
    run = count.task.run or max(seen, key=lambda look: look.utc_ns).run
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
    value, unit = share(mean).split(" ")
    return Figure("Confidence", value, unit, f"least {share(least)} at {where}")


def _books(count: CountedStock) -> Figure | None:
    if count.differences is None:
        return None
    wrong = sum(line.outcome not in SETTLED for line in count.differences)
    matches = sum(line.outcome is ComparisonOutcome.MATCH for line in count.differences)
    unknown = sum(line.outcome is ComparisonOutcome.UNCOUNTED for line in count.differences)
    note = f"{matches:,} as expected" + (f", {unknown:,} not countable" if unknown else "")
    return Figure("Differences", f"{wrong:,}", "to the books", note, "bad" if wrong else "good")
