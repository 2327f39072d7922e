"""What people decided about places: in the station's own file, to which decisions are only added.

The inventories stay as they are: a decision says what a person found or ordered, never what was counted.
It holds for the look that the person saw; a newer look makes the place open again.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from pathlib import Path

from flightd.core.errors import UnavailableError
from flightd.ground.own_database import OwnDatabase

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


def station_file(folder: Path) -> OwnDatabase:
    """The station's file about inventories in `folder`, `ground.db`."""
    return OwnDatabase(
        file=folder / FILE,
        holds="the decisions",
        application=_APPLICATION,
        version=_VERSION,
        schema=SCHEMA,
    )


class DecisionBook:
    """The file in `folder`, made with the first decision.  Safe from any thread.

    UnavailableError where the disk refuses, InputError for a file that is another program's."""

    def __init__(self, folder: Path) -> None:
        self._database = station_file(folder)

    def add(self, store: str, decision: Decision) -> None:
        """Note a decision about a place of a store; the same one again changes nothing."""
        with self._database.changed() as book:
            if book.execute("SELECT count(*) FROM decision").fetchone()[0] >= _MOST_ROWS:
                raise UnavailableError(
                    f"{self._database.file} is full", remedy="put it aside; a new one is made"
                )
            row = (
                decision.id, store, decision.place, decision.utc_ns, decision.seen_ns, decision.what.value,
                decision.who, decision.note,
            )  # fmt: skip
            book.execute("INSERT OR IGNORE INTO decision VALUES (?, ?, ?, ?, ?, ?, ?, ?)", row)

    def decisions(self, store: str) -> list[Decision]:
        """All about a store's places, oldest first."""
        if not self._database.is_there:
            return []
        with self._database.opened() as book:
            rows = book.execute(
                "SELECT id, place, utc_ns, seen_ns, what, who, note FROM decision WHERE store = ? "
                "ORDER BY utc_ns, rowid",
                (store,),
            ).fetchall()
            return [Decision(row[0], row[1], row[2], row[3], Decided(row[4]), *row[5:]) for row in rows]
