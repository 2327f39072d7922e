"""Whatever an editor has in its hands is checked, and what is saved of it is what the daemon reads."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.core.errors import InputError
from flightd.ground.site_page.work import check_sent, export_sent, new_sent, opened_text, text_sent
from flightd.site.site_draft import read_draft
from flightd.site.site_file import parse_site
from flightd.site.site_tables import LISTS, known_keys

TEXT = (Path(__file__).parents[3] / "configs" / "site-racks-small.toml").read_text()
CAMERA = {"fov_deg": 65.0, "width_px": 1280, "exposure_ms": 2.0, "module_mm": 3.0, "speed_mps": 0.3}
EXTRAS: dict[str, dict[str, Any]] = {
    "blocked": {"nodes": ["A2", "A3"]},
    "keep_out": {"x0_m": 5.0, "y0_m": 1.0, "x1_m": 6.0, "y1_m": 2.0},
    "marker": {"id": 3, "dictionary": "4x4_50", "x_m": 0.6, "y_m": 0.6},
}


def draft_of_all() -> dict[str, Any]:
    """The page's draft of a site that has one of everything."""
    draft: dict[str, Any] = opened_text(TEXT, "x")["draft"]
    for name, values in EXTRAS.items():
        draft["lists"][name] = [{"values": dict(values), "at": None}]
    return draft


def checked(draft: dict[str, Any]) -> dict[str, Any]:
    told: dict[str, Any] = json.loads(check_sent(json.dumps({"draft": draft, "camera": CAMERA}).encode()))
    return told


def test_each_finding_has_its_place() -> None:
    draft = draft_of_all()
    assert checked(draft)["sound"]
    for table, field, value, index in (
        ("aisle", "spacing_m", [0.1], 0), ("cross", "nodes", ["A1", "B2"], 0),
        ("blocked", "nodes", ["A1", "A9"], 0),
        ("keep_out", "from_m", 7.0, 0), ("rack", "pattern", "{shelf}", 0), ("pad", "node", "Z1", 0),
        ("marker", "id", 99, 0), ("aisle", "y_m", 0.1, 1), ("aisle", "colour", "red", 1),
    ):  # fmt: skip
        wrong = draft_of_all()
        wrong["lists"][table][index]["values"][field] = value
        told = checked(wrong)
        first = told["findings"][0]
        assert (told["sound"], first["kind"]) == (False, "error"), table
        assert (first["table"], first["index"], first["field"]) == (table, index, field), first["text"]


_numbers = st.floats(allow_nan=False, allow_infinity=False) | st.integers(-(2**53), 2**53) | st.floats(-3, 8)
_plain = (
    st.none()
    | st.booleans()
    | _numbers
    | st.sampled_from(["", "A", "A1", "B4", "left", "+x", "{bay}", "\n[[pad]]"])
)
_values = st.recursive(
    _plain,
    lambda one: st.lists(one, max_size=4) | st.dictionaries(st.text(max_size=3), one, max_size=2),
    max_leaves=6,
)


@given(data=st.data())
def test_any_value_anywhere_is_checked_and_never_saved_but_as_a_map_that_is_read(data: st.DataObject) -> None:
    draft = draft_of_all()
    for _ in range(data.draw(st.integers(1, 3))):
        table = data.draw(st.sampled_from(["site", *LISTS]))
        rows = [draft["site"]] if table == "site" else [one["values"] for one in draft["lists"][table]]
        key = data.draw(st.sampled_from([*known_keys(table), "other"]))
        data.draw(st.sampled_from(rows))[key] = data.draw(_values)
    told = checked(draft)
    assert told["sound"] or told["findings"]
    message = json.dumps({"draft": draft, "stamp": ""}).encode()
    try:
        text, _ = text_sent(message)
    except InputError:
        assert not told["sound"]
        return
    assert told["sound"]
    parse_site(text, "x")
    assert read_draft(text, "x").tables().keys() >= {"site", "aisle", "pad"}
    assert export_sent("lif", json.dumps(draft).encode())


def test_a_new_site_that_is_no_floor_says_why() -> None:
    new = {"name": "n", "aisles": 2, "nodes": 3, "spacing_m": [1.5], "pitch_m": 3.0}
    racks = {"levels_m": [0.3, 4.0], "bay_width_m": 1.2, "positions": 2}
    with pytest.raises(InputError, match="4 m is above the shelf"):
        new_sent(json.dumps({**new, "racks": racks}).encode())
    with pytest.raises(InputError, match="racks stand on shelves"):
        new_sent(json.dumps({**new, "shelves": "none", "racks": racks}).encode())
    told = new_sent(json.dumps({**new, "name": 'q"\n[[x]]', "racks": {**racks, "levels_m": [0.3]}}).encode())
    assert told["draft"]["site"]["name"] == 'q"\n[[x]]'
    assert "ceiling_m = 4.5 is assumed" in told["notes"][0]
