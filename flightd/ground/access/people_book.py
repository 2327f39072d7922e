"""The people of a station and their sessions: a file in its state folder, of nobody's but its owner's.

It is changed by `flightd ground people` while the station runs, which reads it again each second.
"""

from __future__ import annotations

import os
import re
import sqlite3
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

from flightd.core.errors import InputError, UnavailableError
from flightd.ground.access.roles import Role

FILE = "people.db"
MOST_PEOPLE, MOST_SESSIONS = 1000, 4000
_APPLICATION, _VERSION = 0x666C7470, 1
"""`fltp`: SQLite's application id."""
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._@-]{0,59}")
_SCHEMA = (
    "CREATE TABLE person (name TEXT PRIMARY KEY COLLATE NOCASE, role TEXT NOT NULL, password TEXT NOT NULL,"
    " key BLOB UNIQUE) STRICT",
    "CREATE TABLE session (id BLOB PRIMARY KEY, person TEXT NOT NULL COLLATE NOCASE REFERENCES person"
    " ON DELETE CASCADE, began_s REAL NOT NULL, seen_s REAL NOT NULL) STRICT",
    f"PRAGMA application_id = {_APPLICATION}",
    f"PRAGMA user_version = {_VERSION}",
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
        self.file = state / FILE
        self._lock = threading.Lock()

    def people(self) -> list[Person]:
        """Everybody, by name."""
        return self.read()[0]

    def read(self) -> tuple[list[Person], list[Session]]:
        """Everybody and every session, at one moment."""
        if not self.file.exists():
            return [], []
        with self._opened() as book, _transaction(book):
            people = book.execute("SELECT name, role, password, key FROM person ORDER BY name").fetchall()
            sessions = book.execute("SELECT id, person, began_s, seen_s FROM session").fetchall()
        return [Person(row[0], Role(row[1]), row[2], row[3] or b"") for row in people], [
            Session(*row) for row in sessions
        ]

    def add(self, person: Person) -> None:
        """InputError for a name that is taken, or none."""
        if _NAME.fullmatch(person.name) is None:
            raise InputError(
                f"{person.name!r} is no name here",
                remedy="take up to 60 letters and digits, with . _ @ - between them",
            )
        with self._opened() as book, _transaction(book):
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
        """Keep a session; False where the person's password, by its hash, is not that one any more."""
        with self._opened() as book, _transaction(book):
            book.execute(
                "DELETE FROM session WHERE id IN"
                " (SELECT id FROM session ORDER BY seen_s DESC LIMIT -1 OFFSET ?)",
                (MOST_SESSIONS - 1,),
            )
            begun = book.execute(
                "INSERT INTO session SELECT ?, name, ?, ? FROM person WHERE name = ? AND password = ?",
                (session.id, session.began_s, session.seen_s, session.person, password),
            )
            return begun.rowcount == 1

    def end(self, *sessions: bytes) -> None:
        """These sessions are over."""
        with self._opened() as book, _transaction(book):
            book.executemany("DELETE FROM session WHERE id = ?", [(session,) for session in sessions])

    def note_seen(self, seen: dict[bytes, float]) -> None:
        """When each session was used last, UTC in s."""
        with self._opened() as book, _transaction(book):
            book.executemany(
                "UPDATE session SET seen_s = max(seen_s, ?) WHERE id = ?",
                [(seen_s, session) for session, seen_s in seen.items()],
            )

    def _change(self, name: str, statement: str, *values: object, ends: bool = False) -> None:
        with self._opened() as book, _transaction(book):
            if ends:
                book.execute("DELETE FROM session WHERE person = ?", (name,))
            if book.execute(statement, (*values, name)).rowcount == 0:
                raise InputError(f"there is no {name!r} here", remedy="see flightd ground people list")

    @contextmanager
    def _opened(self) -> Iterator[sqlite3.Connection]:
        with self._lock:
            try:
                make_private_file(self.file)
                with closing(sqlite3.connect(self.file, timeout=5.0, isolation_level=None)) as book:
                    book.execute("PRAGMA foreign_keys = ON")
                    book.execute("PRAGMA secure_delete = ON")
                    self._prepare(book)
                    yield book
            except (OSError, sqlite3.OperationalError) as err:
                raise UnavailableError(
                    f"{self.file}: {err.strerror if isinstance(err, OSError) else err}",
                    remedy="be the user that the station runs as, or name another --state DIR",
                ) from err
            except (sqlite3.DatabaseError, ValueError) as err:
                raise InputError(f"{self.file}: not the people of a ground station: {err}") from err

    def _prepare(self, book: sqlite3.Connection) -> None:
        """Make the tables where the file is new, all or nothing."""
        if self._is_empty(book):
            with _transaction(book):
                if self._is_empty(book):  # another process may have been quicker
                    for statement in _SCHEMA:
                        book.execute(statement)

    def _is_empty(self, book: sqlite3.Connection) -> bool:
        """InputError for what is not ours."""
        tables = book.execute("SELECT count(*) FROM sqlite_schema").fetchone()[0]
        kind = [book.execute(f"PRAGMA {of}").fetchone()[0] for of in ("application_id", "user_version")]
        if tables and kind != [_APPLICATION, _VERSION]:
            raise InputError(f"{self.file}: not the people of a ground station, or of another version")
        return not tables


def make_private_file(file: Path) -> None:
    """Make the file and its folder where they are not there, for the owner alone.  OSError."""
    if not file.exists():
        file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        os.close(os.open(file, os.O_RDWR | os.O_CREAT, 0o600))


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
