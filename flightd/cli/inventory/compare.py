"""`flightd inventory compare`: the count against the books."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flightd.cli.inventory.records import Folder
from flightd.cli.options import AsJson
from flightd.core.errors import InputError
from flightd.core.terminal_text import visible

if TYPE_CHECKING:
    from flightd.inventory.comparison import Difference


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("compare")(compare)


def compare(
    folder: Folder,
    expected: Annotated[
        Path, typer.Argument(metavar="EXPECTED", help="CSV with the columns location and code.")
    ],
    recount: Annotated[
        Path | None, typer.Option(metavar="F", help="Write a mission over the doubtful locations here.")
    ] = None,
    config: Annotated[
        Path | None, typer.Option(metavar="F", help="Configuration that the re-count mission follows.")
    ] = None,
    least_confidence: Annotated[
        float, typer.Option(min=0.0, max=1.0, help="Matches below are counted again.")
    ] = 0.5,
    as_json: AsJson = False,
) -> None:
    """Compare the count with the expected stock.

    EXPECTED has one line for each code; a location without a code must be empty.  Outcomes: match,
    missing, unexpected, moved, wrong, empty_but_expected, and uncounted where nobody could see.

    \b
    Examples:
      flightd inventory compare out/inventory stock.csv
      flightd inventory compare out/inventory stock.csv --recount recount.toml --config hall.toml
    """
    from flightd.adapters.store.for_reading import opened_for_reading
    from flightd.inventory.comparison import compare_stock, comparison_document, doubtful_locations
    from flightd.inventory.expected_stock import read_stock
    from flightd.inventory.recount import write_recount

    if (recount is None) != (config is None):
        raise InputError("give both, the mission needs a configuration", key="--recount and --config")
    stock = read_stock(expected)
    with opened_for_reading(folder) as store:
        records = store.locations()
    lines = compare_stock(records, stock)
    doubtful = doubtful_locations(lines, records, least_confidence)
    unreachable = write_recount(recount, config, doubtful, records) if recount and config else []
    if as_json:
        print(json.dumps(comparison_document(lines, doubtful, unreachable), indent=1, ensure_ascii=False))
        return
    _print(lines)
    if unreachable:
        print(f"no node known, not in the mission: {', '.join(unreachable)}")


def _print(lines: Sequence[Difference]) -> None:
    from flightd.inventory.comparison import ComparisonOutcome, outcome_counts

    for line in lines:
        if line.outcome is not ComparisonOutcome.MATCH:
            more = f" at {line.found_at}" if line.found_at else ""
            more += f": {visible(line.found)} is there" if line.found else ""
            print(f"{line.location:<16} {line.outcome.value:<18} {visible(line.text)}{more}")
    print(", ".join(f"{count} {outcome.value}" for outcome, count in outcome_counts(lines).items()))
