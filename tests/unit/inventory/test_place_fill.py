"""How full a place is, in what leaves the inventory."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import replace
from typing import Any

import pytest

from flightd.core.inventory import CaseGrid, LocationRecord, LocationState, Observation, PlaceFill
from flightd.core.types import CodeRead
from flightd.inventory.export.csv_table import as_csv
from flightd.inventory.export.json_document import as_json
from flightd.replay.report.racks import cell
from flightd.replay.report.stock import cases_text, fill_text


def record(fill: PlaceFill | None) -> LocationRecord:
    read = CodeRead("QR Code", "BOX-1", (), True, 2, 1.0)
    seen = Observation("r", "A-1", 1, LocationState.READ, 0.9, (read,), fill=fill)
    return LocationRecord("A-1", "A1", seen)


def exported(fill: PlaceFill | None) -> tuple[str, str, str, str, Any]:
    """The cells of the table, and the part of the JSON document."""
    (row,) = csv.DictReader(io.StringIO(as_csv([record(fill)]).decode()))
    (place,) = json.loads(as_json([record(fill)]))["locations"]
    return row["fill"], row["overhang_m"], row["lean_m"], row["cases"], place["observation"]["fill"]


def told(
    share: float | None,
    overhang_m: float | None = None,
    lean_m: float | None = None,
    cases: dict[str, int] | None = None,
) -> dict[str, Any]:
    return {"share": share, "overhang_m": overhang_m, "lean_m": lean_m, "cases": cases}


@pytest.mark.parametrize(
    ("fill", "cells"),
    [
        (
            PlaceFill(0.625, 0.04, 0.03, CaseGrid(4, 3)),
            ("0.625", "0.04", "0.03", "12", told(0.625, 0.04, 0.03, {"columns": 4, "rows": 3, "count": 12})),
        ),
        (PlaceFill(0.5), ("0.5", "", "unknown", "unknown", told(0.5))),
        (PlaceFill(0.0), ("0.0", "", "", "", told(0.0))),
        (PlaceFill(None), ("unknown", "", "unknown", "unknown", told(None))),
        (None, ("", "", "", "", None)),
    ],
)
def test_exports_say_how_full_a_place_is(
    fill: PlaceFill | None, cells: tuple[str, str, str, str, Any]
) -> None:
    assert exported(fill) == cells


def test_the_report_says_it_for_people() -> None:
    assert fill_text(PlaceFill(0.625, 0.04)) == "62 %, 4 cm over the rack's face"
    assert fill_text(PlaceFill(0.625, lean_m=0.034)) == "62 %, leans by 3 cm"
    assert fill_text(PlaceFill(0.625, lean_m=0.01)) == "62 %"
    assert (fill_text(PlaceFill(None)), fill_text(None)) == ("unknown", "")
    assert "62 % filled" in cell(record(PlaceFill(0.625)), "")
    assert "filled" not in cell(record(PlaceFill(None)), "")


def test_cases_are_said_as_what_is_seen_of_the_front() -> None:
    cases = PlaceFill(None, cases=CaseGrid(4, 3))
    assert cases_text(cases) == "12 (4 by 3) in the front"
    assert "cases: 12 (4 by 3) in the front" in cell(record(cases), "")
    assert (cases_text(PlaceFill(0.5)), cases_text(None)) == ("", "")


def test_exports_say_that_of_several_pallets_the_first_alone_is_seen() -> None:
    seen, unseen = replace(record(None), pallets_deep=3), LocationRecord("A-2", "A1", None, 3)
    empty = LocationRecord("A-3", "A1", Observation("r", "A-3", 1, LocationState.EMPTY, 0.9), 3)
    rows = csv.DictReader(io.StringIO(as_csv([seen, unseen, empty]).decode()))
    assert [(row["pallets_deep"], row["pallets_seen"]) for row in rows] == [
        ("3", "1"),
        ("3", "0"),
        ("3", "0"),
    ]
    places = json.loads(as_json([seen, unseen, empty]))["locations"]
    assert [(place["pallets_deep"], place["pallets_seen"]) for place in places] == [(3, 1), (3, 0), (3, 0)]
