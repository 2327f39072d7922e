"""What came to pass in the store, noted with it for whoever is to be told: in the same transaction, in order.

The newest `MOST_EVENTS` are kept; what a hook has not taken by then is dropped for it, and counted.
"""

from __future__ import annotations

import enum
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from flightd.ground.ground_store.engine import Session

MOST_EVENTS = 10_000


class EventKind(enum.StrEnum):
    """What a webhook is told of."""

    RUN_NEW = "run.new"
    """The first looks of a run are there."""
    DIFFERENCE_FOUND = "difference.found"
    """A run found a place otherwise than the count before it, or otherwise than was known so far."""
    DIFFERENCE_GONE = "difference.gone"
    """What was told as a difference is none: looks came late, or were withdrawn."""
    PLACE_DECIDED = "place.decided"
    """A person decided about a place."""


@dataclass(frozen=True, slots=True)
class Event:
    """`id` grows; the same one may be told twice."""

    id: int
    utc_ns: int
    kind: str
    body: dict[str, Any]


class Noted:
    """Events of one transaction; nothing is noted where no hook wants them."""

    def __init__(self, session: Session, site: str, utc_ns: int) -> None:
        self._session = session
        self._site = site
        self.utc_ns = utc_ns
        self._rows: list[tuple[int, str, str]] = []
        self.wanted = bool(session.rows("SELECT 1 FROM hook LIMIT 1"))

    def note(self, kind: EventKind, body: Mapping[str, object]) -> None:
        if self.wanted:
            self._rows.append((self.utc_ns, kind.value, json.dumps({"site": self._site, **body})))

    def write(self) -> None:
        """At the end of the transaction."""
        if not self._rows:
            return
        self._session.run_many("INSERT INTO event (utc_ns, kind, body) VALUES (?, ?, ?)", self._rows)
        kept = self._session.rows("SELECT id FROM event ORDER BY id DESC LIMIT 1 OFFSET ?", MOST_EVENTS)
        if kept:
            last = kept[0][0]
            lost = "SELECT count(*) FROM event WHERE id > sent AND id <= ?"
            self._session.run(
                f"UPDATE hook SET dropped = dropped + ({lost}),"
                " sent = CASE WHEN sent < ? THEN ? ELSE sent END",
                last, last, last,
            )  # fmt: skip
            self._session.run("DELETE FROM event WHERE id <= ?", last)


def register(session: Session, hook: str) -> None:
    """From now on it is told; one that is known goes on where it was."""
    session.run(
        "INSERT INTO hook SELECT ?, coalesce(max(id), 0), 0 FROM event WHERE true ON CONFLICT DO NOTHING",
        hook,
    )


def waiting(session: Session, hook: str, most: int) -> tuple[list[Event], int]:
    """The oldest that a hook has not taken, and how many were dropped for it so far."""
    sent, dropped = session.rows("SELECT sent, dropped FROM hook WHERE name = ?", hook)[0]
    rows = session.rows(
        "SELECT id, utc_ns, kind, body FROM event WHERE id > ? ORDER BY id LIMIT ?", sent, most
    )
    return [Event(row[0], row[1], row[2], json.loads(row[3])) for row in rows], dropped


def taken(session: Session, hook: str, event: int) -> None:
    """The hook has this one and all before it."""
    session.run("UPDATE hook SET sent = ? WHERE name = ? AND sent < ?", event, hook, event)
