"""Books that somebody uploaded, compared with a count: what a reading process makes of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from flightd.adapters.store.sqlite import SqliteStore
from flightd.core.errors import InputError
from flightd.core.inventory import LocationRecord
from flightd.inventory.comparison import ComparisonOutcome, Difference, compare_stock, outcome_counts
from flightd.inventory.export.comparison_table import comparison_csv, comparison_json
from flightd.inventory.stock_columns import StockColumns, guess_columns
from flightd.inventory.stock_table import StockTable, read_table
from flightd.inventory.uploaded_stock import UploadedStock, uploaded_stock

_SAMPLE_ROWS = 6
_MOST_LINES = 1_000
"""So many differences are shown on the page; a download has them all."""
_MOST_PROBLEMS = 20
_CALM = frozenset({ComparisonOutcome.MATCH, ComparisonOutcome.UNCOUNTED})
_FORMATS = {"csv": (comparison_csv, "text/csv; charset=utf-8"), "json": (comparison_json, "application/json")}


@dataclass(frozen=True, slots=True)
class Answer:
    """What is sent, and by which columns it was compared; `name` is that of a file for the person to keep,
    empty for the page."""

    columns: StockColumns
    content: bytes
    media_type: str
    name: str = ""


@dataclass(frozen=True, slots=True)
class _Compared:
    table: StockTable
    columns: StockColumns
    stock: UploadedStock
    lines: tuple[Difference, ...]
    unknown_places: tuple[str, ...]
    """Of the books, in their order: of another hall, or misspelt."""


def compare_upload(store: Path, upload: Path, asked: Mapping[str, str]) -> Answer:
    """In a reading process: the file `upload` against the inventory in the folder `store`.

    `asked` are the request's words: the columns, else they are guessed, and the `format`, else the page's
    own.  InputError for what is no table, and for words that mean nothing."""
    with SqliteStore(store, read_only=True) as opened:
        records = opened.locations()
    compared = _compared(upload.read_bytes(), records, asked)
    kind = asked.get("format")
    if kind is None:
        return Answer(compared.columns, msgspec.json.encode(_document(compared)), "application/json")
    if kind not in _FORMATS:
        raise InputError(f"no format is called {kind!r}; choose one of {', '.join(_FORMATS)}")
    write, media_type = _FORMATS[kind]
    content = write(compared.lines, compared.stock)
    return Answer(compared.columns, content, media_type, f"comparison.{kind}")


def column_words(columns: StockColumns) -> dict[str, str]:
    """As `compare_upload` is asked for them."""
    return {
        "place": str(columns.place),
        "code": str(columns.code),
        "quantity": "" if columns.quantity is None else str(columns.quantity),
        "heading": "yes" if columns.heading else "no",
    }


def _compared(data: bytes, records: Sequence[LocationRecord], asked: Mapping[str, str]) -> _Compared:
    table = read_table(data)
    places = [record.code for record in records]
    guessed = guess_columns(table, places, [text for record in records for text in record.texts])
    columns = _columns(asked, guessed).checked(table)
    stock = uploaded_stock(table, columns)
    known = {place.casefold() for place in places}
    unknown = tuple(place for place in stock.expected if place.casefold() not in known)
    return _Compared(table, columns, stock, compare_stock(records, stock.expected), unknown)


def _columns(asked: Mapping[str, str], guessed: StockColumns) -> StockColumns:
    """The columns that the person chose, or the guess."""
    if "place" not in asked:
        return guessed
    quantity = asked.get("quantity", "")
    return StockColumns(
        _number(asked.get("place", "")),
        _number(asked.get("code", "")),
        _number(quantity) if quantity else None,
        asked.get("heading") == "yes",
    )


def _number(text: str) -> int:
    if not (text.isascii() and text.isdecimal() and len(text) < 4):
        raise InputError(f"{text!r} is no column")
    return int(text)


def _document(compared: _Compared) -> dict[str, Any]:
    table, columns, stock, lines = compared.table, compared.columns, compared.stock, compared.lines
    first = table.rows[0] if columns.heading else [""] * table.width
    differences = [line for line in lines if line.outcome not in _CALM]
    return {
        "kind": table.kind,
        "columns": [name or f"Column {number}" for number, name in enumerate(first, start=1)],
        "sample": table.rows[columns.heading : columns.heading + _SAMPLE_ROWS],
        "chosen": {
            "place": columns.place,
            "code": columns.code,
            "quantity": columns.quantity,
            "heading": columns.heading,
        },
        "rows": stock.rows,
        "problems": stock.problems[:_MOST_PROBLEMS],
        "problem_count": len(stock.problems),
        "unknown_places": compared.unknown_places[:_MOST_PROBLEMS],
        "unknown_place_count": len(compared.unknown_places),
        "outcome_counts": {outcome.value: count for outcome, count in outcome_counts(lines).items()},
        "difference_count": len(differences),
        "lines": [_line(line, stock) for line in differences[:_MOST_LINES]],
        "outcomes": _by_place(differences),
    }


def _line(line: Difference, stock: UploadedStock) -> dict[str, object]:
    return {
        "outcome": line.outcome.value,
        "location": line.location,
        "text": line.text,
        "quantity": stock.quantity(line.location, line.text),
        "found": line.found,
        "found_at": line.found_at,
    }


def _by_place(differences: list[Difference]) -> dict[str, str]:
    """The first that is said of each place, both ends of a moved code among them."""
    found: dict[str, str] = {}
    for line in differences:
        found.setdefault(line.location, line.outcome.value)
    for line in differences:
        if line.found_at:
            found.setdefault(line.found_at, line.outcome.value)
    return found
