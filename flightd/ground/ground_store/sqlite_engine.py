"""The store in one SQLite file: nothing to install; write-ahead log, every commit through to the disk."""

from __future__ import annotations

import sqlite3
import threading
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from flightd.core.errors import InputError, UnavailableError
from flightd.ground.ground_store.connections import Connections
from flightd.ground.ground_store.engine import Row, Session

_APPLICATION = 0x666C7473
"""`flts`: SQLite's application id, so that another program's file is told apart."""
_REFUSED = (sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_READONLY)
"""By the disk; the lower byte of SQLite's extended codes."""
_CONNECTIONS = 4
_WAIT_S = 10.0
_CACHE_KB = 65_536


class SqliteSession:
    """A transaction of a connection."""

    def __init__(self, connection: sqlite3.Connection) -> None:
        self.connection = connection

    def rows(self, sql: str, *values: object) -> list[Row]:
        return self.connection.execute(sql, values).fetchall()

    def run(self, sql: str, *values: object) -> None:
        self.connection.execute(sql, values)

    def run_many(self, sql: str, rows: Sequence[Sequence[object]]) -> None:
        self.connection.executemany(sql, rows)


class SqliteEngine:
    """An `Engine`; the file is made when it is first used."""

    kind = "sqlite"

    def __init__(self, file: Path) -> None:
        self.shown = str(file)
        self._file = file
        self._connections = Connections(self._connected, _CONNECTIONS, _WAIT_S)
        self._turn = threading.Lock()

    def _connected(self) -> sqlite3.Connection:
        self._file.parent.mkdir(parents=True, exist_ok=True)
        connection = sqlite3.connect(
            self._file, timeout=_WAIT_S, isolation_level=None, check_same_thread=False
        )
        try:
            connection.execute("PRAGMA foreign_keys = ON")
            connection.execute("PRAGMA synchronous = FULL")
            connection.execute(f"PRAGMA cache_size = -{_CACHE_KB}")
            self._check_owner(connection)
            connection.execute("PRAGMA journal_mode = WAL")
        except BaseException:
            connection.close()
            raise
        return connection

    def _check_owner(self, connection: sqlite3.Connection) -> None:
        asked = ("PRAGMA application_id", "SELECT count(*) FROM sqlite_schema")
        application, tables = (connection.execute(question).fetchone()[0] for question in asked)
        if tables and application != _APPLICATION:
            raise InputError("a database, but no ground store", file=self._file, remedy="choose another file")

    @contextmanager
    def writing(self) -> Iterator[Session]:
        with self._turn, self._session("BEGIN IMMEDIATE") as session:
            yield session

    @contextmanager
    def reading(self) -> Iterator[Session]:
        with self._session("BEGIN") as session:
            yield session

    @contextmanager
    def _session(self, begin: str) -> Iterator[SqliteSession]:
        try:
            with self._connections.one() as connection:
                connection.execute(begin)
                yield SqliteSession(connection)  # where it raises, the connection is closed: rolled back
                connection.execute("COMMIT")
        except (OSError, sqlite3.OperationalError) as err:
            text = err.strerror if isinstance(err, OSError) else str(err)
            refused = isinstance(err, OSError) or getattr(err, "sqlite_errorcode", 0) & 0xFF in _REFUSED
            remedy = "may flightd write there?" if refused else ""
            raise UnavailableError(f"the store answers: {text}", file=self._file, remedy=remedy) from err
        except sqlite3.DatabaseError as err:
            raise InputError(f"no ground store, or a damaged one: {err}", file=self._file) from err

    def version(self, session: Session) -> int:
        return int(session.rows("PRAGMA user_version")[0][0])

    def set_version(self, session: Session, version: int) -> None:
        session.run(f"PRAGMA user_version = {version:d}")
        session.run(f"PRAGMA application_id = {_APPLICATION}")

    def script(self, session: Session, text: str) -> None:
        for statement in text.split(";\n"):
            session.run(statement)

    def make_room(self, session: Session, utc_ns: Iterable[int]) -> None:
        """One table holds them all."""

    def close(self) -> None:
        self._connections.close()
