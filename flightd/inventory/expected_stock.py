"""The expected stock: what the books say lies where."""

from __future__ import annotations

import csv
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

from flightd.core.csv_text import exact
from flightd.core.errors import InputError


@dataclass(frozen=True, slots=True)
class UnknownLocation:
    """A location of the books that the count does not know, with the line of the file that names it first."""

    location: str
    line: int


def read_stock(path: Path) -> dict[str, list[str]]:
    """The expected codes of each location.  Raises InputError naming the file, the line and the remedy."""
    stock: dict[str, list[str]] = {}
    for _, location, code in _rows(path):
        stock.setdefault(location, []).extend([code] if code else [])
    return stock


def unknown_locations(path: Path, known: Collection[str]) -> tuple[UnknownLocation, ...]:
    """The locations of the books that are not `known`, in the order of the file: of other halls, or misspelt;
    their case is none of it.  Errors as `read_stock`."""
    first: dict[str, int] = {}
    folded = {location.casefold() for location in known}
    for line, location, _ in _rows(path):
        if location.casefold() not in folded:
            first.setdefault(location, line)
    return tuple(UnknownLocation(location, line) for location, line in first.items())


def _rows(path: Path) -> Iterator[tuple[int, str, str]]:
    """Line, location and code (empty for none) of each row."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file, strict=True)
            columns = reader.fieldnames or []
            for column in ("location", "code"):
                if column not in columns:
                    remedy = "the first line must name location,code"
                    raise InputError(f"no column {column!r}", file=path, remedy=remedy)
            for row in reader:
                location, code = (exact((row[name] or "").strip()) for name in ("location", "code"))
                if not location:
                    raise InputError("no location", file=path, key=f"line {reader.line_num}")
                yield reader.line_num, location, code
    except OSError as err:
        raise InputError(f"cannot read the expected stock: {err.strerror or err}", file=path) from None
    except UnicodeDecodeError:
        raise InputError("not UTF-8 text", file=path, remedy="save the CSV as UTF-8") from None
    except csv.Error as err:
        raise InputError(f"not CSV: {err}", file=path) from None
