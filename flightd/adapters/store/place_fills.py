"""How full places are, in the inventory's file: for each look that was asked."""

from __future__ import annotations

import sqlite3
from typing import Final

from flightd.core.inventory import PlaceFill

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


def keep_fill(db: sqlite3.Connection, observation: str, fill: PlaceFill) -> None:
    """Write how full the place of a look is; what is written stays."""
    db.execute(
        "INSERT OR IGNORE INTO place_fill VALUES (?, ?, ?, ?)",
        (observation, fill.share, fill.overhang_m, fill.lean_m),
    )


def kept_fills(db: sqlite3.Connection, *, with_lean: bool) -> dict[str, PlaceFill]:
    """How full the places are, by the observation's id; ValueError for rows of another program."""
    lean = "lean_m" if with_lean else "NULL"
    rows = db.execute(f"SELECT observation, share, overhang_m, {lean} FROM place_fill").fetchall()  # noqa: S608
    return {observation: PlaceFill(*told) for observation, *told in rows}
