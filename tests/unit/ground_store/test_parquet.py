"""Other programs read what a store exports."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import duckdb
import pytest

from flightd.core.errors import InputError
from flightd.core.inventory import CaseGrid, PlaceFill, PlannedLocation, Standing, UndecidedCode
from flightd.ground.ground_store.store import GroundStore
from tests.unit.ground_store.store_rig import BEGIN, DAY, SITE, batch, look


def _asked(question: str) -> list[tuple[Any, ...]]:
    relation = duckdb.sql(question)
    assert relation is not None
    return relation.fetchall()


def test_duckdb_reads_what_is_exported(store: GroundStore, tmp_path: Path) -> None:
    twice = (UndecidedCode("ITF", 'a"b,\n', 2),)
    half, unknown = PlaceFill(0.5, 0.04, 0.03, CaseGrid(4, 3)), PlaceFill(None)
    pending = look("A-2", standing=Standing.PENDING, fill=unknown)
    store.take(batch(look("A-1", 'a"b,\n', run="monday"), pending))
    store.take(
        batch(look("A-1", run="tuesday", at_ns=BEGIN + DAY + 7), look("A-9", "x", fill=half, undecided=twice))
    )
    store.take(batch(look("A-1", "other"), site="hall 4"))
    assert store.export(SITE, tmp_path / "it's out") == {"observations": 4, "differences": 1}
    observations = str(tmp_path / "it's out" / "observations.parquet").replace("'", "''")
    differences = observations.replace("observations", "differences")
    told = _asked(
        f"SELECT site, run, location, state, epoch_ns(utc), evidence, reads FROM '{observations}'"
        " ORDER BY utc, location"
    )
    assert [row[2:5] for row in told] == [
        ("A-1", "read", BEGIN), ("A-2", "empty", BEGIN), ("A-9", "read", BEGIN),
        ("A-1", "empty", BEGIN + DAY + 7),
    ]  # fmt: skip
    assert (told[0][:2], told[0][5], json.loads(told[0][6])[0][1]) == ((SITE, "monday"), None, 'a"b,\n')
    assert json.loads(told[2][6])[0][1] == "x"
    doubts = _asked(f"SELECT undecided FROM '{observations}' ORDER BY utc, location")
    assert [json.loads(row[0]) for row in doubts] == [
        [], [], [{"symbology": "ITF", "text": 'a"b,\n', "looks": 2}], [],
    ]  # fmt: skip
    assert _asked(f"SELECT DISTINCT printed, again FROM '{observations}'") == [("[]", False)]
    filled = _asked(
        "SELECT fill_asked, fill, overhang_m, lean_m, case_columns, case_rows"
        f" FROM '{observations}' ORDER BY utc, location"
    )
    nothing = (None,) * 5
    assert filled == [
        (False, *nothing), (True, *nothing), (True, 0.5, 0.04, 0.03, 4, 3), (False, *nothing),
    ]  # fmt: skip
    changed = _asked(f"SELECT location, change, before_texts FROM '{differences}'")
    assert changed == [("A-1", "gone", json.dumps(['a"b,\n']))]
    assert store.export("", tmp_path / "all")["observations"] == 5
    store.take(batch(places=(PlannedLocation("A-1", "A1"),), site="hall 5"))  # nobody looked yet
    assert store.export("hall 5", tmp_path / "empty") == {"observations": 0, "differences": 0}
    assert _asked(f"SELECT * FROM '{tmp_path / 'empty' / 'observations.parquet'}'") == []
    with pytest.raises(InputError, match="there is no site 'hall 9'"):
        store.export("hall 9", tmp_path / "none")
