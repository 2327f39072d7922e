"""A simulated flight judged by its two logs."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest

from flightd.adapters.recorder.recorder import McapRecorder, wait_for_disk
from flightd.adapters.store.sqlite import SqliteStore
from flightd.app.simulation.judgement import judge_flight
from flightd.app.simulation.prepare import SimOptions, prepare
from flightd.app.simulation.simulation import Simulation
from flightd.config.paths import shipped
from flightd.core.inventory import LocationState, Observation, PlannedLocation
from flightd.core.topics import Topic
from flightd.core.types import AttitudeSetpoint, Event, EventLevel, Phase
from flightd.sim.scenario.faults import FaultNote
from flightd.sim.scenario.scenario import Scenario
from tests.rigs.flight_evidence import S, at, status

BEGUN_S, DOWN_S, END_S = 10, 26, 40


@pytest.fixture
def simulation(tmp_path: Path) -> Simulation:
    return prepare(SimOptions(), Scenario(), tmp_path, lambda _: None)


def faults(
    simulation: Simulation,
    kind: str,
    ended_s: int | None = None,
    unseen_s: tuple[float, float] = (0.0, 0.0),
    dropped: int = 0,
) -> set[str]:
    """Of a flight in which a fault began 16 s before it came down: level setpoints until then, and leaning
    ones on the floor, ten a second to the end.  The truth has nothing between the two times `unseen_s`, and
    lacks the messages that were `dropped`."""
    told = {"dropped": str(dropped)} if dropped else {}
    with McapRecorder(simulation.truth_log, metadata=told, when_full=wait_for_disk) as log:
        log.record(Topic.FAULT, BEGUN_S * S, FaultNote(BEGUN_S * S, 0, kind, True))
        if ended_s is not None:
            log.record(Topic.FAULT, ended_s * S, FaultNote(ended_s * S, 0, kind, False))
        for stamp_ns in range(0, END_S * S, S // 10):
            flies = S < stamp_ns < DOWN_S * S
            if not unseen_s[0] * S < stamp_ns < unseen_s[1] * S:
                log.record(Topic.TRUTH, stamp_ns, at(stamp_ns, 0.0, height_m=1.6 if flies else 0.1))
    with McapRecorder(simulation.flight_log, when_full=wait_for_disk) as log:
        log.record(Topic.STATUS, 0, status(0))
        for stamp_ns in range(0, END_S * S, S // 10):
            roll_rad = math.radians(10.0) if stamp_ns > DOWN_S * S else 0.0
            log.record(Topic.SETPOINT, stamp_ns, AttitudeSetpoint(stamp_ns, roll_rad))
    return {fault.kind for fault in judge_flight(simulation).faults}


def test_each_place_is_answered_by_a_look_that_counts_unreadable_or_not(tmp_path: Path) -> None:
    """Of 48 places one is told to be empty, two as nothing that anybody can say, one by a look that is not
    proven and one by one that was withdrawn."""
    options = SimOptions(warehouse=str(shipped("site-racks-small.toml")))
    simulation = prepare(options, Scenario(), tmp_path, lambda _: None)
    places = list(simulation.site.locations.values())
    empty, nothing = LocationState.EMPTY, (LocationState.UNREADABLE, LocationState.OCCLUDED)
    states = [empty, *nothing, empty, empty]
    looks = [Observation("run", p.code, 1, state, 0.9) for p, state in zip(places, states, strict=False)]
    with SqliteStore(simulation.folder) as store:
        store.plan(PlannedLocation(place.code, place.node) for place in places)
        for look in looks:
            store.commit(look, confirmed=look in looks[:3])
        store.settle("run", [looks[4].location], confirmed=False)
    with McapRecorder(simulation.truth_log, when_full=wait_for_disk) as log:
        log.record(Topic.TRUTH, 0, at(0, 0.0, height_m=0.1))
    with McapRecorder(simulation.flight_log, when_full=wait_for_disk) as log:
        log.record(Topic.STATUS, 0, status(0, Phase.DONE))
    found = {fault.kind: fault.value for fault in judge_flight(simulation).faults}
    assert found["unanswered"] == 48 - 3


@pytest.mark.parametrize("kind", ["companion_dead", "uplink_silent"])
def test_what_reaches_no_autopilot_neither_steers_nor_leans(simulation: Simulation, kind: str) -> None:
    found = faults(simulation, kind)
    assert "out_of_control" in found
    assert "leaned_on_floor" not in found


@pytest.mark.parametrize(
    ("took", "judged"),
    [("the autopilot's own failsafe took control", True), ("the pilot took control", False)],
)
def test_in_another_simulator_a_failsafe_is_no_pilot(simulation: Simulation, took: str, judged: bool) -> None:
    """It is handed over in the air, and never comes down."""
    with McapRecorder(simulation.truth_log, when_full=wait_for_disk) as log:
        for stamp_ns in range(0, END_S * S, S // 10):
            log.record(Topic.TRUTH, stamp_ns, at(stamp_ns, 0.0, height_m=1.6 if stamp_ns > S else 0.1))
    with McapRecorder(simulation.flight_log, when_full=wait_for_disk) as log:
        log.record(Topic.STATUS, 0, status(0))
        told = Event(BEGUN_S * S, EventLevel.WARNING, "phase", f"follow -> pilot: {took}")
        log.record(Topic.EVENT, told.stamp_ns, told)
        log.record(Topic.STATUS, told.stamp_ns, status(told.stamp_ns, Phase.PILOT))
    elsewhere = replace(simulation, truth_url="udp:there")
    assert ("stayed_up" in {fault.kind for fault in judge_flight(elsewhere).faults}) is judged


def test_what_a_computer_sends_counts_again_once_it_has_come_back(simulation: Simulation) -> None:
    assert "leaned_on_floor" in faults(simulation, "companion_dead", ended_s=BEGUN_S + 5)


def test_what_a_computer_sends_that_is_alive_counts_whatever_else_fails(simulation: Simulation) -> None:
    found = faults(simulation, "telemetry_silent")
    assert "out_of_control" not in found
    assert "leaned_on_floor" in found


@pytest.mark.parametrize(
    ("unseen_s", "dropped", "lost"),
    [
        ((0.0, 0.0), 0, False),
        ((0.0, 0.0), 1, True),
        ((20.0, 20.4), 0, False),
        ((20.0, 20.7), 0, True),
        ((25.8, 27.0), 0, True),
        ((30.0, 35.0), 0, False),
    ],
    ids=["whole", "dropped", "short", "in the air", "while it came down", "on the floor"],
)
def test_what_is_not_known_of_the_truth_is_bad(
    simulation: Simulation, unseen_s: tuple[float, float], dropped: int, lost: bool
) -> None:
    found = faults(simulation, "telemetry_silent", unseen_s=unseen_s, dropped=dropped)
    assert ("truth_lost" in found) is lost


def test_a_truth_that_cannot_be_read_to_its_end_is_bad(simulation: Simulation) -> None:
    faults(simulation, "telemetry_silent")
    whole = simulation.truth_log.read_bytes()
    simulation.truth_log.write_bytes(whole[: len(whole) // 2])
    assert "truth_lost" in {fault.kind for fault in judge_flight(simulation).faults}
