"""A database that is gone, hangs, is locked or was started anew; and the partitions of its looks."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from datetime import UTC, datetime
from functools import partial

import pytest

from flightd.core.errors import UnavailableError
from flightd.ground.ground_store import postgres_engine
from flightd.ground.ground_store.engine import Engine
from flightd.ground.ground_store.postgres_engine import PostgresEngine, PostgresSession
from flightd.ground.ground_store.store import GroundStore
from tests.unit.ground_store.store_rig import DAY, NS, batch, look, rows_of


@pytest.mark.parametrize("engine", ["postgres"], indirect=True)
def test_a_host_of_the_database_that_is_gone_is_noticed(
    engine: Callable[[], Engine], cluster: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(postgres_engine, "_READ_S", 0.05)
    opened = engine()
    with pytest.raises(UnavailableError, match="statement timeout"), opened.reading() as session:
        session.rows("SELECT pg_sleep(60)")
    opened.close()
    for url, idle in ((cluster, "10"), (f"{cluster}&keepalives_idle=99", "99")):
        opened = PostgresEngine(url)
        with opened.writing() as session:
            assert isinstance(session, PostgresSession)
            asked = session.connection.info.get_parameters()
        assert (asked["keepalives_idle"], asked["tcp_user_timeout"]) == (idle, "15000")
        opened.close()


def _hangs(session: PostgresSession, statement: Callable[[], object]) -> None:
    """Its server does not run meanwhile."""
    ((server,),) = session.rows("SELECT pg_backend_pid()")
    session.connection.most_s = 0.05
    os.kill(server, signal.SIGSTOP)
    try:
        statement()
    finally:
        os.kill(server, signal.SIGCONT)


@pytest.mark.parametrize("engine", ["postgres"], indirect=True)
@pytest.mark.parametrize("many", [False, True])
def test_a_database_that_hangs_is_given_up(engine: Callable[[], Engine], many: bool) -> None:
    opened = engine()
    hangs = pytest.raises(UnavailableError, match=r"the store answers: nothing for 0 s: it hangs$")
    with hangs, opened.writing() as session:
        assert isinstance(session, PostgresSession)
        assert session.connection.most_s == 75
        one, two = partial(session.rows, "SELECT 1"), partial(session.run_many, "SELECT ?", [(1,), (2,)])
        _hangs(session, two if many else one)
    with opened.writing() as session:
        assert session.rows("SELECT 1") == [(1,)]
    opened.close()


@pytest.mark.parametrize("engine", ["postgres"], indirect=True)
def test_nobody_waits_to_write_for_ever(
    engine: Callable[[], Engine], monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = engine(), engine()
    limits = "statement_timeout", "lock_timeout", "idle_in_transaction_session_timeout"
    asked = "SELECT " + ", ".join(f"current_setting('{name}')" for name in limits)
    with first.writing() as session:
        assert session.rows(asked) == [("1min", "20s", "1min")]
        first.script(session, "SELECT 1")
        assert session.rows(asked) == [("0", "20s", "1min")], "a migration takes what it takes"
        monkeypatch.setattr(postgres_engine, "_TURN_S", 0.05)
        waited = pytest.raises(UnavailableError, match=r"have kept the store locked for 0\.05 s; try again$")
        with waited, second.writing():
            pytest.fail("two write at once")
    with second.writing() as session:
        assert session.rows(asked)[0][0] == "1min"
    first.close()
    second.close()


@pytest.mark.parametrize("engine", ["postgres"], indirect=True)
def test_a_database_that_was_started_anew_is_asked_at_once(engine: Callable[[], Engine]) -> None:
    opened, other = engine(), engine()
    with opened.reading() as first, opened.reading() as second:
        servers = [session.rows("SELECT pg_backend_pid()")[0][0] for session in (first, second)]
    with other.reading() as session:
        for server in servers:
            assert session.rows("SELECT pg_terminate_backend(?, 30000)", server) == [(True,)]
    with opened.writing() as session:
        assert session.rows("SELECT pg_backend_pid()")[0][0] not in servers
    opened.close()
    other.close()


@pytest.mark.parametrize("engine", ["postgres"], indirect=True)
def test_looks_lie_in_the_partition_of_their_month(
    far_store: GroundStore, engine: Callable[[], Engine]
) -> None:
    november_ns = int(datetime(2025, 11, 1, tzinfo=UTC).timestamp()) * NS
    times = (november_ns - 1, november_ns, november_ns + DAY, 5, (1 << 63) - 1)
    for n, at_ns in enumerate(times):
        far_store.take(batch(look(f"A-{n}", at_ns=at_ns)))
    where = rows_of(
        engine(),
        "SELECT place.code, observation.tableoid::regclass::text FROM observation"
        " JOIN place ON place.id = observation.place ORDER BY place.code",
    )
    assert where == [
        ("A-0", "observation_2025_10"), ("A-1", "observation_2025_11"), ("A-2", "observation_2025_11"),
        ("A-3", "observation_before_2020"), ("A-4", "observation_beyond"),
    ]  # fmt: skip
    bounds = f"utc_ns >= {november_ns} AND utc_ns < {november_ns + DAY}"
    plan = rows_of(engine(), f"EXPLAIN SELECT id FROM observation WHERE {bounds}")
    asked = " ".join(str(line) for (line,) in plan)
    assert "observation_2025_11" in asked
    assert not {"observation_2025_10", "observation_beyond"} & set(asked.split())
