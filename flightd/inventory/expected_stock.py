"""The expected stock: what the books say lies where."""

from __future__ import annotations

import csv
from pathlib import Path

from flightd.core.csv_text import exact
from flightd.core.errors import InputError


def read_stock(path: Path) -> dict[str, list[str]]:
    """The expected codes of each location.  Raises InputError naming the file, the line and the remedy."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file, strict=True)
            columns = reader.fieldnames or []
            for column in ("location", "code"):
                if column not in columns:
                    remedy = "the first line must name location,code"
                    raise InputError(f"no column {column!r}", file=path, remedy=remedy)
            stock: dict[str, list[str]] = {}
            for row in reader:
                location, code = (exact((row[name] or "").strip()) for name in ("location", "code"))
                if not location:
                    raise InputError("no location", file=path, key=f"line {reader.line_num}")
                stock.setdefault(location, []).extend([code] if code else [])
    except OSError as err:
        raise InputError(f"cannot read the expected stock: {err.strerror or err}", file=path) from None
    except UnicodeDecodeError:
        raise InputError("not UTF-8 text", file=path, remedy="save the CSV as UTF-8") from None
    except csv.Error as err:
        raise InputError(f"not CSV: {err}", file=path) from None
    return stock
