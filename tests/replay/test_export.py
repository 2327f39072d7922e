"""A flight log as tables."""

from __future__ import annotations

import csv
from pathlib import Path

from flightd.core.topics import Topic
from flightd.replay.export import export_csv
from flightd.replay.log import Entry, FlightLog


def test_neither_what_a_foreign_log_says_nor_the_names_of_its_fields_are_formulas(tmp_path: Path) -> None:
    live = "=1+1"
    message = {live: live, "plain": {live: 1.5}}
    (path,) = export_csv(FlightLog(tmp_path, (Entry(Topic.STATUS, 0, message),), {}), tmp_path)
    with path.open(encoding="utf-8", newline="") as stream:
        header, row = csv.reader(stream)
    assert header == ["t_s", f"'{live}", f"plain.{live}"]
    assert row == ["0.0", f"'{live}", "1.5"]
