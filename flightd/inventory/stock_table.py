"""A table that somebody uploads: CSV however it is separated and encoded, or the first sheet of a workbook.

Whatever it is, it is bounded, and everything in it is text.  Numbers that a spreadsheet has rounded, as it
does beyond 15 digits, stay recognisable as such (`is_rounded`).
"""

from __future__ import annotations

import csv
import io
import re
import warnings
import zipfile
import zlib
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import date, time
from typing import IO

from flightd.core.csv_text import exact
from flightd.core.errors import InputError
from flightd.core.extras import missing_extra

MOST_BYTES = 8_000_000
MOST_ROWS = 100_000
MOST_COLUMNS = 60
MOST_CHARACTERS = 500
"""In one cell."""
_MOST_UNPACKED = 100_000_000
_MOST_PARTS = 500
_LAST_ROW = 2 * MOST_ROWS
"""Of a sheet: so many may be empty in between."""
_DOCTYPE = b"<!DOCTYPE"
_BLOCK_BYTES = 1 << 20
_EXACT = 10**15
_ROUNDED = re.compile(r"[+-]?\d+([.,]\d+)?[eE]\+?\d+")
_SEPARATORS = {";": "semicolon", ",": "comma", "\t": "tab", "|": "bar"}
_TRIED_LINES = 30
_BROKEN = (
    zipfile.BadZipFile, zlib.error, SyntaxError, LookupError, ValueError, TypeError, AttributeError, EOFError,
    ArithmeticError, NotImplementedError, RuntimeError, OSError,
)  # fmt: skip
"""What opening a workbook raises for what is none, or only nearly one (XML's errors are SyntaxErrors)."""


@dataclass(frozen=True, slots=True)
class StockTable:
    """Rows of equally many cells, none of them empty; `numbers` are those that they have in the file."""

    kind: str
    rows: tuple[tuple[str, ...], ...]
    numbers: tuple[int, ...]

    @property
    def width(self) -> int:
        return len(self.rows[0])


def read_table(data: bytes, needed: str = "one of places and one of codes are needed") -> StockTable:
    """The table in a file.  InputError saying what is wrong with it and what to do; `needed` are the columns
    without which it is none, in words: "" where one column is a table, or none."""
    if len(data) > MOST_BYTES:
        raise InputError(f"the file has more than {MOST_BYTES // 10**6} MB")
    if data.startswith(b"PK\x03\x04"):
        return _table("XLSX", _workbook_rows(data), needed)
    if data.startswith(b"\xd0\xcf\x11\xe0"):
        raise InputError(
            "an old or an encrypted workbook", remedy="save it as .xlsx or CSV, without a password"
        )
    text, encoding = _text_of(data)
    separator = _separator(text)
    return _table(f"CSV, {_SEPARATORS[separator]}, {encoding}", _csv_rows(text, separator), needed)


def is_rounded(cell: str) -> bool:
    """A number whose last digits are lost."""
    return _ROUNDED.fullmatch(cell) is not None


def _table(kind: str, raw: Iterable[Sequence[str]], needed: str) -> StockTable:
    rows: list[tuple[str, ...]] = []
    numbers: list[int] = []
    for number, cells in enumerate(raw, start=1):
        kept = [cell.strip() for cell in cells]
        while kept and not kept[-1]:
            kept.pop()
        if not kept:
            continue
        if len(rows) == MOST_ROWS:
            raise InputError(f"more than {MOST_ROWS:,} rows", remedy="upload it in parts")
        if len(kept) > MOST_COLUMNS:
            raise InputError(f"row {number} has more than {MOST_COLUMNS} columns")
        if any(len(cell) > MOST_CHARACTERS for cell in kept):
            raise InputError(f"row {number} has a cell of more than {MOST_CHARACTERS} characters")
        rows.append(tuple(kept))
        numbers.append(number)
    width = max(map(len, rows), default=0)
    if width < 2 and needed:
        raise InputError(f"it has not two columns: {needed}")
    return StockTable(kind, tuple(row + ("",) * (width - len(row)) for row in rows), tuple(numbers))


