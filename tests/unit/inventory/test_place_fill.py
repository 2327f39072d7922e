"""How full a place is, in what leaves the inventory."""

from __future__ import annotations

import csv
import io
import json
from typing import Any

import pytest

from flightd.core.inventory import LocationRecord, LocationState, Observation, PlaceFill
from flightd.core.types import CodeRead
from flightd.inventory.export.csv_table import as_csv
from flightd.inventory.export.json_document import as_json
from flightd.replay.report.racks import cell
from flightd.replay.report.stock import fill_text


def record(fill: PlaceFill | None) -> LocationRecord:
    read = CodeRead("QR Code", "BOX-1", (), True, 2, 1.0)
    seen = Observation("r", "A-1", 1, LocationState.READ, 0.9, (read,), fill=fill)
    return LocationRecord("A-1", "A1", seen)


def exported(fill: PlaceFill | None) -> tuple[str, str, str, Any]:
    """The cells of the table, and the part of the JSON document."""
    (row,) = csv.DictReader(io.StringIO(as_csv([record(fill)]).decode()))
    (place,) = json.loads(as_json([record(fill)]))["locations"]
    return row["fill"], row["overhang_m"], row["lean_m"], place["observation"]["fill"]


@pytest.mark.parametrize(
    ("fill", "told"),
    [
        (
            PlaceFill(0.625, 0.04, 0.03),
            ("0.625", "0.04", "0.03", {"share": 0.625, "overhang_m": 0.04, "lean_m": 0.03}),
        ),
        (PlaceFill(0.5), ("0.5", "", "unknown", {"share": 0.5, "overhang_m": None, "lean_m": None})),
        (PlaceFill(0.0), ("0.0", "", "", {"share": 0.0, "overhang_m": None, "lean_m": None})),
        (PlaceFill(None), ("unknown", "", "unknown", {"share": None, "overhang_m": None, "lean_m": None})),
        (None, ("", "", "", None)),
    ],
)
def test_exports_say_how_full_a_place_is(fill: PlaceFill | None, told: tuple[str, str, str, Any]) -> None:
    assert exported(fill) == told


def test_the_report_says_it_for_people() -> None:
    assert fill_text(PlaceFill(0.625, 0.04)) == "62 %, 4 cm over the rack's face"
    assert fill_text(PlaceFill(0.625, lean_m=0.034)) == "62 %, leans by 3 cm"
    assert fill_text(PlaceFill(0.625, lean_m=0.01)) == "62 %"
    assert (fill_text(PlaceFill(None)), fill_text(None)) == ("unknown", "")
    assert "62 % filled" in cell(record(PlaceFill(0.625)), "")
    assert "filled" not in cell(record(PlaceFill(None)), "")
