"""What the inventory's commands have in common: the folder, and how locations are shown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, TypeAlias

import typer

from flightd.core.label_values import LEAST_CONFIDENCE, ValueKind
from flightd.core.terminal_text import visible

if TYPE_CHECKING:
    from flightd.core.inventory import LocationRecord, Observation

Folder: TypeAlias = Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder of the inventory.")]
LeastConfidence: TypeAlias = Annotated[
    float, typer.Option(min=0, max=1, help="Values that are less sure (0..1) are unknown.")
]

_SHOWN: Final = {ValueKind.LOT, ValueKind.BEST_BEFORE, ValueKind.EXPIRY}


def print_records(records: Sequence[LocationRecord], least_confidence: float = LEAST_CONFIDENCE) -> None:
    """A line for each location, with what is known of its goods."""
    for record in records:
        told = [", ".join(map(visible, record.texts)), *_known(record, least_confidence)]
        print(f"{record.code:<16} {record.state:<11}  {'  '.join(filter(None, told))}".rstrip())


def undecided_words(seen: Observation | None) -> Iterator[str]:
    """What stayed undecided beside the codes of a look."""
    for code in seen.undecided if seen else ():
        yield f"undecided {visible(str(code))}"


def _known(record: LocationRecord, least_confidence: float) -> Iterator[str]:
    """What stayed undecided, lot, expiry, how full the place is, and the cases in its front, as far as they
    are known."""
    from flightd.core.inventory import LocationState
    from flightd.inventory.place_values import place_values
    from flightd.replay.report.stock import fill_text

    seen = record.observation
    yield from undecided_words(seen)
    for stands in place_values(seen, least_confidence):
        if stands.kind in _SHOWN and stands.known is not None:
            yield f"{stands.kind} {visible(stands.known.text)}"
    fill = seen.fill if seen else None
    if fill and fill.share is not None and record.state is not LocationState.EMPTY:
        yield f"fill {fill_text(fill)}"
    if fill and (cases := fill.cases):
        yield f"cases {cases.columns} x {cases.rows}"
    if record.pallets_deep > 1:
        yield f"{record.pallets_seen} of {record.pallets_deep} pallets seen"


def states_line(records: Sequence[LocationRecord]) -> str:
    """How many locations there are, and in which states."""
    states = Counter(record.state.value for record in records)
    told = ", ".join(f"{n} {state}" for state, n in states.most_common())
    return f"{len(records)} locations: {told}" if told else "no locations"
