"""The store in PostgreSQL, in a schema `flightd` of its own; looks lie in a partition for each month."""

from __future__ import annotations

import math
import select
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from typing import Any, cast

import psycopg
from psycopg.abc import RV, PQGen
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
_WRITE_S = 60
"""At most for one statement, and between two: who hangs there keeps everybody from writing."""
_TURN_S = 20
"""At most until others have done.  Who delivers to a station waits for its answer for 30 s."""
_SILENT_S = 15
"""Beyond that, after which a server is given up that hangs and cannot say so."""
_HOST_GONE = {
    "keepalives": 1, "keepalives_idle": 10, "keepalives_interval": 5, "keepalives_count": 3,
    "tcp_user_timeout": 15_000,
}  # fmt: skip
"""A host that is gone without a word is noticed in 25 s (libpq's options in s, the last in ms)."""
_FIRST_YEAR, _LAST_YEAR = 2020, 2100
_NS = 1_000_000_000
_OPTIONS = f"-c search_path={_SCHEMA} -c client_min_messages=warning"


class BoundedConnection(psycopg.Connection[Row]):
    """Is closed where one answer takes more than `most_s`: a server that hangs keeps its network alive, and
    its own limits hang with it."""

    most_s = math.inf

    def wait(self, gen: PQGen[RV], *args: Any, **more: Any) -> RV:
        return super().wait(self._bounded(gen), *args, **more)

    def _bounded(self, gen: PQGen[RV]) -> PQGen[RV]:
        until_s = time.monotonic() + self.most_s
        try:
            asked = next(gen)
            while True:
                asked = gen.send((yield asked))
                if time.monotonic() > until_s:
                    self.close()
                    raise psycopg.OperationalError(f"nothing for {self.most_s:.0f} s: it hangs")
        except StopIteration as end:
            return cast("RV", end.value)


class PostgresSession:
    """A transaction of a connection."""

    def __init__(self, connection: BoundedConnection) -> None:
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
        self._connections: Connections[BoundedConnection] = Connections(
            self._connected, _CONNECTIONS, _WAIT_S, _is_alive
        )

    def _connected(self) -> BoundedConnection:
        asked = conninfo_to_dict(self._url)
        given: dict[str, Any] = {"connect_timeout": _CONNECT_S, "application_name": "flightd"}
        given |= {name: value for name, value in _HOST_GONE.items() if name not in asked}
        given["options"] = f"{asked.get('options') or ''} {_OPTIONS}".strip()
        return BoundedConnection.connect(self._url, autocommit=True, **given)

    @contextmanager
    def writing(self) -> Iterator[Session]:
        limits = {
            "statement_timeout": _WRITE_S,
            "lock_timeout": _TURN_S,
            "idle_in_transaction_session_timeout": _WRITE_S,
        }
        with self._session("BEGIN", limits) as session:
            session.run("SELECT pg_advisory_xact_lock(?)", _WRITER)
            yield session

    @contextmanager
    def reading(self) -> Iterator[Session]:
        begin = "BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY"
        with self._session(begin, {"statement_timeout": _READ_S}) as session:
            yield session

    @contextmanager
    def _session(self, begin: str, limits_s: Mapping[str, float]) -> Iterator[PostgresSession]:
        limits = "".join(f"; SET LOCAL {name} = '{round(s * 1000)}ms'" for name, s in limits_s.items())
        try:
            with self._connections.one() as connection:
                connection.most_s = limits_s["statement_timeout"] + _SILENT_S
                connection.execute(begin + limits)
                yield PostgresSession(connection)  # where it raises, the connection is closed: rolled back
                connection.execute("COMMIT")
        except psycopg.errors.LockNotAvailable as err:
            raise UnavailableError(
                f"others have kept the store locked for {_TURN_S} s", file=self.shown, remedy="try again"
            ) from err
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
        """However long it takes: the tables of years are brought up to date at once or not at all."""
        session.run("SET LOCAL statement_timeout = 0")
        if isinstance(session, PostgresSession):
            session.connection.most_s = math.inf
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


def _is_alive(connection: BoundedConnection) -> bool:
    """Nothing came from its server while nobody asked: that would be its end, or why it ended."""
    heard = select.poll()
    heard.register(connection.fileno(), select.POLLIN)
    return not heard.poll(0)


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
