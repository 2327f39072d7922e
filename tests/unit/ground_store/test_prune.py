"""An inventory is rid of what the store has, and of nothing else."""

from __future__ import annotations

from pathlib import Path

from flightd.adapters.store.sqlite import SqliteStore
from flightd.core.label_values import LabelValue, ValueKind, ValueSource
from flightd.ground.ground_store.prune import prune
from flightd.ground.ground_store.sender import Delivered, deliver_inventory
from flightd.ground.ground_store.store import GroundStore
from tests.unit.ground_store.store_rig import SITE, seen


def test_what_is_found_printed_later_is_delivered_and_until_then_not_pruned(
    store: GroundStore, tmp_path: Path
) -> None:
    lot = LabelValue(ValueKind.LOT, "B-4711", "", ValueSource.TEXT, 0.95)
    best = LabelValue(ValueKind.BEST_BEFORE, "2027-01-31", "", ValueSource.TEXT, 0.99)
    with SqliteStore(tmp_path / "inventory") as inventory:
        for number in (1, 11, 21):
            inventory.commit(seen(number))
        inventory.keep_texts(seen(21).id, [lot], "first")
        deliver_inventory(inventory.folder, SITE, "north", store, Delivered())
        inventory.keep_texts(seen(1).id, [lot, best], "first")
        pruned = prune(inventory.folder, store)
        assert (pruned.looks, pruned.stay) == (1, 1)
        done = Delivered()
        deliver_inventory(inventory.folder, SITE, "north", store, done)
        assert (done.looks, done.changed, done.already) == (0, 1, 1)
        again = Delivered()
        deliver_inventory(inventory.folder, SITE, "north", store, again)
        assert (again.changed, again.already) == (0, 2)
        assert prune(inventory.folder, store).looks == 1
        assert [look.id for look, _ in inventory.looks()] == [seen(21).id]
    told = {row["id"]: row["printed"] for row in store.history(SITE, "A-1")}
    assert store.stock(SITE)[0]["printed"] == told[seen(21).id]
    lot_told = {"kind": "lot", "value": "B-4711", "confidence": 0.95}
    assert told == {
        seen(1).id: [lot_told, {"kind": "best_before", "value": "2027-01-31", "confidence": 0.99}],
        seen(11).id: [],
        seen(21).id: [lot_told],
    }


def test_only_what_the_store_has_is_pruned(store: GroundStore, tmp_path: Path) -> None:
    with SqliteStore(tmp_path / "inventory") as inventory:
        for number in range(25):
            inventory.commit(seen(number, inventory.keep_evidence(b"\xff\xd8%d" % number)))
        assert (pruned := prune(inventory.folder, store)).looks == 0
        assert pruned.stay == 20  # those of the newest run are not asked for
        deliver_inventory(inventory.folder, SITE, "north", store, Delivered())
        lost = inventory.looks()[3][0]
        (tmp_path / "evidence" / lost.evidence[:2] / f"{lost.evidence}.jpg").unlink()  # in the store
        before = inventory.locations()
        pruned = prune(inventory.folder, store)
        # 10 looks of run 0 without the one whose picture the store lost, and 5 of run 1 that run 2 follows
        assert (pruned.looks, pruned.pictures, pruned.stay) == (14, 19, 1)
        assert inventory.locations() == before
        assert inventory.evidence.path(lost.evidence).exists()
        assert lost in [look for look, _ in inventory.looks()]
        assert prune(inventory.folder, store).looks == 0
    assert store.counts()["looks"] == 25


def test_looks_whose_pictures_are_damaged_are_pruned_once_they_are_in_the_store(
    store: GroundStore, tmp_path: Path
) -> None:
    with SqliteStore(tmp_path / "inventory") as inventory:
        for number in range(25):
            inventory.commit(seen(number, inventory.keep_evidence(b"\xff\xd8%d" % number)))
        damaged, unread = (inventory.evidence.path(look.evidence) for look, _ in inventory.looks()[:2])
        damaged.write_bytes(bytes(20))
        unread.unlink()
        unread.mkdir()
        done = Delivered()
        deliver_inventory(inventory.folder, SITE, "north", store, done)
        assert len(done.failures) == 2
        pruned = prune(inventory.folder, store)
        assert (pruned.looks, pruned.pictures, pruned.stay) == (14, 19, 1)
        assert (damaged.exists(), unread.exists()) == (False, True)
