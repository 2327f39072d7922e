"""The expected stock of an uploaded table: what the books say lies where, and what in them cannot be used."""

from __future__ import annotations

import re
from dataclasses import dataclass

from flightd.inventory.stock_columns import StockColumns
from flightd.inventory.stock_table import StockTable, is_rounded
from flightd.vision.shelf.code_equality import code_key

_ZERO = re.compile(r"[0.,' ]*0[0.,' ]*")
_NUMBER = re.compile(r"[\d.,' ]*\d[\d.,' ]*")


@dataclass(frozen=True, slots=True)
class UploadedStock:
    """`expected` as `compare_stock` takes it, `quantities` by place and code however they are written, and
    one line for each row that was left out."""

    expected: dict[str, list[str]]
    quantities: dict[tuple[str, str], str]
    problems: tuple[str, ...]
    rows: int

    def quantity(self, place: str, code: str) -> str:
        """As the books write it; empty where they do not say."""
        return self.quantities.get((place.casefold(), code_key(code)), "")


def uploaded_stock(table: StockTable, columns: StockColumns) -> UploadedStock:
    """A code is expected at its place unless its quantity is zero; a place without a code must be empty.

    How many there are is not counted by a label: a quantity is shown, and compared with nothing.
    """
    columns.checked(table)
    expected: dict[str, list[str]] = {}
    quantities: dict[tuple[str, str], str] = {}
    problems: list[str] = []
    first = 1 if columns.heading else 0
    for number, row in zip(table.numbers[first:], table.rows[first:], strict=True):
        place, code = row[columns.place], row[columns.code]
        quantity = "" if columns.quantity is None else row[columns.quantity]
        problem = _problem(place, code, quantity)
        if problem:
            problems.append(f"row {number}: {problem}")
            continue
        codes = expected.setdefault(place, [])
        if code and not _ZERO.fullmatch(quantity):
            codes.append(code)
            quantities[place.casefold(), code_key(code)] = quantity
    return UploadedStock(expected, quantities, tuple(problems), len(table.rows) - first)


def _problem(place: str, code: str, quantity: str) -> str:
    if not place:
        return "no place" if code else "neither place nor code"
    if is_rounded(code):
        return f"{code}: the spreadsheet has rounded this code; make the column text and enter it anew"
    if quantity and not _NUMBER.fullmatch(quantity):
        return f"{quantity!r} is no quantity"
    return ""
