"""The bulk load that the store's speed is measured on leaves the tables as looks that were taken would."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from flightd.ground.ground_store.engine import Engine
from flightd.ground.ground_store.evidence import FolderEvidence
from flightd.ground.ground_store.store import GroundStore
from tools import bench_store


def test_a_small_store_is_loaded_asked_and_delivered_to(
    engine: Callable[[], Engine], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bench_store, "PLACES", 60)
    monkeypatch.setattr(bench_store, "_DELIVERED", 1)
    told = bench_store.measured(engine(), looks=180, times=2)
    assert (told["looks"], told["runs"]) == (180, 3)
    with pytest.raises(SystemExit, match="not empty"):
        bench_store.measured(engine(), looks=180, times=2)


def test_what_is_loaded_in_bulk_stands_as_what_is_derived_of_its_looks(
    engine: Callable[[], Engine], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bench_store, "PLACES", 60)
    opened = engine()
    with GroundStore(opened, FolderEvidence(tmp_path)) as store:
        assert bench_store.Bulk(opened).load(180) == 3
        replaced = set()
        for place in store.stock(bench_store.SITE, limit=100):
            looks = store.history(bench_store.SITE, place["location"])
            texts = [[read["text"] for read in look["reads"]] for look in looks]
            assert [look["run"] for look in looks] == ["run 3", "run 2", "run 1"]
            assert place["texts"] == texts[0]
            for column in ("state", "utc_ns", "run", "confidence", "fill"):
                assert place[column] == looks[0][column]
            assert place["fill"]["share"] == (0.0 if place["state"] == "empty" else 0.62)
            replaced |= {(looks[n]["run"], place["location"]) for n in (0, 1) if texts[n] != texts[n + 1]}
        found = {
            (run, row["location"])
            for run in ("run 1", "run 2", "run 3")
            for row in store.differences(bench_store.SITE, run)
        }
        assert found == replaced
        assert replaced