# CSV


def _text_of(data: bytes) -> tuple[str, str]:
    """The text and the name of its encoding."""
    marked = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}.get(data[:2])
    for encoding in (marked,) if marked else ("utf-8-sig", "cp1252"):
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text, {"utf-8-sig": "UTF-8", "cp1252": "Windows-1252"}.get(encoding, "UTF-16")
        break
    raise InputError("neither text nor a workbook", remedy="save it as CSV (UTF-8) or .xlsx")


def _separator(text: str) -> str:
    """What splits the most lines into equally many cells."""
    lines = [line for line in text.splitlines()[:_TRIED_LINES] if line.strip()]
    if lines and (told := re.fullmatch(r"sep=([;,\t|])", lines[0])):
        return told[1]

    def fit(separator: str) -> tuple[int, int]:
        try:
            widths = Counter(len(row) for row in csv.reader(lines, delimiter=separator))
        except csv.Error:
            return 0, 0
        width, alike = widths.most_common(1)[0] if widths else (0, 0)
        return (alike, width) if width > 1 else (0, 0)

    return max(_SEPARATORS, key=fit)


def _csv_rows(text: str, separator: str) -> Iterator[list[str]]:
    try:
        for row in csv.reader(io.StringIO(text, newline=""), delimiter=separator, strict=True):
            yield [] if len(row) == 1 and row[0].startswith("sep=") else [exact(cell) for cell in row]
    except csv.Error as err:
        raise InputError(f"not CSV: {err}", remedy="look for a quote that is not closed") from None


# XLSX


def _workbook_rows(data: bytes) -> Iterator[list[str]]:
    try:
        import openpyxl
    except ImportError:
        raise missing_extra("ground", "reading a workbook") from None
    try:
        _check_parts(data)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of styles that are of no use here
            book = openpyxl.load_workbook(io.BytesIO(data), read_only=True, data_only=True, keep_links=False)
        try:
            cells = book.worksheets[0].iter_rows(
                max_row=_LAST_ROW + 1, max_col=MOST_COLUMNS + 1, values_only=True
            )
            for number, row in enumerate(cells, start=1):
                if number > _LAST_ROW:
                    raise InputError(f"the workbook has rows beyond {_LAST_ROW:,}", remedy="save it as CSV")
                yield [_cell_text(value) for value in row]
        finally:
            book.close()
    except _BROKEN:
        raise InputError(
            "not a workbook, or a damaged one", remedy="save it anew as .xlsx, or as CSV"
        ) from None


def _check_parts(data: bytes) -> None:
    """Refuse what unpacks to far more than a table is, and documents that define entities."""
    with zipfile.ZipFile(io.BytesIO(data)) as package:
        parts = package.infolist()
        if len(parts) > _MOST_PARTS or sum(part.file_size for part in parts) > _MOST_UNPACKED:
            raise InputError("the workbook is too large when it is unpacked", remedy="save the sheet as CSV")
        for part in parts:  # whatever its name: another part may call it a sheet
            with package.open(part) as content:
                if _defines_entities(content):
                    raise InputError("the workbook holds a document type definition, which none needs")


def _defines_entities(content: IO[bytes]) -> bool:
    """In whatever encoding: those of two and four bytes are ASCII and zeros here."""
    seen = b""
    while block := content.read(_BLOCK_BYTES):
        seen = seen[-len(_DOCTYPE) :] + block.translate(None, b"\0").upper()
        if _DOCTYPE in seen:
            return True
    return False


def _cell_text(value: object) -> str:
    match value:
        case None:
            return ""
        case bool():
            return str(value).upper()
        case int() | float():
            if abs(value) >= _EXACT:
                return f"{value:E}"
            return str(int(value)) if value == int(value) else repr(value)
        case date() | time():
            return value.isoformat()
    return exact(str(value))
