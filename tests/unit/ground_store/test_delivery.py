"""A delivery may be cut anywhere: nothing is lost, nothing is there twice, on both engines."""

from __future__ import annotations

import contextlib
import errno
import os
import random
import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path

import psycopg
import pytest

from flightd.adapters.store.sqlite import SqliteStore
from flightd.core.errors import UnavailableError
from flightd.core.inventory import PlannedLocation, Standing
from flightd.ground import stores
from flightd.ground.decision_book import Decided, Decision, DecisionBook
from flightd.ground.flights import log_folder
from flightd.ground.ground_store import sender
from flightd.ground.ground_store.deliver_folder import deliver_paths
from flightd.ground.ground_store.engine import Engine, Row, Session
from flightd.ground.ground_store.evidence import Evidence, FolderEvidence
from flightd.ground.ground_store.postgres_engine import PostgresSession
from flightd.ground.ground_store.sender import Delivered, deliver_inventory
from flightd.ground.ground_store.store import GroundStore
from tests.command import Command
from tests.unit.ground_store.store_rig import SITE, seen
from tests.web.stock_rig import RACKS, counted_store, flown_log, picture_of

CUTS = 200


class Cuts:
    """An engine whose connection breaks now and then: at any statement, just before a commit is asked for, or
    after it, so that nobody hears that it came to pass.  PostgreSQL's server process is ended for real."""

    def __init__(self, engine: Engine, draw: random.Random, each: int) -> None:
        self._engine = engine
        self._draw = draw
        self._each = each
        self.came = 0
        self.over = False

    def __getattr__(self, name: str) -> object:
        return getattr(self._engine, name)

    def cut(self, session: Session | None = None) -> None:
        if self.over or self._draw.randrange(self._each):
            return
        self.came += 1
        if isinstance(session, PostgresSession) and self._draw.random() < 0.3:
            with contextlib.suppress(psycopg.OperationalError):
                session.run("SELECT pg_terminate_backend(pg_backend_pid())")
            return  # the next statement fails
        raise UnavailableError("cut")

    @contextmanager
    def writing(self) -> Iterator[Session]:
        with self._engine.writing() as session:
            yield _CutSession(session, self)
            self.cut(session)
        self.cut()

    @contextmanager
    def reading(self) -> Iterator[Session]:
        with self._engine.reading() as session:
            yield _CutSession(session, self)


class _CutSession:
    def __init__(self, session: Session, cuts: Cuts) -> None:
        self._session = session
        self._cuts = cuts

    def rows(self, sql: str, *values: object) -> list[Row]:
        self._cuts.cut(self._session)
        return self._session.rows(sql, *values)

    def run(self, sql: str, *values: object) -> None:
        self._cuts.cut(self._session)
        self._session.run(sql, *values)

    def run_many(self, sql: str, rows: Sequence[Sequence[object]]) -> None:
        self._cuts.cut(self._session)
        self._session.run_many(sql, rows)


def same(store: GroundStore, inventory: SqliteStore) -> None:
    """The store holds what the inventory holds, each once and as it stands there."""
    looks = {look.id: standing for look, standing in inventory.looks()}
    assert store.standings(list(looks)) == looks
    assert store.counts()["looks"] == len(looks)
    rows = [
        row["id"]
        for code in {row["location"] for row in store.stock(SITE)}
        for row in store.history(SITE, code)
    ]
    assert sorted(rows) == sorted(looks)
    stands = {row["location"]: (row["state"], tuple(row["texts"])) for row in store.stock(SITE)}
    assert stands == {r.code: (r.state.value, r.texts) for r in inventory.locations()}
    names = {look.evidence for look, _ in inventory.looks() if look.evidence}
    assert store.missing_pictures(sorted(names)) == set()


