"""The store on both engines; PostgreSQL is one cluster for all tests here."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import psycopg
import pytest

from flightd.ground.ground_store.engine import Engine
from flightd.ground.ground_store.evidence import Evidence, FolderEvidence, SharedEvidence
from flightd.ground.ground_store.postgres_engine import PostgresEngine
from flightd.ground.ground_store.sqlite_engine import SqliteEngine
from flightd.ground.ground_store.store import GroundStore
from tests.rigs.extras import of_extra
from tests.rigs.postgres import postgres
from tests.rigs.wms_exchange import Cuts, cut_exchanges, make_place


@pytest.fixture(scope="session")
def cluster() -> Iterator[str]:
    with postgres() as url:
        yield url


@pytest.fixture(params=["sqlite", "postgres"])
def engine(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Callable[[], Engine]]:
    """Opens the same empty database each time."""
    if request.param == "sqlite":
        yield lambda: SqliteEngine(tmp_path / "store.db")
        return
    url = request.getfixturevalue("cluster")
    with psycopg.connect(url, autocommit=True) as connection:
        connection.execute("DROP SCHEMA IF EXISTS flightd CASCADE")
    yield lambda: PostgresEngine(url)


@pytest.fixture
def pictures(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Evidence]:
    """Each engine has its own: a file a folder, PostgreSQL a bucket of S3."""
    if request.node.callspec.params["engine"] == "sqlite":
        yield FolderEvidence(tmp_path / "evidence")
        return
    of_extra("s3fs", "s3")
    from tests.rigs.s3_server import s3_server

    with s3_server() as url:
        yield SharedEvidence(f"{url}/pictures")


@pytest.fixture
def store(engine: Callable[[], Engine], tmp_path: Path) -> Iterator[GroundStore]:
    with GroundStore(engine(), FolderEvidence(tmp_path / "evidence")) as opened:
        yield opened


@pytest.fixture
def far_store(engine: Callable[[], Engine], tmp_path: Path) -> Iterator[GroundStore]:
    """One for which no time is to come."""
    evidence = FolderEvidence(tmp_path / "evidence")
    with GroundStore(engine(), evidence, lambda: (1 << 63) - 1) as opened:
        yield opened


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """A station and its drop folders."""
    return make_place(tmp_path)


@pytest.fixture
def cuts(monkeypatch: pytest.MonkeyPatch) -> Cuts:
    """Of every file system and every transaction of an exchange from now on."""
    return cut_exchanges(monkeypatch)
