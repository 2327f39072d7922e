"""What people decided about places that need a look: the station's own file, to which is only added.

The inventories stay as they are: a decision says what a person found or ordered, never what was counted.
It holds for the look that the person saw; a newer look makes the place open again.
"""

from __future__ import annotations

import enum
import sqlite3
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

from flightd.core.errors import InputError, UnavailableError

FILE = "ground.db"
_APPLICATION, _VERSION = 0x666C7467, 1
"""`fltg`: SQLite's application id, so that another program's file is told apart."""
_MOST_ROWS = 500_000
SCHEMA = """
CREATE TABLE decision (
    id TEXT PRIMARY KEY,
    store TEXT NOT NULL,
    place TEXT NOT NULL,
    utc_ns INTEGER NOT NULL,
    seen_ns INTEGER NOT NULL,
    what TEXT NOT NULL,
    who TEXT NOT NULL,
    note TEXT NOT NULL
) STRICT;
CREATE INDEX place ON decision (store, place, utc_ns)
"""


class Decided(enum.StrEnum):
    """What a person does about a place, or found."""

    LOOKING = "looking"
    """Somebody goes and looks; nobody else needs to."""
    PUT_RIGHT = "put_right"
    """Label or goods were put right at the place."""
    COUNT_AGAIN = "count_again"
    """The next flight shall look again."""
    FINE = "fine"
    """It is as it should be."""
    OPEN = "open"
    """Taken back: somebody has to look."""


@dataclass(frozen=True, slots=True)
class Decision:
    """One decision; `seen_ns` is the time of the look that the person saw (UTC; 0: there was none)."""

    id: str
    place: str
    utc_ns: int
    seen_ns: int
    what: Decided
    who: str
    note: str = ""


class DecisionBook:
    """The file in `folder`, made with the first decision.  Safe from any thread.

    UnavailableError where the disk refuses, InputError for a file that is another program's."""

    def __init__(self, folder: Path) -> None:
        self._file = folder / FILE
        self._lock = threading.Lock()

    def add(self, store: str, decision: Decision) -> None:
        """Note a decision about a place of a store; the same one again changes nothing."""
        with self._opened() as book, _transaction(book):
            if book.execute("SELECT count(*) FROM decision").fetchone()[0] >= _MOST_ROWS:
                raise UnavailableError(f"{self._file} is full", remedy="put it aside; a new one is made")
            row = (
                decision.id, store, decision.place, decision.utc_ns, decision.seen_ns, decision.what.value,
                decision.who, decision.note,
            )  # fmt: skip
            book.execute("INSERT OR IGNORE INTO decision VALUES (?, ?, ?, ?, ?, ?, ?, ?)", row)

    def decisions(self, store: str) -> list[Decision]:
        """All about a store's places, oldest first."""
        if not self._file.exists():
            return []
        with self._opened() as book:
            rows = book.execute(
                "SELECT id, place, utc_ns, seen_ns, what, who, note FROM decision WHERE store = ? "
                "ORDER BY utc_ns, rowid",
                (store,),
            ).fetchall()
            return [Decision(row[0], row[1], row[2], row[3], Decided(row[4]), *row[5:]) for row in rows]

    @contextmanager
    def _opened(self) -> Iterator[sqlite3.Connection]:
        with self._lock:
            try:
                with closing(sqlite3.connect(self._file, timeout=2.0, isolation_level=None)) as book:
                    self._prepare(book)
                    yield book
            except sqlite3.OperationalError as err:
                raise UnavailableError(
                    f"{self._file}: {err}", remedy="may this station write there?"
                ) from err
            except (sqlite3.DatabaseError, ValueError) as err:
                raise InputError(f"{self._file}: not the decisions of a ground station: {err}") from err

    def _prepare(self, book: sqlite3.Connection) -> None:
        """Make the tables, all or nothing: a power cut, or another station, may come in between."""
        if self._is_empty(book):
            with _transaction(book):
                if self._is_empty(book):
                    for statement in SCHEMA.split(";\n"):
                        book.execute(statement)
                    book.execute(f"PRAGMA application_id = {_APPLICATION}")
                    book.execute(f"PRAGMA user_version = {_VERSION}")

    def _is_empty(self, book: sqlite3.Connection) -> bool:
        """InputError for what is not ours."""
        application, version, tables = (
            book.execute(question).fetchone()[0]
            for question in (
                "PRAGMA application_id", "PRAGMA user_version", "SELECT count(*) FROM sqlite_schema"
            )
        )  # fmt: skip
        if tables and (application, version) != (_APPLICATION, _VERSION):
            raise InputError(f"{self._file}: not the decisions of a ground station, or of another version")
        return not tables


@contextmanager
def _transaction(book: sqlite3.Connection) -> Iterator[None]:
    book.execute("BEGIN IMMEDIATE")
    try:
        yield
        book.execute("COMMIT")
    except BaseException:
        if book.in_transaction:
            book.execute("ROLLBACK")
        raise
