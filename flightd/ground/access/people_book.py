"""The people of a station and their sessions: a file in its state folder, of nobody's but its owner's.

It is changed by `flightd ground people` while the station runs, which reads it again each second.
"""

from __future__ import annotations

import re
import sqlite3
from dataclasses import dataclass
from pathlib import Path

from flightd.core.errors import InputError
from flightd.ground.access.roles import Role
from flightd.ground.own_database import OwnDatabase

FILE = "people.db"
MOST_PEOPLE, MOST_SESSIONS = 1000, 4000
_APPLICATION, _VERSION = 0x666C7470, 1
"""`fltp`: SQLite's application id."""
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._@-]{0,59}")
_SCHEMA = """
CREATE TABLE person (
    name TEXT PRIMARY KEY COLLATE NOCASE,
    role TEXT NOT NULL,
    password TEXT NOT NULL,
    key BLOB UNIQUE
) STRICT;
CREATE TABLE session (
    id BLOB PRIMARY KEY,
    person TEXT NOT NULL COLLATE NOCASE REFERENCES person ON DELETE CASCADE,
    began_s REAL NOT NULL,
    seen_s REAL NOT NULL
) STRICT
"""


def check_name(name: str) -> None:
    """InputError for what no person and no program can be called."""
    if _NAME.fullmatch(name) is None:
        raise InputError(
            f"{name!r} is no name here",
            remedy="take up to 60 letters and digits, with . _ @ - between them",
        )


def access_database(
    state: Path, file: str, holds: str, application: int, version: int, schema: str
) -> OwnDatabase:
    """A file in the state folder that says who opens what: of nobody's but its owner's."""
    return OwnDatabase(
        file=state / file,
        holds=holds,
        application=application,
        version=version,
        schema=schema,
        remedy="be the user that the station runs as, or name another --state DIR",
        timeout_s=5.0,
        private=True,
    )


@dataclass(frozen=True, slots=True)
class Person:
    """Somebody, or a program; `password` and `key` are hashes, empty where there is none."""

    name: str
    role: Role
    password: str = ""
    key: bytes = b""


@dataclass(frozen=True, slots=True)
class Session:
    """Somebody signed in; `id` is the hash of what the browser holds, the times are UTC, s."""

    id: bytes
    person: str
    began_s: float
    seen_s: float


class PeopleBook:
    """Safe from any thread and any process.

    UnavailableError where the disk refuses, InputError for a file that is another program's."""

    def __init__(self, state: Path) -> None:
        self._database = access_database(state, FILE, "the people", _APPLICATION, _VERSION, _SCHEMA)
        self.file = self._database.file

    def people(self) -> list[Person]:
        """Everybody, by name."""
        return self.read()[0]

    def read(self) -> tuple[list[Person], list[Session]]:
        """Everybody and every session, at one moment."""
        if not self._database.is_there:
            return [], []
        with self._database.changed() as book:
            people = book.execute("SELECT name, role, password, key FROM person ORDER BY name").fetchall()
            sessions = book.execute("SELECT id, person, began_s, seen_s FROM session").fetchall()
        return [Person(row[0], Role(row[1]), row[2], row[3] or b"") for row in people], [
            Session(*row) for row in sessions
        ]

    def add(self, person: Person) -> None:
        """InputError for a name that is taken, or none."""
        check_name(person.name)
        with self._database.changed() as book:
            if book.execute("SELECT count(*) FROM person").fetchone()[0] >= MOST_PEOPLE:
                raise InputError(f"there are {MOST_PEOPLE} people already")
            try:
                row = (person.name, person.role.value, person.password, person.key or None)
                book.execute("INSERT INTO person VALUES (?, ?, ?, ?)", row)
            except sqlite3.IntegrityError:
                raise InputError(f"there is a {person.name} already") from None

    def set_role(self, name: str, role: Role) -> None:
        """It holds within a second, for those who are signed in, too.  InputError where there is nobody."""
        self._change(name, "UPDATE person SET role = ? WHERE name = ?", role.value)

    def set_password(self, name: str, password: str) -> None:
        """All sessions of the person end.  InputError where there is nobody."""
        self._change(name, "UPDATE person SET password = ? WHERE name = ?", password, ends=True)

    def set_key(self, name: str, key: bytes) -> None:
        """The key that was is void.  InputError where there is nobody."""
        self._change(name, "UPDATE person SET key = ? WHERE name = ?", key)

    def remove(self, name: str) -> None:
        """With all sessions.  InputError where there is nobody."""
        self._change(name, "DELETE FROM person WHERE name = ?", ends=True)

    def begin(self, session: Session, password: str) -> bool:
        """Keep a session, or begin it anew; False where the person's password, by its hash, is not that one
        any more."""
        with self._database.changed() as book:
            book.execute(
                "DELETE FROM session WHERE id IN"
                " (SELECT id FROM session ORDER BY seen_s DESC LIMIT -1 OFFSET ?)",
                (MOST_SESSIONS - 1,),
            )
            begun = book.execute(
                "INSERT OR REPLACE INTO session"
                " SELECT ?, name, ?, ? FROM person WHERE name = ? AND password = ?",
                (session.id, session.began_s, session.seen_s, session.person, password),
            )
            return begun.rowcount == 1

    def end(self, *sessions: bytes) -> None:
        """These sessions are over."""
        with self._database.changed() as book:
            book.executemany("DELETE FROM session WHERE id = ?", [(session,) for session in sessions])

    def note_seen(self, seen: dict[bytes, float]) -> None:
        """When each session was used last, UTC in s."""
        with self._database.changed() as book:
            book.executemany(
                "UPDATE session SET seen_s = max(seen_s, ?) WHERE id = ?",
                [(seen_s, session) for session, seen_s in seen.items()],
            )

    def _change(self, name: str, statement: str, *values: object, ends: bool = False) -> None:
        with self._database.changed() as book:
            if ends:
                book.execute("DELETE FROM session WHERE person = ?", (name,))
            if book.execute(statement, (*values, name)).rowcount == 0:
                raise InputError(f"there is no {name!r} here", remedy="see flightd ground people list")
