"""Inventories are delivered and pruned while no flight is on."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from flightd.adapters.store.sqlite import SqliteStore
from flightd.ground.ground_store import sender
from flightd.ground.ground_store.batch import Batch, Receipt
from flightd.ground.ground_store.between_flights import BetweenFlights, FlightBeganError
from flightd.ground.ground_store.sender import Delivered, deliver_inventory
from flightd.ground.ground_store.store import GroundStore
from tests.command import Command
from tests.unit.ground_store.store_rig import SITE, seen
from tests.web.stock_rig import counted_store


def test_a_flight_that_begins_stops_a_delivery_and_the_rest_comes_after_it(
    store: GroundStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sender, "MOST_LOOKS", 10)
    mark = tmp_path / "armed"
    with SqliteStore(tmp_path / "inventory") as inventory:
        for number in range(25):
            inventory.commit(seen(number, inventory.keep_evidence(b"\xff\xd8%d" % number)))

    take = store.take

    def armed_meanwhile(batch: Batch) -> Receipt:
        if batch.looks:
            mark.touch()
        return take(batch)

    monkeypatch.setattr(store, "take", armed_meanwhile)
    with pytest.raises(FlightBeganError, match="armed: a flight is on, what is left is for later"):
        deliver_inventory(tmp_path / "inventory", SITE, "north", BetweenFlights(store, mark), Delivered())
    assert store.counts()["looks"] == 10
    with pytest.raises(FlightBeganError):
        BetweenFlights(store, mark)
    mark.unlink()
    monkeypatch.undo()
    deliver_inventory(tmp_path / "inventory", SITE, "north", BetweenFlights(store, mark), Delivered())
    assert store.counts()["looks"] == 25


def test_the_commands_do_nothing_while_a_flight_is_on(flightd: Command, tmp_path: Path) -> None:
    counted_store(tmp_path / "monday")
    mark, store = tmp_path / "armed", tmp_path / "counts.db"
    mark.touch()
    deliver = ("store", "deliver", tmp_path / "monday", "--store", store, "--site", SITE, "--unless", mark)
    prune_it = ("store", "prune", tmp_path / "monday", "--store", store, "--unless", mark)
    stopped = f"{mark}: a flight is on, what is left is for later"
    for words in (deliver, prune_it):
        ended = flightd(*words)
        assert (ended.returncode, ended.stderr, ended.stdout.splitlines()[-1]) == (0, "", stopped)
        assert json.loads(flightd(*words, "--json").stdout)["stopped"] == stopped
    mark.unlink()
    told = json.loads(flightd(*deliver, "--json").stdout)
    assert (told["looks"], told["stopped"]) == (10, "")
    assert json.loads(flightd(*prune_it, "--json").stdout)["stopped"] == ""
