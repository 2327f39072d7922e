"""A station feeds its ground store what changes in its folders, and is kept from it by nothing for long."""

from __future__ import annotations

import errno
import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from flightd.adapters.store import for_reading
from flightd.adapters.store.sqlite import SqliteStore
from flightd.core.errors import UnavailableError
from flightd.core.inventory import LocationState
from flightd.ground.decision_book import Decided, Decision, DecisionBook
from flightd.ground.flights import flight_row, log_folder
from flightd.ground.ground_store import feeder as feeding
from flightd.ground.ground_store.batch import Batch
from flightd.ground.ground_store.feeder import Feeder
from flightd.ground.ground_store.open_store import opened_store
from flightd.ground.ground_store.sender import deliver_inventory
from flightd.ground.ground_store.store import GroundStore
from tests.web.stock_rig import RACKS, counted_hall, counted_store, flown_log, look

SITE = RACKS.name


@pytest.fixture
def hall(tmp_path: Path) -> Path:
    """The station's folder with an inventory, a later run in it."""
    return counted_hall(tmp_path / "hall")


def test_the_station_feeds_what_changes_and_no_more(
    hall: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    state = tmp_path / "state"
    state.mkdir()
    lines = [
        {"time": "2026-11-26T02:00:00.000000Z", "person": "ann", "act": "start", "n": n} for n in range(3)
    ]
    (state / "audit.jsonl").write_text("".join(f"{json.dumps(line)}\n" for line in lines) + '{"cut')
    with opened_store(str(tmp_path / "store.db")) as store:
        feeder = Feeder(store, hall, (), state)
        feeder.feed()
        assert (store.counts()["looks"], store.counts()["audit"]) == (10, 3)
        taken: list[Batch] = []
        take: Callable[[Batch], object] = store.take

        def noted(batch: Batch) -> object:
            taken.append(batch)
            return take(batch)

        monkeypatch.setattr(store, "take", noted)
        feeder.feed()
        assert taken == []
        (state / "audit.jsonl").rename(state / "audit.jsonl.1")
        (state / "audit.jsonl").write_text(json.dumps(lines[0] | {"n": 9}) + "\n")
        os.utime(hall / "monday" / "inventory.db", ns=(1, 1))
        DecisionBook(hall).add("monday", Decision("decision-2", "A-GATE", 5, 4, Decided.OPEN, "ann"))
        feeder.feed()
        assert store.counts()["audit"] == 4
        assert [one["what"] for one in store.decisions(SITE, "A-GATE")] == ["open"]
        assert store.counts()["looks"] == 10


def test_lines_of_the_audit_are_fed_though_a_file_gets_the_inode_of_an_older_one(tmp_path: Path) -> None:
    state = tmp_path / "state"
    state.mkdir()
    file, aside, older = (state / name for name in ("audit.jsonl", "audit.jsonl.1", "older"))

    def write(*numbers: int) -> None:
        file.write_text("".join(f'{{"person": "ann", "n": {n}}}\n' for n in numbers))

    with opened_store(str(tmp_path / "store.db")) as store:
        feeder = Feeder(store, None, (), state)
        write(1, 2, 3)
        feeder.feed()
        file.rename(aside)
        write(4)
        feeder.feed()
        inode = aside.rename(older).stat().st_ino
        file.rename(aside)
        older.rename(file)
        write(5)
        assert file.stat().st_ino == inode
        feeder.feed()
        assert store.counts()["audit"] == 5


def test_a_flight_that_was_cut_off_is_fed_though_its_log_never_changes_again(
    tmp_path: Path, recorded_flight: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = tmp_path / "hall" / "flight.mcap"
    log.parent.mkdir()
    whole = (recorded_flight / "flight.mcap").read_bytes()
    log.write_bytes(whole[: len(whole) // 2])
    with opened_store(str(tmp_path / "store.db")) as store:
        feeder = Feeder(store, log.parent, (), tmp_path / "state")
        feeder.feed()
        assert store.counts()["flights"] == 0, "it may be written still"
        monkeypatch.setattr(flight_row, "_RUNNING_S", 0.0)  # as time goes by
        feeder.feed()
        assert store.counts()["flights"] == 1
        monkeypatch.undo()
        other = log.with_name("other.mcap")
        other.write_bytes(whole[: len(whole) // 3])
        os.utime(other, (4e9, 4e9))
        feeder.feed()
        (flight,) = [row for site in store.sites() for row in store.flights(site["site"])]
        assert flight["outcome"] == "unfinished"


def test_older_inventories_are_fed_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for number, day in enumerate(("a", "c", "b")):
        counted_store(tmp_path / "hall" / day)
        flown_log(tmp_path / "hall" / day / "flight.mcap", RACKS)
        os.utime(tmp_path / "hall" / day / "inventory.db", (1e9 + number,) * 2)
    fed: list[str] = []
    monkeypatch.setattr(feeding, "deliver_inventory", lambda folder, *_: fed.append(folder.name))
    with opened_store(str(tmp_path / "store.db")) as store:
        Feeder(store, tmp_path / "hall", (), tmp_path / "state").feed()
    assert fed == ["a", "c", "b"]


@pytest.mark.parametrize("failure", [UnavailableError("away"), OverflowError("too large")])
def test_a_store_that_is_away_is_fed_when_it_is_back(
    hall: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    failure: Exception,
) -> None:
    def away(_: GroundStore, batch: Batch) -> None:
        raise failure

    with opened_store(str(tmp_path / "store.db")) as store:
        feeder = Feeder(store, hall, (), tmp_path / "state")
        with monkeypatch.context() as meanwhile:
            meanwhile.setattr(GroundStore, "take", away)
            feeder.feed()
            feeder.feed()
        told = [record.getMessage() for record in caplog.records]
        assert len([line for line in told if "inventory monday: not in the ground store" in line]) == 1
        feeder.feed()
        assert store.counts()["looks"] == 10


def test_an_inventory_of_a_clock_that_is_ahead_is_not_read_again_all_the_time(
    hall: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ahead = look("A-GATE", LocationState.EMPTY, at_s=2_000_000_000)
    with SqliteStore(hall / "monday") as inventory:
        inventory.commit(ahead)
    opened: list[Path] = []

    def noted(folder: Path, *more: Any) -> None:
        opened.append(folder)
        deliver_inventory(folder, *more)

    monkeypatch.setattr(feeding, "deliver_inventory", noted)
    now_s = 0.0
    with opened_store(str(tmp_path / "store.db")) as store:
        feeder = Feeder(store, hall, (), tmp_path / "state", lambda: now_s)
        feeder.feed()
        now_s = 599.0
        feeder.feed()
        assert (len(opened), store.counts()["looks"]) == (1, 10)
        now_s = 600.0
        feeder.feed()
        assert len(opened) == 2
        with SqliteStore(hall / "monday") as inventory:
            inventory.contradict(ahead.run, ["A-GATE"])
        feeder.feed()
        assert (len(opened), store.counts()["looks"]) == (3, 11)


def test_neither_a_bad_inventory_nor_damaged_decisions_keep_the_others_from_the_store(
    hall: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    for day in ("sunday", "tuesday"):
        shutil.copytree(hall / "monday", hall / day)
        (hall / day / "inventory.db-wal").symlink_to(tmp_path / "elsewhere")
    (hall / "ground.db").write_bytes(b"no database at all, but long enough " * 50)
    with opened_store(str(tmp_path / "store.db")) as store:
        feeder = Feeder(store, hall, (), tmp_path / "state")
        feeder.feed()
        feeder.feed()
        assert store.counts()["looks"] == 10
    told = [record.getMessage().partition(": not in the ground store: ")[0] for record in caplog.records]
    assert sorted(told) == ["decisions about monday", "inventory sunday", "inventory tuesday"]


def _cut_off(folder: Path, cut: Path) -> None:
    """As a power cut leaves an inventory, of the site `hall 9`."""
    with SqliteStore(folder) as inventory:
        inventory.plan([], "hall 9")
        cut.mkdir()
        for part in ("", "-wal"):
            shutil.copy(folder / f"inventory.db{part}", cut)
    for kept in cut.iterdir():
        shutil.copy(kept, folder)


@pytest.mark.parametrize("is_cut_off", [False, True])
def test_an_inventory_for_which_there_is_no_room_is_not_copied_all_the_time(
    hall: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_cut_off: bool
) -> None:
    if is_cut_off:  # where it is copied to be asked for its site
        _cut_off(hall / "monday", tmp_path / "cut")
    copies: list[Path] = []

    def no_room(file: Path, _: Path) -> None:
        copies.append(file)
        raise OSError(errno.ENOSPC, "No space left on device")

    now_s = 0.0
    with opened_store(str(tmp_path / "store.db")) as store:
        feeder = Feeder(store, hall, (), tmp_path / "state", lambda: now_s)
        with monkeypatch.context() as full:
            full.setattr(shutil, "copyfile", no_room)
            for now_s, made in ((0.0, 1), (10.0, 1), (599.0, 1), (600.0, 2), (610.0, 2)):
                os.utime(hall / "monday" / "inventory.db", (1e9 + now_s,) * 2)  # as a flight does
                feeder.feed()
                assert len(copies) == made
        now_s = 1200.0
        feeder.feed()
        assert store.counts()["looks"] == 10


def test_an_inventory_that_cannot_be_read_now_is_not_taken_for_one_of_the_log_beside_it(
    hall: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _cut_off(hall / "monday", tmp_path / "cut")
    now_s = 0.0
    with opened_store(str(tmp_path / "store.db")) as store:
        feeder = Feeder(store, hall, (), tmp_path / "state", lambda: now_s)
        with monkeypatch.context() as busy:
            busy.setattr(for_reading, "_TRIES", 0)
            feeder.feed()
        assert store.sites() == []
        now_s = 600.0
        feeder.feed()
        assert store.sites() == [{"site": "hall 9"}]


def test_a_station_says_what_of_its_folders_is_not_in_its_store(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    hall = tmp_path / "hall"
    counted_store(hall / "monday")
    for number in range(2):
        flown_log(hall / f"{number}.mcap", RACKS)
    monkeypatch.setattr(log_folder, "MOST_LOGS", 1)
    with opened_store(str(tmp_path / "store.db")) as store:
        feeder = Feeder(store, hall, (), tmp_path / "state")
        for _ in range(2):
            feeder.feed()
        told = [record.getMessage() for record in caplog.records]
        assert [line.partition(": not in the ground store: ")[0] for line in told] == [
            "inventory monday", "flights",
        ]  # fmt: skip
        assert "monday: nothing says of which site the inventory is" in told[0]
        assert "more lies there than" in told[1]
        with SqliteStore(hall / "monday") as inventory:
            inventory.plan([], SITE)
        feeder.feed()
        assert store.counts()["looks"] == 10
