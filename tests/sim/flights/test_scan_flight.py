"""A rendered flight that counts shelves, from the front camera's pixels to the inventory on the disk."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from flightd.adapters.store.sqlite import SqliteStore
from tests.command import Command
from tests.rigs.patience import COMMAND_S
from tests.rigs.small_camera import at_once, small_camera_file

ROOT = Path(__file__).parents[3]

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("scan")
    where = ("--warehouse", str(ROOT / "configs" / "site-racks-small.toml"), "--set", 'mission.nodes=["A2"]')
    small = (
        "--scenario",
        str(small_camera_file(out)),
        *at_once(),
    )
    command = [sys.executable, "-m", "flightd", "sim", *where, *small, "--seed", "3", "--out", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=COMMAND_S, check=False)
    assert done.returncode == 0, done.stderr
    return out


def test_every_readable_label_is_read_and_none_wrongly(flown: Path) -> None:
    summary: dict[str, Any] = json.loads((flown / "summary.json").read_text())
    assert summary["mission"] == "completed"
    assert summary["locations_planned"] == summary["locations_visited"] == 8
    assert summary["codes_read"] == summary["codes_expected"] > 0
    assert summary["codes_wrong"] == 0
    assert summary["empty_right"] == summary["empty_expected"]
    assert summary["empty_wrong"] == 0


def test_the_inventory_says_so_with_evidence(flown: Path) -> None:
    with (flown / "inventory.csv").open(encoding="utf-8", newline="") as file:
        rows = {row["location"]: row for row in csv.DictReader(file)}
    with SqliteStore(flown, create=False) as store:
        records = store.locations()
        counted = [record for record in records if record.observation is not None]
        assert {record.node for record in counted} == {"A2"}
        for record in counted:
            assert record.observation is not None
            assert store.evidence.path(record.observation.evidence).stat().st_size <= 50_000
    assert rows.keys() == {record.code for record in records}
    assert {row["state"] for code, row in rows.items() if row["node"] != "A2"} == {"not_visited"}
    for record in counted:
        assert rows[record.code]["texts"] == " | ".join(record.texts)
        assert rows[record.code]["state"] == record.state


def test_its_record_flies_again_decision_for_decision(flightd: Command, flown: Path) -> None:
    replayed = flightd("replay", flown / "flight.mcap")
    assert replayed.returncode == 0, replayed.stdout + replayed.stderr
    assert "every decision is the same" in replayed.stdout
