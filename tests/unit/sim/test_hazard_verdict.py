"""How long a hazard's landing took, as the judge counts, and how a flight with one may end."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from flightd.core.types import Event, EventLevel, Phase, Status
from flightd.mission.safety.hazard_table import HAZARDS
from flightd.sim.judge.expectation import Expectation
from flightd.sim.judge.flight_score import score
from flightd.sim.judge.hazard_verdict import HazardVerdict, judged_hazard
from flightd.sim.judge.verdict import judged
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.scenario.scenario_files import load_scenario, shipped_scenarios
from tests.rigs.flight_evidence import S, at, evidence, landed, status


def verdict(hazard: str, statuses: list[Status], begun_s: int) -> HazardVerdict:
    """Of a flight that is in the air for a minute and a half."""
    (row,) = (row for row in HAZARDS if row.name == hazard)
    flight = evidence(landed(*(at(second * S) for second in range(1, 91))), statuses)
    told = score(flight)
    expected = Expectation(hazard=hazard, ends="landed")
    return judged_hazard(row, expected, flight, told, judged(flight, told), [begun_s * S])


def test_what_shows_only_at_the_landing_is_counted_from_there() -> None:
    statuses = [status(0), status(88 * S, Phase.LAND), status(91 * S, Phase.DONE)]
    found = verdict("landing_unreported", statuses, begun_s=24)
    assert found.down_s == pytest.approx(2.0, abs=1.1)
    assert "down_late" not in {fault.kind for fault in found.faults}


def test_where_the_daemon_is_dead_it_is_counted_from_its_death() -> None:
    """Simulated it lives on beside the dead link, takes that for a silent vehicle, holds, and lands."""
    statuses = [
        status(0),
        status(24 * S),
        status(25 * S, Phase.HOLD),
        status(27 * S, Phase.LAND),
        status(92 * S, Phase.ABORTED),
    ]
    found = verdict("companion_dead", statuses, begun_s=24)
    assert found.down_s == pytest.approx(66.0, abs=1.1)
    assert "down_late" in {fault.kind for fault in found.faults}


def down(hazard: str, phase: Phase, events: list[Event], ends: Any = "landed") -> HazardVerdict:
    """Of a flight of a minute whose fault comes after 10 s, and that then is in this phase."""
    (row,) = (row for row in HAZARDS if row.name == hazard)
    truth = landed(*(at(second * S) for second in range(1, 61)))
    flight = replace(evidence(truth, [status(0), status(20 * S, phase)], events), piloted_ns=math.inf)
    figures = score(flight)
    expects = Expectation(hazard=hazard, ends=ends, found_s=600)
    return judged_hazard(row, expects, flight, figures, judged(flight, figures), [10 * S])


def test_a_landing_that_a_hold_led_to_has_a_bound_too() -> None:
    """The camera ends at 10 s; at 12 s it lands, and is down after another 48."""
    held = Event(11 * S, EventLevel.WARNING, "hazard", "no new pictures: hold")
    lands = Event(12 * S, EventLevel.WARNING, "phase", "hold -> land: the hazard lasts")
    found = down("camera_gone", Phase.LAND, [held, lands])
    assert found.down_s == pytest.approx(48.0)
    assert [fault.kind for fault in found.faults].count("down_late") == 1
    soon = Event(45 * S, EventLevel.WARNING, "phase", "hold -> land: the hazard lasts")
    found = down("camera_gone", Phase.LAND, [held, soon])
    assert found.down_s == pytest.approx(15.0)
    assert "down_late" not in {fault.kind for fault in found.faults}
    planned = Event(12 * S, EventLevel.INFO, "phase", "hover -> land: the route is done")
    assert down("camera_gone", Phase.LAND, [held, planned]).down_s is None


def test_where_its_failsafe_took_over_and_nobody_flies_it_is_counted_from_the_fault() -> None:
    taken = Event(
        11 * S, EventLevel.WARNING, "phase", "follow -> pilot: the autopilot's own failsafe took control"
    )
    found = down("uplink_lost", Phase.PILOT, [taken], "handed over")
    assert found.down_s == pytest.approx(50.0)
    assert "down_late" in {fault.kind for fault in found.faults}


def test_what_a_scenario_tolerates_is_no_fault_of_the_answer_either() -> None:
    (row,) = (row for row in HAZARDS if row.name == "attitude_wrong")
    flight = evidence(landed(*(at(second * S) for second in range(1, 31))), [status(0), status(31 * S)])
    told = score(flight)
    for tolerates, kinds in (((), {"not_found", "other_action"}), (("not_found", "other_action"), set())):
        expected = Expectation(hazard=row.name, ends="completed", tolerates=tolerates)
        found = judged_hazard(row, expected, flight, told, [], [10 * S])
        assert {fault.kind for fault in found.faults} - {"other_end"} == kinds


@pytest.mark.parametrize(("text", "found"), [("lines lost", True), ("lines lost for too long", False)])
def test_a_hazard_is_not_found_by_another_whose_name_begins_alike(text: str, found: bool) -> None:
    (row,) = (row for row in HAZARDS if row.name == "lines_lost")
    told = Event(12 * S, EventLevel.WARNING, "hazard", f"{text}: hold")
    flight = evidence(landed(*(at(second * S) for second in range(1, 31))), [status(0)], [told])
    expected = Expectation(hazard=row.name, ends="landed")
    verdict = judged_hazard(row, expected, flight, score(flight), [], [10 * S])
    assert verdict.found_s == (2.0 if found else None)


FLOWN = [at(second * S) for second in range(1, 31)]
ENDS: dict[str, tuple[Phase, list[Kinematics]]] = {
    "completed": (Phase.DONE, landed(*FLOWN)),
    "home": (Phase.ABORTED, landed(*FLOWN)),
    "landed": (Phase.ABORTED, [*landed(*FLOWN)[:-1], at(31 * S, height_m=0.1)]),
    "handed over": (Phase.PILOT, landed(*FLOWN)),
    "in the air": (Phase.HOLD, landed(*FLOWN)[:-1]),
}
"""The last phase and the true motion of flights that end like that."""


@pytest.mark.parametrize(
    ("expected", "as_good"),
    [
        ("down", {"completed", "home", "landed"}),
        ("landed", {"home", "landed"}),
        ("home", {"home"}),
        ("completed", {"completed"}),
        ("handed over", {"handed over"}),
    ],
)
def test_which_ends_are_as_good_as_the_expected_one(expected: Any, as_good: set[str]) -> None:
    (row,) = (row for row in HAZARDS if row.name == "swings")
    found = Event(10 * S, EventLevel.WARNING, "hazard", "it swings about its place: hold")
    accepted = set()
    for end, (phase, truth) in ENDS.items():
        statuses = [status(0), status(10 * S, Phase.HOLD), status(31 * S, phase)]
        flight = evidence(truth, statuses, [found])
        figures = score(flight)
        expects = Expectation(hazard="swings", ends=expected)
        verdict = judged_hazard(row, expects, flight, figures, judged(flight, figures), [10 * S])
        assert verdict.outcome == end
        if "other_end" not in {fault.kind for fault in verdict.faults}:
            accepted.add(end)
    assert accepted == as_good


def test_a_flight_that_stays_in_the_air_is_bad_whatever_way_down_is_expected() -> None:
    """Also of a flight that the daemon says to have completed."""
    (row,) = (row for row in HAZARDS if row.name == "swings")
    for phase in (Phase.HOLD, Phase.DONE):
        flight = evidence(landed(*FLOWN)[:-1], [status(0), status(30 * S, phase)])
        figures = score(flight)
        expects = Expectation(hazard="swings", ends="down")
        faults = judged_hazard(row, expects, flight, figures, judged(flight, figures), [10 * S]).faults
        assert {"other_end", "stayed_up"} <= {fault.kind for fault in faults}


@pytest.mark.parametrize("name", ["swings", "clock_jump"])
def test_what_may_fly_on_or_land_is_expected_down(name: str) -> None:
    expects = load_scenario(shipped_scenarios()[name]).expect
    assert expects is not None
    assert expects.ends == "down"
