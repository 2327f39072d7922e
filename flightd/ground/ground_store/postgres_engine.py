"""The store in PostgreSQL, in a schema `flightd` of its own; looks lie in a partition for each month."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from typing import Any

import psycopg
from psycopg.conninfo import conninfo_to_dict

from flightd.core.errors import InputError, UnavailableError
from flightd.ground.ground_store.connections import Connections
from flightd.ground.ground_store.engine import Row, Session

_SCHEMA = "flightd"
_WRITER = 0x666C7473
"""The advisory lock of the one who writes."""
_CONNECTIONS = 4
_WAIT_S = 10.0
_CONNECT_S = 5
_READ_S = 60
"""At most for one question; any page takes parts of a second."""
_HOST_GONE = {
    "keepalives": 1, "keepalives_idle": 10, "keepalives_interval": 5, "keepalives_count": 3,
    "tcp_user_timeout": 15_000,
}  # fmt: skip
"""A host that is gone without a word is noticed in 25 s (libpq's options in s, the last in ms)."""
_FIRST_YEAR, _LAST_YEAR = 2020, 2100
_NS = 1_000_000_000
_OPTIONS = f"-c search_path={_SCHEMA} -c client_min_messages=warning"


class PostgresSession:
    """A transaction of a connection."""

    def __init__(self, connection: psycopg.Connection[Row]) -> None:
        self.connection = connection

    def rows(self, sql: str, *values: object) -> list[Row]:
        return self._done(sql, values).fetchall()

    def run(self, sql: str, *values: object) -> None:
        self._done(sql, values)

    def run_many(self, sql: str, rows: Sequence[Sequence[object]]) -> None:
        with self.connection.cursor() as cursor:
            cursor.executemany(_psycopg(sql), rows)  # pipelined

    def _done(self, sql: str, values: Sequence[object]) -> psycopg.Cursor[Row]:
        return self.connection.execute(_psycopg(sql), values or None)


class PostgresEngine:
    """An `Engine` at a `postgresql://` URL; the schema is made when it is first used."""

    kind = "postgres"

    def __init__(self, url: str) -> None:
        """InputError for what is no URL of PostgreSQL."""
        self._url = url
        try:
            parts = conninfo_to_dict(url)
        except psycopg.Error:  # its words may hold the password
            raise InputError(
                "not a URL of PostgreSQL", key="--store", remedy="give postgresql://USER@HOST/DATABASE"
            ) from None
        self.shown = f"postgresql://{parts.get('host') or ''}/{parts.get('dbname') or ''}"
        self._connections: Connections[psycopg.Connection[Row]] = Connections(
            self._connected, _CONNECTIONS, _WAIT_S
        )

    def _connected(self) -> psycopg.Connection[Row]:
        asked = conninfo_to_dict(self._url)
        given: dict[str, Any] = {"connect_timeout": _CONNECT_S, "application_name": "flightd"}
        given |= {name: value for name, value in _HOST_GONE.items() if name not in asked}
        given["options"] = f"{asked.get('options') or ''} {_OPTIONS}".strip()
        return psycopg.connect(self._url, autocommit=True, **given)

    @contextmanager
    def writing(self) -> Iterator[Session]:
        with self._session("BEGIN") as session:
            session.run("SELECT pg_advisory_xact_lock(?)", _WRITER)
            yield session

    @contextmanager
    def reading(self) -> Iterator[Session]:
        begin = "BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY"
        with self._session(f"{begin}; SET LOCAL statement_timeout = '{_READ_S}s'") as session:
            yield session

    @contextmanager
    def _session(self, begin: str) -> Iterator[PostgresSession]:
        try:
            with self._connections.one() as connection:
                connection.execute(begin)
                yield PostgresSession(connection)  # where it raises, the connection is closed: rolled back
                connection.execute("COMMIT")
        except psycopg.Error as err:
            text = str(err).strip().partition("\n")[0] or type(err).__name__
            raise UnavailableError(f"the store answers: {text}", file=self.shown) from err

    def version(self, session: Session) -> int:
        session.run(f"CREATE SCHEMA IF NOT EXISTS {_SCHEMA}")
        session.run("CREATE TABLE IF NOT EXISTS version (version INTEGER NOT NULL)")
        found = session.rows("SELECT max(version) FROM version")
        return int(found[0][0] or 0)

    def set_version(self, session: Session, version: int) -> None:
        session.run("DELETE FROM version")
        session.run("INSERT INTO version VALUES (?)", version)

    def script(self, session: Session, text: str) -> None:
        session.run(text)

    def make_room(self, session: Session, utc_ns: Iterable[int]) -> None:
        """The partitions of their months, where they are not there yet."""
        months = sorted({month for ns in utc_ns if (month := _month(ns)) is not None})
        for year, number in months:
            table = f"observation_{year}_{number:02}"
            if session.rows("SELECT to_regclass(?)", f"{_SCHEMA}.{table}")[0][0] is None:
                begin, end = _begin_ns(year, number), _begin_ns(year + number // 12, number % 12 + 1)
                session.run(
                    f"CREATE TABLE {table} PARTITION OF observation FOR VALUES FROM ({begin}) TO ({end})"
                )

    def close(self) -> None:
        self._connections.close()


def _psycopg(sql: str) -> Any:
    return sql.replace("?", "%s")


def _month(utc_ns: int) -> tuple[int, int] | None:
    """Year and month; None where no partition of its own is made."""
    if not _begin_ns(_FIRST_YEAR, 1) <= utc_ns < _begin_ns(_LAST_YEAR, 1):
        return None
    at = datetime.fromtimestamp(utc_ns // _NS, UTC)
    return at.year, at.month


def _begin_ns(year: int, month: int) -> int:
    return int(datetime(year, month, 1, tzinfo=UTC).timestamp()) * _NS
