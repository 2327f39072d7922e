"""Keys with scopes, for programs that ask the ground store and nothing else; kept as hashes.

They are made and revoked by `flightd ground keys` while the station runs, which reads them again each second.
"""

from __future__ import annotations

import enum
import sqlite3
import time
from dataclasses import dataclass
from pathlib import Path

from flightd.core.errors import InputError
from flightd.ground.access.people_book import access_database, check_name

FILE = "keys.db"
MOST_KEYS = 1000
_APPLICATION, _VERSION = 0x666C746B, 1
"""`fltk`: SQLite's application id."""
_SCHEMA = """
CREATE TABLE key (
    name TEXT PRIMARY KEY COLLATE NOCASE,
    hash BLOB NOT NULL UNIQUE,
    scopes TEXT NOT NULL,
    made_s REAL NOT NULL
) STRICT
"""


class Scope(enum.StrEnum):
    """What a key opens; nothing else does it open."""

    STOCK = "stock"
    """Reads sites, stock, runs, looks, differences, flights, decisions, questions."""
    PICTURES = "pictures"
    """Reads the pictures that are kept as evidence."""
    DELIVER = "deliver"
    """Delivers looks and pictures."""
    ASK = "ask"
    """Asks what lies at places now."""


@dataclass(frozen=True, slots=True)
class ScopedKey:
    """A program's key; `hash` is what is kept of it."""

    name: str
    hash: bytes
    scopes: frozenset[Scope]
    made_s: float


class KeyBook:
    """Safe from any thread and any process; errors as of `PeopleBook`."""

    def __init__(self, state: Path) -> None:
        self._database = access_database(state, FILE, "the keys", _APPLICATION, _VERSION, _SCHEMA)

    def all(self) -> list[ScopedKey]:
        """All of them, by name."""
        if not self._database.is_there:
            return []
        with self._database.opened() as book:
            rows = book.execute("SELECT name, hash, scopes, made_s FROM key ORDER BY name").fetchall()
        return [ScopedKey(row[0], row[1], frozenset(map(Scope, row[2].split())), row[3]) for row in rows]

    def make(self, name: str, hashed: bytes, scopes: frozenset[Scope]) -> None:
        """InputError for a name that is taken, or none."""
        check_name(name)
        with self._database.changed() as book:
            if book.execute("SELECT count(*) FROM key").fetchone()[0] >= MOST_KEYS:
                raise InputError(f"there are {MOST_KEYS} keys already")
            try:
                row = (name, hashed, " ".join(sorted(scopes)), time.time())
                book.execute("INSERT INTO key VALUES (?, ?, ?, ?)", row)
            except sqlite3.IntegrityError:
                raise InputError(f"there is a key {name} already", remedy="revoke it first") from None

    def revoke(self, name: str) -> None:
        """It opens nothing any more within a second.  InputError where there is none."""
        with self._database.changed() as book:
            if book.execute("DELETE FROM key WHERE name = ?", (name,)).rowcount == 0:
                raise InputError(f"there is no key {name!r}", remedy="see flightd ground keys list")


def read_scopes(words: list[str]) -> frozenset[Scope]:
    """InputError for what is no scope, and for none."""
    if not words:
        raise InputError("a key without a scope opens nothing", remedy=f"--scope {', '.join(Scope)}")
    try:
        return frozenset(map(Scope, words))
    except ValueError:
        raise InputError(f"expected {', '.join(Scope)}", key=f"--scope {' '.join(words)}") from None
