"""What the ground may change of a configuration, and what becomes of its file's text."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel

from flightd.config.edited_text import edited
from flightd.config.ground import GroundConfig
from flightd.config.interlock import InterlockConfig
from flightd.config.metrics import MetricsConfig
from flightd.config.reference import rows
from flightd.config.remote_change import (
    MOST_CHANGES,
    checked,
    differences,
    fixed_because,
    known_keys,
    proposed,
    value_in,
)
from flightd.core.errors import InputError

T = TypeVar("T")
FILE = Path("flightd.toml")
TEXT = """# a drone of hall 2
[mission]
site = "site-demo.toml"   # the hall
height_m = 1.6            # under the lamps

[control.horizontal]      # tuned in March
kp = 6.0
"""
TABLE = tomllib.loads(TEXT)
OPEN = [row for row in rows() if not fixed_because(row)]
SCALARS = st.one_of(
    st.booleans(),
    st.integers(-(10**30), 10**30),
    st.floats(),
    st.text(max_size=300),
    st.none(),
)
VALUES = st.one_of(SCALARS, st.lists(SCALARS, max_size=8), st.dictionaries(st.text(max_size=3), SCALARS))
NAMES = st.one_of(st.sampled_from([row.name for row in rows()]), st.text(max_size=90))


def refusal(changes: dict[str, Any], table: dict[str, Any] = TABLE) -> str:
    with pytest.raises(InputError) as refused:
        checked(table, changes, FILE)
    return str(refused.value)


def tried(what: Callable[[], T]) -> tuple[T | None, str]:
    """What comes of it, or the complaint."""
    try:
        return what(), ""
    except InputError as err:
        return None, str(err)


def test_comments_and_order_stay_where_a_value_changes() -> None:
    changes = {"mission.height_m": 1.8, "control.horizontal.kp": None, "scan.pictures": 4}
    after = edited(TEXT, changes)
    for line in ("# a drone of hall 2", 'site = "site-demo.toml"   # the hall', "# tuned in March"):
        assert line in after
    assert "height_m = 1.8" in after
    assert "# under the lamps" in after
    assert tomllib.loads(after)["scan"] == {"pictures": 4}
    assert "kp" not in tomllib.loads(after)["control"]["horizontal"]


@pytest.mark.parametrize(
    "text",
    [
        'mission.site = "a.toml"\n',
        'mission = {site = "a.toml", height_m = 1.6}\n',
        '[mission]\nsite = "a.toml"\nexpert.max_lead_m = 0.4\n',
        '[control.yaw]\nkp = 1.0\n[mission]\nsite = "a.toml"\n[control.height]\nkp = 1.0\n',
    ],
)
def test_a_file_however_it_is_written_says_what_was_changed_or_is_left_alone(text: str) -> None:
    changes = {"mission.height_m": 1.8, "mission.expert.max_lead_m": 0.3, "control.horizontal.kp": 5.0}
    after, complaint = tried(lambda: tomllib.loads(edited(text, changes)))
    assert "by hand" in complaint or after == proposed(tomllib.loads(text), changes)


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"mission.height_m": 50}, "mission.height_m: 50 is outside 0.5 to 20 m"),
        ({"mission.hieght_m": 1}, "mission.hieght_m: unknown key"),
        ({"mission": {}}, "unknown key"),
        ({"mission.nodes": "A1"}, 'mission.nodes: expected a list, e.g. ["A1"]'),
        ({"mission.order": "quick"}, 'mission.order: expected one of "given", "best"'),
        ({"mission.site": None}, "mission.site: is missing"),
        ({"ground.listen": "0.0.0.0"}, "the way to the ground is changed on the drone itself"),
        ({"ground.clients": "mine"}, "which file it uses is changed on the drone itself"),
        ({"recorder.folder": "/tmp"}, "which file it uses is changed on the drone itself"),
        ({"vehicle.signing_key": None}, "which file it uses is changed on the drone itself"),
        ({"interlock.closed": "0"}, "people out of the aisles is changed on the drone itself"),
        ({"camera.url": "folder:/etc"}, "the way to the camera is changed on the drone itself"),
        ({"mission.autostart": True}, "what starts a flight by itself is changed on the drone itself"),
        ({"mission.site": "../site.toml"}, "own folder"),
        ({"mission.site": "/etc/passwd"}, "own folder"),
        ({"mission.site": ".hidden"}, "own folder"),
        ({"vision.profile": "../paint.npz"}, "without a folder"),
        ({"vehicle.name": "a\nb"}, "printable"),
        ({"vehicle.name": "a" * 201}, "printable"),
        ({"mission.nodes": ["A"] * 201}, "201 items"),
        ({"mission.height_m": 2**80}, "too large"),
        ({}, "nothing is changed"),
        ({row.name: None for row in OPEN[: MOST_CHANGES + 1]}, "65 keys at once"),
    ],
)
def test_what_is_refused_says_why(changes: dict[str, Any], complaint: str) -> None:
    assert complaint in refusal(changes)


@given(st.dictionaries(NAMES, VALUES, max_size=6))
def test_whatever_is_proposed_is_a_sound_configuration_or_one_clear_line(changes: dict[str, Any]) -> None:
    config, complaint = tried(lambda: checked(TABLE, changes, FILE))
    assert len(complaint.splitlines()) == (config is None)
    if config is not None:
        assert not {name for name, row in known_keys().items() if fixed_because(row)} & changes.keys()


@given(st.dictionaries(NAMES, VALUES, max_size=6))
def test_what_is_written_reads_back_as_what_was_checked(changes: dict[str, Any]) -> None:
    try:
        wanted = checked(TABLE, changes, FILE)
        after = edited(TEXT, changes)
    except InputError:
        return
    assert checked(tomllib.loads(after), {"vehicle.name": "x"}, FILE) == wanted.model_copy(
        update={"vehicle": wanted.vehicle.model_copy(update={"name": "x"})}
    )


@given(st.dictionaries(st.sampled_from([row.name for row in OPEN]), st.integers(0, 3), max_size=6))
def test_the_way_back_is_a_change_like_any_other(changes: dict[str, Any]) -> None:
    if not changes:
        return
    there = proposed(TABLE, changes)
    back = differences(there, TABLE)
    if not back:
        return
    again = proposed(there, back)
    assert all(value_in(again, name) == value_in(TABLE, name) for name in {*changes, *back})


def test_nothing_of_link_interlock_and_metrics_is_open_but_what_is_meant_to_be() -> None:
    keys = known_keys()
    shut: dict[str, type[BaseModel]] = {
        "ground": GroundConfig,
        "interlock": InterlockConfig,
        "metrics": MetricsConfig,
    }
    still_open = {
        f"{section}.{key}"
        for section, model in shut.items()
        for key in model.model_fields
        if not fixed_because(keys[f"{section}.{key}"])
    }
    assert still_open == {"ground.picture_fps", "ground.lost_s", "ground.lost_action"}
    assert all(fixed_because(row) for row in rows() if row.key == "url")
    assert {row.name for row in OPEN if row.type == "path"} == {"mission.site"}
