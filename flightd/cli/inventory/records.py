"""What the inventory's commands have in common: the folder, and how locations are shown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import typer

from flightd.core.terminal_text import visible

if TYPE_CHECKING:
    from flightd.core.inventory import LocationRecord

Folder: TypeAlias = Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder of the inventory.")]
LeastConfidence: TypeAlias = Annotated[
    float, typer.Option(min=0, max=1, help="Values that are less sure (0..1) are unknown.")
]


def print_records(records: Sequence[LocationRecord]) -> None:
    """A line for each location."""
    for record in records:
        print(f"{record.code:<16} {record.state:<11}  {', '.join(map(visible, record.texts))}".rstrip())


def states_line(records: Sequence[LocationRecord]) -> str:
    """How many locations there are, and in which states."""
    states = Counter(record.state.value for record in records)
    return f"{len(records)} locations: " + ", ".join(f"{n} {state}" for state, n in states.most_common())
