"""Values of printed text in the inventory's file: what was found in each look's picture, by which search."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable, Iterable, Sequence
from datetime import date
from decimal import Decimal
from typing import Any, Final, TypeAlias

from flightd.core.label_values import LabelValue, Told, ValueKind, ValueSource

TEXT_TABLES: Final = (
    """CREATE TABLE text_search (
    observation TEXT PRIMARY KEY REFERENCES observation (id),
    asked TEXT NOT NULL,
    found TEXT NOT NULL
) STRICT, WITHOUT ROWID""",
)
"""`asked` names the patterns of the search; `found` is a JSON list of kind, type, value, confidence."""
Search: TypeAlias = tuple[str, str, str]
"""A row: observation, asked, found."""
_TYPES: Final[dict[str, Callable[[str], Told]]] = {"text": str, "date": date.fromisoformat, "number": Decimal}


def keep_texts(db: sqlite3.Connection, observation: str, texts: Iterable[LabelValue], asked: str) -> None:
    """Put what a search found in the place of what an earlier one did.  An observation that is not there
    has no texts."""
    found = json.dumps([[v.kind.value, _type_of(v.value), v.text, v.confidence] for v in texts])
    db.execute(
        "INSERT INTO text_search SELECT ?1, ?2, ?3 WHERE EXISTS (SELECT 1 FROM observation WHERE id = ?1) "
        "ON CONFLICT (observation) DO UPDATE SET asked = excluded.asked, found = excluded.found",
        (observation, asked, found),
    )


def kept_texts(
    db: sqlite3.Connection, where: str, values: Sequence[object]
) -> dict[str, tuple[LabelValue, ...]]:
    """The texts of the observations `where` that is so, by their ids; TypeError or ValueError for rows of
    another program."""
    rows = db.execute(f"SELECT observation, found FROM text_search WHERE {where}", values)  # noqa: S608
    return {observation: found_texts(found) for observation, found in rows}


def found_texts(found: str) -> tuple[LabelValue, ...]:
    """What a search found; TypeError or ValueError for another program's."""
    return tuple(map(_value, json.loads(found)))


def was_searched(db: sqlite3.Connection, observation: str, asked: str) -> bool:
    """Whether this search was done."""
    row = db.execute(
        "SELECT 1 FROM text_search WHERE observation = ? AND asked = ?", (observation, asked)
    ).fetchone()
    return row is not None


def all_searches(db: sqlite3.Connection) -> list[Search]:
    """Every search, to be merged into another file."""
    return [(a, b, c) for a, b, c in db.execute("SELECT observation, asked, found FROM text_search")]


def merge_texts(db: sqlite3.Connection, searches: Iterable[Search]) -> None:
    """Take in another file's; of two searches of one picture the one that found more stays, of equal ones
    that which is greater as a text: the same whatever is merged first."""
    db.executemany(
        "INSERT INTO text_search VALUES (?, ?, ?) ON CONFLICT (observation) DO UPDATE SET "
        "asked = excluded.asked, found = excluded.found "
        "WHERE (length(excluded.found), excluded.found, excluded.asked) > (length(found), found, asked)",
        searches,
    )


def _type_of(value: Told) -> str:
    if isinstance(value, date):
        return "date"
    return "number" if isinstance(value, Decimal) else "text"


def _value(row: list[Any]) -> LabelValue:
    kind, type_, text, confidence = row
    _TYPES[type_](text)  # of another program: ValueError
    return LabelValue(ValueKind(kind), text, "", ValueSource.TEXT, float(confidence))
