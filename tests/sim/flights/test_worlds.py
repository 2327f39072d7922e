"""The table of many seeds says of each flight what was judged of it, and nothing else."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.sim.flights.worlds import main


def test_a_flight_that_could_not_be_flown_is_not_counted_as_safe(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = tmp_path / "rows.json"
    status = main(["--world", "ideal", "--seeds", "1-2", "--nodes", "Z99", "--json", str(rows)])
    *lines, summary = capsys.readouterr().out.splitlines()
    assert status == 1
    assert summary.startswith("0 of 2 completed, 0 of 2 safe, 2 not judged, ")
    assert "miscounted" not in summary
    assert all("ABORTED (not judged): " in line and "Z99" in line for line in lines[1:])
    assert [row["unsafe"] for row in json.loads(rows.read_text())] == [None, None]


def test_flights_by_computed_sight_tell_nothing_that_nobody_judged(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = tmp_path / "rows.json"
    status = main(["--ideal", "--world", "ideal", "--seeds", "1", "--nodes", "A2", "--json", str(rows)])
    summary = capsys.readouterr().out.splitlines()[-1]
    assert status == 0
    assert summary.startswith("1 of 1 completed, rms ")
    assert not {"safe", "miscounted"} & set(summary.replace(",", "").split())
    (row,) = json.loads(rows.read_text())
    assert (row["completed"], row["unsafe"], row["miscounted"]) == (True, None, None)


def test_vehicle_and_settings_are_those_of_the_flight(capsys: pytest.CaptureFixture[str]) -> None:
    wrong = ["--set", "vehicle.pose_output=sideways"]
    assert main(["--world", "ideal", "--seeds", "1", "--vehicle", "px4", *wrong]) == 1
    assert "vehicle.pose_output" in capsys.readouterr().out
    assert main(["--world", "ideal", "--seeds", "1", "--vehicle", "balloon"]) == 1
    assert "vehicle.kind" in capsys.readouterr().out
    with pytest.raises(SystemExit, match="2"):
        main(["--ideal", "--vehicle", "px4"])
