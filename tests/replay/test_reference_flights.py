"""Flights recorded some time ago decide today as they did then (tools/update_reference_flights.py)."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from flightd.core.topics import Document, Topic
from flightd.replay.log import read_log
from tests.command import Command
from tools import update_reference_flights as tool

FLIGHTS = sorted(tool.FOLDER.glob("*.mcap"))

pytestmark = pytest.mark.skipif(
    not FLIGHTS, reason="none recorded: python -m tools.update_reference_flights --i-mean-it"
)


def test_every_reference_is_there_and_small() -> None:
    assert [log.stem for log in FLIGHTS] == sorted(tool.names())
    assert max(log.stat().st_size for log in FLIGHTS) <= tool.LARGEST_BYTES


@pytest.mark.parametrize("log", FLIGHTS, ids=lambda log: log.stem)
def test_a_reference_flight_is_flown_as_it_was(flightd: Command, log: Path) -> None:
    # on another processor the last digits may differ, nothing more
    result = flightd("replay", log, "--tolerance", "1e-6", "--json")
    assert result.stdout, result.stderr
    told = json.loads(result.stdout)
    assert told["passed"], f"what drifts: {json.dumps(told['drift'], indent=1)}"
    assert told["ticks"] >= 500
    assert told["pictures"]["pictures"] == 1


@pytest.mark.parametrize("log", FLIGHTS, ids=lambda log: log.stem)
def test_a_reference_knows_nothing_of_the_machine_that_flew_it(log: Path) -> None:
    (config,) = read_log(log).messages(Document, Topic.CONFIG)
    assert '"/' not in config.text


def test_nothing_is_recorded_anew_without_the_flag(tmp_path: Path) -> None:
    shutil.copy(FLIGHTS[0], tmp_path)
    before = (tmp_path / FLIGHTS[0].name).read_bytes()
    script = [
        sys.executable,
        "-m",
        "tools.update_reference_flights",
        "--folder",
        str(tmp_path),
        FLIGHTS[0].stem,
    ]
    result = subprocess.run(script, cwd=tool.ROOT, capture_output=True, text=True, check=False)
    assert result.returncode in {0, 1}, result.stderr
    assert (tmp_path / FLIGHTS[0].name).read_bytes() == before
