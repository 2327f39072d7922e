"""Columns of a table by the names in its first row."""

from __future__ import annotations

from flightd.core.errors import InputError
from flightd.inventory.stock_table import StockTable


def column(table: StockTable, name: str, key: str) -> int:
    """Which column is called so, whatever the case.  InputError, for the `key` that says the name, where none
    is or more are."""
    wanted = name.strip().casefold()
    heading = [cell.casefold() for cell in table.rows[0]]
    found = heading.count(wanted)
    if found != 1:
        there = f"has {found} columns" if found else "has no column"
        raise InputError(
            f"the first line {there} {name!r} (it says {', '.join(table.rows[0])})",
            remedy=f"correct {key}, or the file",
        )
    return heading.index(wanted)
