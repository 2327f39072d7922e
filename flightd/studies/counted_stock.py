"""What was counted on a flight, found beside its log."""

from __future__ import annotations

import sys
from collections.abc import Collection
from pathlib import Path

from flightd.adapters.store.for_reading import opened_for_reading
from flightd.core.errors import InputError, UnavailableError
from flightd.inventory.comparison import compare_stock
from flightd.inventory.expected_stock import read_stock, unknown_locations
from flightd.replay.report.stock import CountedStock


def counted_beside(
    log: Path, inventory: Path | None = None, expected: Path | None = None, *, untouched: bool = False
) -> CountedStock | None:
    """What was counted, for the report of `log`: the inventory in `inventory`, or beside the log if there
    is one; compared with an `expected` stock; `untouched` as `opened_for_reading` has it.  Raises InputError
    when what is asked for is missing; one that merely lies there and cannot be read is told and left out."""
    stock = read_stock(expected) if expected is not None else None
    folder = inventory or log.parent
    asked = inventory is not None or stock is not None
    if not asked and not (folder / "inventory.db").exists():
        return None
    try:
        with opened_for_reading(folder, untouched=untouched) as store:
            records, evidence = store.locations(), store.evidence
    except (InputError, UnavailableError) as err:
        if asked:
            raise
        print(f"flightd: {err}; the report shows the flight alone", file=sys.stderr)
        return None
    differences = compare_stock(records, stock) if stock is not None else None

    def picture(name: str) -> bytes | None:
        try:
            return evidence.path(name).read_bytes()
        except (OSError, ValueError):
            return None

    known = {record.code for record in records}
    return CountedStock(records, picture, differences, unknown=_unknown(expected, known))


def _unknown(expected: Path | None, known: Collection[str]) -> list[str]:
    """The locations of the books that the count does not know, each with its line."""
    if expected is None:
        return []
    places = unknown_locations(expected, known)
    return [f"{place.location} ({expected.name}, line {place.line})" for place in places]