def test_two_hundred_cuts_lose_nothing_and_double_nothing(
    engine: Callable[[], Engine], pictures: Evidence, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """While the drone goes on counting, confirming, withdrawing."""
    monkeypatch.setattr(sender, "MOST_LOOKS", 4)
    draw = random.Random(18)
    real = engine()
    store = GroundStore(real, pictures)
    cuts = Cuts(real, draw, each=14)
    store._engine = cuts  # type: ignore[assignment]  # noqa: SLF001
    number = 0
    with store, SqliteStore(tmp_path / "inventory") as inventory:
        inventory.plan([PlannedLocation("A-3", "A1"), PlannedLocation("B-1", "B1")])
        while cuts.came < CUTS:
            if number < 60:
                evidence = inventory.keep_evidence(b"\xff\xd8picture %d" % number) if number % 9 == 0 else ""
                inventory.commit(seen(number, evidence), confirmed=draw.random() < 0.6)
                inventory.settle(f"run {number // 10}", [f"A-{number % 10}"], confirmed=draw.random() < 0.7)
                number += 1
            elif not draw.randrange(8):  # another inventory comes by, and what was confirmed is withdrawn
                inventory._insert(draw.choice(inventory.looks())[0], Standing.WITHDRAWN)  # noqa: SLF001
            with contextlib.suppress(UnavailableError):
                deliver_inventory(tmp_path / "inventory", SITE, "north", store, Delivered())
        cuts.over = True
        deliver_inventory(tmp_path / "inventory", SITE, "north", store, Delivered())
        again = Delivered()
        deliver_inventory(tmp_path / "inventory", SITE, "north", store, again)
        assert (again.looks, again.changed, again.already) == (0, 0, number)
        same(store, inventory)


_CHILD = """
import sys
from pathlib import Path
from flightd.ground.ground_store import sender
from flightd.ground.ground_store.open_store import opened_store
from flightd.ground.ground_store.sender import Delivered, deliver_inventory
sender.MOST_LOOKS = 3
with opened_store(sys.argv[1], sys.argv[2]) as store:
    take = store.take
    def told(batch):
        taken = take(batch)
        print("taken", flush=True)
        return taken
    store.take = told
    deliver_inventory(Path(sys.argv[3]), "hall 3", "north", store, Delivered())
"""


@pytest.mark.parametrize("kind", ["sqlite", "postgres"])
def test_a_sender_that_is_killed_goes_on_where_it_was(
    kind: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    if kind == "sqlite":
        address = str(tmp_path / "store.db")
    else:
        address = request.getfixturevalue("cluster")
        with psycopg.connect(address, autocommit=True) as connection:
            connection.execute("DROP SCHEMA IF EXISTS flightd CASCADE")
    with SqliteStore(tmp_path / "inventory") as inventory:
        for number in range(60):
            inventory.commit(seen(number))
        command = [sys.executable, "-c", _CHILD, address, str(tmp_path / "pictures"), str(inventory.folder)]
        with subprocess.Popen(command, stdout=subprocess.PIPE) as child:
            assert child.stdout is not None
            for _ in range(7):
                assert child.stdout.readline() == b"taken\n"
            child.kill()
        with GroundStore(_engine_at(address), FolderEvidence(tmp_path / "pictures")) as store:
            had = store.counts()["looks"]
            assert 9 <= had < 60
            done = Delivered()
            deliver_inventory(inventory.folder, SITE, "north", store, done)
            assert (done.looks, done.already) == (60 - had, had)
            same(store, inventory)


def _engine_at(address: str) -> Engine:
    from flightd.ground.ground_store.postgres_engine import PostgresEngine
    from flightd.ground.ground_store.sqlite_engine import SqliteEngine

    return PostgresEngine(address) if "://" in address else SqliteEngine(Path(address))


def test_a_folder_is_delivered_with_flights_and_decisions(
    store: GroundStore, tmp_path: Path, recorded_flight: Path
) -> None:
    folder = tmp_path / "station"
    counted_store(folder / "monday")
    flown_log(folder / "monday" / "flight.mcap", RACKS)
    (folder / "tuesday.mcap").write_bytes((recorded_flight / "flight.mcap").read_bytes())
    decision = Decision("decision-1", "AL-01-1-1", 5, 4, Decided.PUT_RIGHT, "ann", "torn")
    DecisionBook(folder).add("monday", decision)
    done = Delivered()
    deliver_paths([folder], "", "station", store, done)
    assert (done.looks, done.pictures, done.flights, done.decisions) == (10, 1, 1, 1)
    assert done.failures == []
    assert [row["who"] for row in store.decisions(RACKS.name, "AL-01-1-1")] == ["ann"]
    flown = [flight for site in store.sites() for flight in store.flights(site["site"])]
    assert [flight["outcome"] for flight in flown] == ["completed"]
    (place,) = [row for row in store.stock(RACKS.name) if row["location"] == "AL-01-1-1"]
    assert store.evidence.picture(place["evidence"]) == picture_of("00340123450002439853")


def test_an_inventory_of_no_known_site_is_refused(store: GroundStore, tmp_path: Path) -> None:
    counted_store(tmp_path / "monday")
    (tmp_path / "empty").mkdir()
    done = Delivered()
    deliver_paths([tmp_path / "monday" / "inventory.db", tmp_path / "empty"], "", "station", store, done)
    assert done.failures == [
        f"{tmp_path}/monday: nothing says of which site the inventory is; deliver it with --site NAME, or"
        " FLIGHTD_SITE",
        f"{tmp_path}/empty: holds neither an inventory.db nor a flight log",
    ]
    assert store.counts()["looks"] == 0
    deliver_paths([tmp_path / "monday"], SITE, "station", store, Delivered())
    assert store.counts()["looks"] == 10


def test_a_log_that_is_named_and_holds_no_flight_is_told(
    store: GroundStore, tmp_path: Path, recorded_flight: Path
) -> None:
    empty, broken, flown = (tmp_path / f"{name}.mcap" for name in ("empty", "broken", "flown"))
    empty.write_bytes(b"")
    broken.write_bytes(b"no log at all, but long enough " * 50)
    shutil.copyfile(recorded_flight / "flight.mcap", flown)
    in_a_folder, named = Delivered(), Delivered()
    deliver_paths([tmp_path], "", "drone", store, in_a_folder)
    assert (in_a_folder.flights, in_a_folder.failures) == (1, [])
    deliver_paths([empty, broken, flown], "", "drone", store, named)
    assert named.flights == 1
    assert [line.partition(": ")[0] for line in named.failures] == [str(empty), str(broken)]
    assert "nothing was recorded" in named.failures[0]


def test_a_store_that_is_only_read_is_not_made_by_a_mistyped_name(flightd: Command, tmp_path: Path) -> None:
    file = tmp_path / "conuts.db"
    told = f"flightd: --store {file}: there is no such file; give that of one, or deliver into it\n"
    counted_store(tmp_path / "monday")
    for words in (("show",), ("export", "--out", tmp_path / "tables"), ("prune", tmp_path / "monday")):
        ended = flightd("store", *words, "--store", file)
        assert (ended.returncode, ended.stdout, ended.stderr) == (2, "", told)
    assert [path.name for path in tmp_path.iterdir()] == ["monday"]


def test_a_store_that_the_system_keeps_to_itself_is_not_told_as_missing(
    flightd: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, stat = tmp_path / "counts.db", Path.stat

    def kept_out(path: Path, **options: bool) -> os.stat_result:
        if path == file:
            raise PermissionError(errno.EACCES, "Permission denied")
        return stat(path, **options)

    monkeypatch.setattr(Path, "stat", kept_out)
    ended = flightd("store", "show", "--store", file)
    assert ended.returncode == 2
    assert ended.stderr == f"flightd: {file}: Permission denied; may flightd read file and folder?\n"


def test_a_site_is_a_name_of_one_line(flightd: Command, tmp_path: Path) -> None:
    counted_store(tmp_path / "monday")
    file = tmp_path / "counts.db"
    deliver = ("store", "deliver", tmp_path / "monday", "--store", file)
    for option in ("--site", "--source"):
        ended = flightd(*deliver, option, "hall\n3")
        assert ended.returncode == 2
        assert ended.stderr.startswith(f"flightd: {option} 'hall\\n3': is no name; ")
    assert not file.exists()
    assert flightd(*deliver, "--site", "Halle\N{NO-BREAK SPACE}3").returncode == 0


def test_an_inventory_says_itself_of_which_site_it_is(store: GroundStore, tmp_path: Path) -> None:
    counted_store(tmp_path / "monday")
    flown_log(tmp_path / "monday" / "flight.mcap", RACKS)
    with SqliteStore(tmp_path / "monday") as inventory:
        inventory.plan([], SITE)
    deliver_paths([tmp_path], "", "drone", store, Delivered())
    assert [site["site"] for site in store.sites()] == [SITE]


def test_one_inventory_that_cannot_be_delivered_keeps_no_other_back(flightd: Command, tmp_path: Path) -> None:
    for day in ("monday", "tuesday", "wednesday", "thursday"):
        counted_store(tmp_path / day)
        with SqliteStore(tmp_path / day) as inventory:
            inventory.plan([PlannedLocation(day, "A1")], SITE)
    (tmp_path / "tuesday" / "inventory.db").write_bytes(b"no database at all, but long enough " * 50)
    file = tmp_path / "wednesday" / "inventory.db"
    whole = file.read_bytes()
    file.write_bytes(whole[:16384] + b"\xff" * (len(whole) - 16384))
    ended = flightd("store", "deliver", tmp_path, "--store", tmp_path / "counts.db", "--site", SITE)
    assert ended.returncode == 1
    assert ended.stdout.startswith("10 looks delivered")
    told = sorted(ended.stderr.splitlines())
    assert [line.partition("inventory.db")[0] for line in told] == [
        f"flightd: {tmp_path}/tuesday/",
        f"flightd: {tmp_path}/wednesday/",
    ]
    with GroundStore(_engine_at(str(tmp_path / "counts.db")), FolderEvidence(tmp_path / "e")) as store:
        assert {"monday", "thursday"} <= {row["location"] for row in store.stock(SITE)}


def test_an_inventory_that_may_not_be_looked_at_keeps_no_other_back(
    store: GroundStore, tmp_path: Path
) -> None:
    folder = tmp_path / "drone"
    for day in ("monday", "tuesday", "wednesday"):
        counted_store(folder / day)
        with SqliteStore(folder / day) as inventory:
            inventory.plan([PlannedLocation(day, "A1")], SITE)
        DecisionBook(folder).add(day, Decision(f"of {day}", day, 5, 4, Decided.FINE, "ann"))
    (folder / "tuesday" / "inventory.db-wal").symlink_to(tmp_path / "elsewhere")
    done = Delivered()
    deliver_paths([folder], "", "drone", store, done)
    assert done.failures == ["the inventory 'tuesday' has a inventory.db-wal that is no plain file"]
    assert {"monday", "wednesday"} <= {row["location"] for row in store.stock(SITE)}
    assert done.decisions == 2


def test_a_file_of_decisions_that_cannot_be_read_is_told_and_the_rest_delivered(
    store: GroundStore, tmp_path: Path
) -> None:
    folder = tmp_path / "drone"
    counted_store(folder)
    book = DecisionBook(folder)
    book.add(".", Decision("decision-1", "A-GATE", 5, 4, Decided.FINE, "ann"))
    done = Delivered()
    with closing(sqlite3.connect(folder / "ground.db")) as other:
        other.execute("ALTER TABLE decision RENAME TO elsewhere")
    deliver_paths([folder, folder / "inventory.db"], SITE, "drone", store, done)
    assert [line.partition("ground.db")[0] for line in done.failures] == [f"{folder}/"]
    assert (done.looks, done.already) == (10, 10)


def test_a_store_that_cannot_be_had_ends_the_delivery_though_it_lies_in_the_folder(tmp_path: Path) -> None:
    """Its error begins with the path of the folder, as an inventory's does."""
    counted_store(tmp_path)
    with GroundStore(_engine_at(str(tmp_path / "counts.db")), FolderEvidence(tmp_path / "e")) as store:
        (tmp_path / "e").write_bytes(b"no folder")
        with pytest.raises(UnavailableError, match="cannot keep the picture"):
            deliver_paths([tmp_path], SITE, "drone", store, Delivered())


def test_however_many_folders_there_are_each_inventory_is_delivered(
    store: GroundStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stores, "_MOST_STORES", 2)
    monkeypatch.setattr(stores, "_MOST_FOLDERS", 3)
    deep = tmp_path / "a" / "b" / "c" / "d" / "e"
    for number, folder in enumerate([*(tmp_path / f"hall {n}" for n in range(4)), deep]):
        with SqliteStore(folder) as inventory:
            inventory.plan([], SITE)
            inventory.commit(seen(number))
    monkeypatch.setattr(log_folder, "MOST_LOGS", 1)
    for name in ("one", "two"):
        flown_log(tmp_path / f"{name}.mcap", RACKS)
    done = Delivered()
    deliver_paths([tmp_path], "", "station", store, done)
    assert done.looks == 5
    assert done.failures == [f"{tmp_path}: {log_folder.CUT}; deliver the folders in it one by one"]
