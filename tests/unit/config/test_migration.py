"""Configurations of older recordings: keys that moved are found where they stand now."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from flightd.config.migration import MOVED, migrated, moved_keys
from flightd.config.reference import rows
from flightd.config.schema import Config, parse_config, recorded_config
from flightd.core.errors import InputError

LOG = Path("flight.mcap")
OLD = {
    "mission": {"site": "site.toml", "battery_start": 0.4},
    "hazards": {"search_s": 0.7, "latency_s": 0.3},
    "control": {
        "max_jerk_mps3": 9.0,
        "yaw": {"kp": 1.5, "ki": 0.1, "kd": 0.1, "integral_limit": 0.2, "output_limit": 0.7},
    },
}


def test_an_older_recordings_keys_keep_their_values() -> None:
    before = json.dumps(OLD)
    config = recorded_config(OLD, LOG)
    assert (config.hazards.expert.search_s, config.hazards.latency_s) == (0.7, 0.3)
    assert config.control.expert.max_jerk_mps3 == 9.0
    assert config.control.expert.yaw_integral_limit_radps == 0.2
    assert config.control.expert.yaw_output_limit_radps == 0.7
    assert json.dumps(OLD) == before


def test_what_is_recorded_today_reads_back_the_same() -> None:
    config = recorded_config(OLD, LOG)
    document = json.loads(config.model_dump_json())
    assert list(moved_keys(document)) == []
    assert recorded_config(document, LOG) == config


@pytest.mark.parametrize(("old", "new"), MOVED.items())
def test_a_file_with_a_key_that_moved_is_told_where_to(old: str, new: str) -> None:
    table: dict[str, object] = {}
    *parents, key = old.split(".")
    inner = table
    for parent in parents:
        inner[parent] = inner = {}
    inner[key] = 1.0
    with pytest.raises(InputError, match=rf"config f\.toml: {old}: moved to {new}; rename it"):
        parse_config({"mission": {"site": "site.toml"}, **table}, Path("f.toml"))


def test_every_new_name_is_a_key_and_no_old_one_is() -> None:
    known = {row.name for row in rows()}
    assert set(MOVED.values()) <= known
    assert not set(MOVED) & known


def test_a_document_that_is_no_configuration_is_left_to_the_check() -> None:
    assert migrated({"control": 1}) == {"control": 1}
    with pytest.raises(InputError, match=r"control: expected a table"):
        recorded_config({"mission": {"site": "s"}, "control": 1}, LOG)


def test_the_whole_tree_goes_to_json_and_back() -> None:
    config = Config.model_validate({"mission": {"site": "site.toml"}})
    assert Config.model_validate_json(config.model_dump_json()) == config


def test_what_an_older_recording_does_not_say_is_what_it_was_flown_with() -> None:
    assert recorded_config({"mission": {"site": "s"}}, LOG).mission.autostart_countdown_s == 0.0
    told = {"mission": {"site": "s", "autostart_countdown_s": 4.0}}
    assert recorded_config(told, LOG).mission.autostart_countdown_s == 4.0
