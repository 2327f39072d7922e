"""Codes that stayed undecided, in the inventory's file: those of each look."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Sequence
from typing import Final

from flightd.core.inventory import UndecidedCode

UNDECIDED_TABLES: Final = (
    """CREATE TABLE undecided_code (
    observation TEXT NOT NULL REFERENCES observation (id),
    number INTEGER NOT NULL,
    symbology TEXT NOT NULL,
    text TEXT NOT NULL,
    looks INTEGER NOT NULL CHECK (looks >= 1),
    PRIMARY KEY (observation, number)
) STRICT, WITHOUT ROWID""",
)


def keep_undecided(db: sqlite3.Connection, observation: str, codes: Iterable[UndecidedCode]) -> None:
    """Write those of a look that is new."""
    db.executemany(
        "INSERT INTO undecided_code VALUES (?, ?, ?, ?, ?)",
        [(observation, i, code.symbology, code.text, code.looks) for i, code in enumerate(codes)],
    )


def kept_undecided(
    db: sqlite3.Connection, where: str, values: Sequence[object]
) -> dict[str, tuple[UndecidedCode, ...]]:
    """The codes of the observations `where` that is so, by their ids; ValueError for rows of another
    program."""
    kept: dict[str, tuple[UndecidedCode, ...]] = {}
    for observation, *code in db.execute(
        f"SELECT observation, symbology, text, looks FROM undecided_code WHERE {where}"  # noqa: S608
        " ORDER BY observation, number",
        values,
    ):
        kept[observation] = (*kept.get(observation, ()), UndecidedCode(*code))
    return kept
