"""An inventory is delivered in bounded parts; what cannot be sent keeps nothing else back, and is told."""

from __future__ import annotations

import os
import tempfile
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest

from flightd.adapters.store.kept_looks import KeptLook
from flightd.adapters.store.sqlite import SqliteStore
from flightd.core.errors import InputError, UnavailableError
from flightd.core.inventory import Observation, PlannedLocation, Standing
from flightd.core.types import CodeRead
from flightd.ground.ground_store import sender
from flightd.ground.ground_store.batch import MOST_BATCH_BYTES, Batch, Receipt
from flightd.ground.ground_store.engine import Engine
from flightd.ground.ground_store.evidence import FolderEvidence
from flightd.ground.ground_store.prune import prune
from flightd.ground.ground_store.sender import Delivered, deliver_inventory
from flightd.ground.ground_store.station_target import StationTarget
from flightd.ground.ground_store.store import GroundStore
from tests.unit.ground_store.store_rig import BEGIN, NS, SITE, seen
from tests.web.stock_rig import counted_store


def test_a_batch_is_never_larger_than_a_station_takes(
    store: GroundStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with SqliteStore(tmp_path / "inventory") as inventory:
        for number in range(300):
            read = CodeRead("QR Code", f"{number}" + "x" * 30_000, (), True, 3, 1.0)
            inventory.commit(replace(seen(1), utc_ns=BEGIN + number, reads=(read,)))
    sizes = []
    take = store.take

    def taken(batch: Batch) -> Receipt:
        sizes.append(len(msgspec.json.encode(batch)))
        return take(batch)

    monkeypatch.setattr(store, "take", taken)
    done = Delivered()
    deliver_inventory(tmp_path / "inventory", SITE, "north", store, done)
    assert done.looks == 300
    assert MOST_BATCH_BYTES / 2 < max(sizes) <= MOST_BATCH_BYTES


def test_looks_are_loaded_a_batch_at_a_time_and_those_that_the_store_has_not_at_all(
    store: GroundStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sender, "MOST_LOOKS", 10)
    with SqliteStore(tmp_path / "inventory") as inventory:
        for number in range(35):
            inventory.commit(seen(number))
    loaded: list[int] = []
    load = SqliteStore.loaded

    def told(inventory: SqliteStore, looks: Sequence[KeptLook]) -> list[tuple[Observation, Standing]]:
        loaded.append(len(looks))
        return load(inventory, looks)

    monkeypatch.setattr(SqliteStore, "loaded", told)
    for name in ("looks", "locations"):  # all at once
        monkeypatch.delattr(SqliteStore, name)
    for batches in ([10, 10, 10, 5], [0, 0, 0, 0]):
        loaded.clear()
        deliver_inventory(tmp_path / "inventory", SITE, "north", store, Delivered())
        assert loaded == batches
    loaded.clear()
    assert prune(tmp_path / "inventory", store).looks == 25
    assert loaded == []


def test_no_inventory_is_copied_for_a_store_that_is_away(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    counted_store(tmp_path / "monday")
    copies = tmp_path / "copies"
    copies.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(copies))
    made_ns = copies.stat().st_mtime_ns
    done = Delivered()
    with pytest.raises(UnavailableError, match="the station cannot be had"):
        deliver_inventory(tmp_path / "monday", SITE, "north", StationTarget("http://127.0.0.1:1", "k"), done)
    assert copies.stat().st_mtime_ns == made_ns


def test_one_picture_that_is_damaged_or_cannot_be_read_keeps_no_other_look_back(
    store: GroundStore, tmp_path: Path
) -> None:
    with SqliteStore(tmp_path / "inventory") as inventory:
        for number in range(12):
            inventory.commit(seen(number, inventory.keep_evidence(b"\xff\xd8%d" % number)))
        looks = [look for look, _ in inventory.looks()]
    zeroed, large, unread, gone, pipe = (inventory.evidence.path(look.evidence) for look in looks[:5])
    zeroed.write_bytes(bytes(20))  # what a worn card makes of it
    large.write_bytes(bytes(60_000))
    unread.unlink()
    unread.mkdir()
    gone.unlink()
    pipe.unlink()
    os.mkfifo(pipe)
    done = Delivered()
    deliver_inventory(inventory.folder, SITE, "north", store, done)
    assert sorted(done.failures) == sorted(
        [
            *(
                f"{path}: the picture is damaged; its look is delivered without it"
                for path in (zeroed, large, pipe)
            ),
            f"{unread}: Is a directory; its look waits for it",
        ]
    )
    assert (done.looks, done.pictures) == (11, 7)
    unread.rmdir()
    unread.write_bytes(b"\xff\xd82")
    again = Delivered()
    deliver_inventory(inventory.folder, SITE, "north", store, again)
    assert (again.looks, again.pictures, again.failures) == (1, 1, [])


def test_pictures_are_asked_for_in_parts_that_are_answered_in_time(
    store: GroundStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[int] = []
    missing = store.missing_pictures

    def noted(names: Sequence[str]) -> set[str]:
        asked.append(len(names))
        return missing(names)

    monkeypatch.setattr(store, "missing_pictures", noted)
    with SqliteStore(tmp_path / "inventory") as inventory:
        for number in range(120):
            inventory.commit(seen(number, inventory.keep_evidence(b"\xff\xd8%d" % number)))
        done = Delivered()
        deliver_inventory(inventory.folder, SITE, "north", store, done)
        assert (done.pictures, asked) == (120, [50, 50, 20])
        assert prune(inventory.folder, store).stay == 0
        assert asked[3:] == [50, 50, 10]


def test_pictures_far_away_are_looked_for_together(store: GroundStore) -> None:
    together = threading.Barrier(4, timeout=30.0)

    class Far(FolderEvidence):
        def has(self, name: str) -> bool:
            together.wait()
            return name < "4"

    store.evidence = Far(Path("unused"))
    assert store.missing_pictures([f"{n}" for n in range(8)]) == {"4", "5", "6", "7"}


def test_what_a_clock_that_is_ahead_counted_stays_at_the_drone_and_is_told(
    engine: Callable[[], Engine], tmp_path: Path
) -> None:
    with (
        GroundStore(engine(), FolderEvidence(tmp_path), lambda: BEGIN + 30 * 86_400 * NS) as store,
        SqliteStore(tmp_path / "inventory") as inventory,
    ):
        for number in range(25):  # the last five are a month ahead
            inventory.commit(seen(number))
        done = Delivered()
        deliver_inventory(inventory.folder, SITE, "north", store, done)
        assert (done.looks, done.ahead) == (20, 5)
        with pytest.raises(InputError, match="stay here: the clock of drone or store is wrong; set it"):
            done.check_clocks()
        inventory.commit(replace(seen(3), run="next", utc_ns=BEGIN + 70 * 86_400 * NS))
        assert prune(inventory.folder, store).stay == 5
        assert {row["run"] for row in store.stock(SITE)} == {"run 1"}


def test_places_follow_the_plan_of_the_newest_inventory(store: GroundStore, tmp_path: Path) -> None:
    for name, number in (("monday", 3), ("tuesday", 13)):
        with SqliteStore(tmp_path / name) as inventory:
            inventory.plan([PlannedLocation("A-3", f"node of {name}")])
            inventory.commit(seen(number))
    for name in ("monday", "tuesday", "monday"):
        deliver_inventory(tmp_path / name, SITE, "north", store, Delivered())
    assert [row["node"] for row in store.stock(SITE)] == ["node of tuesday"]
