"""The hazard table: complete and true to the configuration."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from flightd.config.reference import rows
from flightd.mission.machine import STATES, taken_in
from flightd.mission.safety.hazard_table import HAZARDS, Action, Hazard
from flightd.mission.triggers import Trigger

ROOT = Path(__file__).parents[3]


def test_names_are_unique_and_a_trigger_has_one_action() -> None:
    names = [row.name for row in HAZARDS]
    assert len(set(names)) == len(names)
    told = [row for row in HAZARDS if row.trigger is not None]
    actions = {(row.trigger, row.action) for row in told}
    assert len(actions) == len({row.trigger for row in told})


@pytest.mark.parametrize("row", HAZARDS, ids=lambda row: row.name)
def test_a_row_names_only_keys_that_exist(row: Hazard) -> None:
    known = {key.name for key in rows()}
    assert set(re.findall(r"`(\w+(?:\.\w+)+)`", row.found_by + row.then)) <= known
    assert (ROOT / row.test).is_file()


def test_the_mission_answers_every_hazard_that_asks_for_something() -> None:
    answered = {trigger for state in STATES for trigger in taken_in(state)}
    below = {Action.REPORT, Action.HOME}
    silent = {row.trigger for row in HAZARDS if row.trigger and row.action not in below} - answered
    assert silent == set()
    assert Trigger.LINES_LOST in answered
