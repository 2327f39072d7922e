"""The station's own SQLite files: told apart from another program's, made whole or not at all."""

from __future__ import annotations

import os
import sqlite3
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from flightd.core.errors import InputError, UnavailableError


@dataclass(frozen=True, slots=True, kw_only=True)
class OwnDatabase:
    """One `file`, made when it is first opened.  Safe from any thread and any process: it is open only while
    it is used.

    `holds` is what it holds, for a person; `application` and `version` are SQLite's ids by which it is known;
    `schema` are statements, `remedy` is what to do where the disk refuses.  A `private` one is its owner's
    alone, its folder, too, and what is deleted there is overwritten."""

    file: Path
    holds: str
    application: int
    version: int
    schema: str
    remedy: str = "may this station write there?"
    timeout_s: float = 2.0
    private: bool = False
    _lock: threading.Lock = field(default_factory=threading.Lock, init=False)

    @contextmanager
    def opened(self) -> Iterator[sqlite3.Connection]:
        """The file.  UnavailableError where the disk refuses, InputError for one that is another program's,
        or of another version."""
        with self._lock:
            try:
                if self.private:
                    make_private_file(self.file)
                with closing(
                    sqlite3.connect(self.file, timeout=self.timeout_s, isolation_level=None)
                ) as database:
                    database.execute("PRAGMA foreign_keys = ON")
                    if self.private:
                        database.execute("PRAGMA secure_delete = ON")
                    self._prepare(database)
                    yield database
            except (OSError, sqlite3.OperationalError) as err:
                text = err.strerror if isinstance(err, OSError) else err
                raise UnavailableError(f"{self.file}: {text}", remedy=self.remedy) from err
            except (sqlite3.DatabaseError, ValueError) as err:
                raise InputError(f"{self.file}: not {self.holds} of a ground station: {err}") from err

    @property
    def is_there(self) -> bool:
        """Asks the system itself: `Path.exists` raises for a folder that is another user's, or tells that
        there is nothing in it.  UnavailableError where the system does not say."""
        try:
            self.file.stat()
        except FileNotFoundError:
            return False
        except NotADirectoryError as err:
            raise UnavailableError(f"{self.file}: {err.strerror}", remedy="give a folder") from None
        except OSError as err:
            raise UnavailableError(f"{self.file}: {err.strerror}", remedy=self.remedy) from None
        return True

    @contextmanager
    def changed(self) -> Iterator[sqlite3.Connection]:
        """The file, and all that is done with it at once or not at all.  Errors as of `opened`."""
        with self.opened() as database, _transaction(database):
            yield database

    def _prepare(self, database: sqlite3.Connection) -> None:
        """Make the tables where the file is new: a power cut, or another process, may come in between."""
        with _transaction(database, "DEFERRED"):  # one look: whoever makes them now waits for its end
            is_new = self._is_empty(database)
        if is_new:
            with _transaction(database):
                if self._is_empty(database):
                    for statement in self.schema.split(";\n"):
                        database.execute(statement)
                    database.execute(f"PRAGMA application_id = {self.application}")
                    database.execute(f"PRAGMA user_version = {self.version}")

    def _is_empty(self, database: sqlite3.Connection) -> bool:
        """InputError for what is not ours."""
        asked = ("PRAGMA application_id", "PRAGMA user_version", "SELECT count(*) FROM sqlite_schema")
        application, version, tables = (database.execute(question).fetchone()[0] for question in asked)
        if tables and (application, version) != (self.application, self.version):
            raise InputError(f"{self.file}: not {self.holds} of a ground station, or of another version")
        return not tables


def make_private_file(file: Path) -> None:
    """Make the file and its folder where they are not there, for the owner alone.  OSError."""
    if not file.exists():
        file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        os.close(os.open(file, os.O_RDWR | os.O_CREAT, 0o600))


@contextmanager
def _transaction(database: sqlite3.Connection, kind: str = "IMMEDIATE") -> Iterator[None]:
    database.execute(f"BEGIN {kind}")
    try:
        yield
        database.execute("COMMIT")
    except BaseException:
        if database.in_transaction:
            database.execute("ROLLBACK")
        raise
