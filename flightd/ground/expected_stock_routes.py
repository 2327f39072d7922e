"""Books that somebody uploads to the page Stock: compared with a count, and kept nowhere."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from starlette.datastructures import QueryParams
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from flightd.core.errors import InputError
from flightd.ground.stock_routes import StockAnswers, answered, as_json, download
from flightd.ground.stores import StockView
from flightd.inventory.comparison import ComparisonOutcome, Difference, compare_stock, outcome_counts
from flightd.inventory.export.comparison_table import comparison_csv, comparison_json
from flightd.inventory.stock_columns import StockColumns, guess_columns
from flightd.inventory.stock_table import MOST_BYTES, StockTable, read_table
from flightd.inventory.uploaded_stock import UploadedStock, uploaded_stock

_SAMPLE_ROWS = 6
_MOST_LINES = 1_000
"""So many differences are shown on the page; a download has them all."""
_MOST_PROBLEMS = 20
_CALM = frozenset({ComparisonOutcome.MATCH, ComparisonOutcome.UNCOUNTED})
_KIND = "application/octet-stream"
_FORMATS = {"csv": (comparison_csv, "text/csv; charset=utf-8"), "json": (comparison_json, "application/json")}


def expected_stock_routes(asked: StockAnswers) -> list[BaseRoute]:
    """POST a file, get the comparison: the page sends it anew for other columns or for a download."""

    async def compare(request: Request) -> Response:
        if request.headers.get("content-type", "") != _KIND:
            return as_json({"refused": "an upload is the file itself"}, 415)
        view = await asked.store_view(request)
        data = await _body(request)
        return await asked.off_loop(_answer, data, view, request.query_params)

    return [Route("/api/stock/compare", answered(compare), methods=["POST"])]


async def _body(request: Request) -> bytes:
    """The file.  InputError for one that is too long, or breaks off."""
    length = request.headers.get("content-length", "0")
    parts: list[bytes] = []
    size = int(length) if length.isdecimal() and len(length) < 12 else MOST_BYTES + 1
    try:
        if size <= MOST_BYTES:
            size = 0
            async for part in request.stream():
                parts.append(part)
                size += len(part)
                if size > MOST_BYTES:
                    break
    except ClientDisconnect:
        raise InputError("the upload breaks off") from None
    if size > MOST_BYTES:
        raise InputError(f"the file has more than {MOST_BYTES // 10**6} MB")
    return b"".join(parts)


@dataclass(frozen=True, slots=True)
class _Compared:
    table: StockTable
    columns: StockColumns
    stock: UploadedStock
    lines: tuple[Difference, ...]
    unknown_places: tuple[str, ...]
    """Of the books, in their order: of another hall, or misspelt."""


def _answer(data: bytes, view: StockView, asked: QueryParams) -> Response:
    compared = _compared(data, view, asked)
    kind = asked.get("format")
    if kind is None:
        return as_json(_document(compared))
    if kind not in _FORMATS:
        raise InputError(f"no format is called {kind!r}; choose one of {', '.join(_FORMATS)}")
    write, media_type = _FORMATS[kind]
    written = write(compared.lines, compared.stock)
    return download(written, f"comparison.{kind}", media_type)


def _compared(data: bytes, view: StockView, asked: QueryParams) -> _Compared:
    table = read_table(data)
    places = [record.code for record in view.records]
    guessed = guess_columns(table, places, [text for record in view.records for text in record.texts])
    columns = _columns(asked, guessed).checked(table)
    stock = uploaded_stock(table, columns)
    known = {place.casefold() for place in places}
    unknown = tuple(place for place in stock.expected if place.casefold() not in known)
    return _Compared(table, columns, stock, compare_stock(view.records, stock.expected), unknown)


def _columns(asked: QueryParams, guessed: StockColumns) -> StockColumns:
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
