"""How full places are, in the inventory's file: for each look that was asked."""

from __future__ import annotations

import sqlite3
from collections.abc import Sequence
from typing import Final

from flightd.core.inventory import CaseGrid, PlaceFill

FILL_TABLES: Final = (
    """CREATE TABLE place_fill (
    observation TEXT PRIMARY KEY REFERENCES observation (id),
    share REAL CHECK (share BETWEEN 0 AND 1),
    overhang_m REAL
) STRICT, WITHOUT ROWID""",
)
"""`share` is null where the pictures do not tell, `overhang_m` where it is not measured."""
LEAN_COLUMN: Final = ("ALTER TABLE place_fill ADD COLUMN lean_m REAL",)
"""Null where the pictures do not tell."""

CASE_COLUMNS: Final = (
    "ALTER TABLE place_fill ADD COLUMN case_columns INTEGER",
    "ALTER TABLE place_fill ADD COLUMN case_rows INTEGER",
)
"""Null where the pictures do not tell them."""
_COLUMNS: Final = ("share", "overhang_m", "lean_m", "case_columns", "case_rows")


def keep_fill(db: sqlite3.Connection, observation: str, fill: PlaceFill) -> None:
    """Write how full the place of a look is; what is written stays."""
    cases = (fill.cases.columns, fill.cases.rows) if fill.cases else (None, None)
    db.execute(
        "INSERT OR IGNORE INTO place_fill VALUES (?, ?, ?, ?, ?, ?)",
        (observation, fill.share, fill.overhang_m, fill.lean_m, *cases),
    )


def kept_fills(db: sqlite3.Connection, where: str, values: Sequence[object]) -> dict[str, PlaceFill]:
    """How full places are, of the observations `where` that is so, by their ids; what a file of an earlier
    format lacks is not known.  ValueError for rows of another program."""
    known = {row[1] for row in db.execute("PRAGMA table_info(place_fill)")}
    columns = ", ".join(name if name in known else "NULL" for name in _COLUMNS)
    rows = db.execute(f"SELECT observation, {columns} FROM place_fill WHERE {where}", values)  # noqa: S608
    return {
        observation: PlaceFill(share, overhang_m, lean_m, CaseGrid(wide, high) if wide and high else None)
        for observation, share, overhang_m, lean_m, wide, high in rows
    }
