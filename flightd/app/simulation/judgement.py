"""A simulated flight judged by its two logs: figures, faults, one verdict."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

from flightd.app.simulation.meant_flight import meant_flight
from flightd.app.simulation.sensor_summary import sensor_summary
from flightd.app.simulation.simulation import Simulation
from flightd.app.simulation.stock_summary import stock_summary
from flightd.core.topics import Topic
from flightd.core.tracks import last_known
from flightd.core.types import AttitudeSetpoint, Event, Phase, Status
from flightd.mission.safety.hazard_table import HAZARDS
from flightd.mission.triggers import Trigger
from flightd.replay.log import FlightLog, read_log
from flightd.sim.judge.flight_evidence import FlightEvidence, phase_begins
from flightd.sim.judge.flight_score import FlightScore, score
from flightd.sim.judge.hazard_verdict import HazardVerdict, judged_hazard
from flightd.sim.judge.verdict import JudgedFault, judged
from flightd.sim.plant.kinematics import ArmedChange, Kinematics
from flightd.sim.scenario.scenario import Scenario

_UNHEARD = frozenset({"companion_dead", "uplink_silent"})
"""Faults during which the autopilot hears no setpoint."""
_CUT_OFF = _UNHEARD | {"telemetry_silent", "heartbeat_silent"}
"""Those, and those during which it is not heard."""


@dataclass(frozen=True, slots=True)
class Judgement:
    """`stock` and `sensors` are the summary's keys of the count and of what the flight learnt; `hazard` is
    how the hazard that the scenario expects went, None where it expects none.  `faults` are all that was
    wrong, what the scenario expects left out."""

    score: FlightScore
    stock: dict[str, Any]
    sensors: dict[str, Any]
    hazard: HazardVerdict | None
    faults: tuple[JudgedFault, ...]

    @property
    def verdict(self) -> str:
        return "bad" if self.faults else "good"


def judge_flight(simulation: Simulation) -> Judgement:
    """Judge the flight whose logs stand in the simulation's folder."""
    flown = read_log(simulation.flight_log, {Topic.STATUS, Topic.EVENT, Topic.SETPOINT, Topic.COMMAND})
    meant = meant_flight(simulation, flown)
    world = read_log(simulation.truth_log, {Topic.TRUTH, Topic.FAULT, Topic.ARMED})
    truth = [Kinematics(**row) for row in _rows(world, Topic.TRUTH, Kinematics)]
    armed = [ArmedChange(**row) for row in _rows(world, Topic.ARMED, ArmedChange)]
    notes = [e.message for e in world.entries if e.topic == Topic.FAULT and isinstance(e.message, dict)]
    begun = [note for note in notes if note["began"]]
    unheard = _lasted([note for note in notes if note["kind"] in _UNHEARD])
    statuses = flown.messages(Status)
    evidence = FlightEvidence(
        site=simulation.painted_site,
        plan=meant.plan,
        statuses=statuses,
        events=flown.messages(Event),
        truth=truth,
        # what reaches nobody steers nobody
        setpoints=[
            sent
            for sent in flown.messages(AttitudeSetpoint)
            if not any(since_ns <= sent.stamp_ns < until_ns for since_ns, until_ns in unheard)
        ],
        armed=armed or None,
        piloted_ns=_piloted_ns(simulation, begun, flown.messages(Event)),
        lost=_lost(flown),
    )
    figures = score(evidence)
    stock = stock_summary(simulation, meant, figures.flight_time_s)
    faults = judged(
        evidence,
        figures,
        codes_wrong=stock["codes_wrong"],
        empty_wrong=stock.get("empty_wrong", 0),
        truth_lost=_lost(world) + evidence.motion.gaps,
        cut_off=_cut_off(simulation.scenario),
        not_looked_at=stock.get("locations_planned", 0) - stock.get("locations_visited", 0),
    )
    sensors = _sensors(simulation, statuses, truth)
    expected = simulation.scenario.expect
    if expected is None:
        return Judgement(figures, stock, sensors, None, tuple(faults))
    row = next(row for row in HAZARDS if row.name == expected.hazard)
    verdict = judged_hazard(row, expected, evidence, figures, faults, [note["stamp_ns"] for note in begun])
    return Judgement(figures, stock, sensors, verdict, verdict.faults)


def _sensors(
    simulation: Simulation, statuses: Sequence[Status], truth: Sequence[Kinematics]
) -> dict[str, Any]:
    """What the flight found out of its sensors at its end, beside what they were then."""
    seen = last_known([status.sensors for status in statuses])
    told_ns = next((status.stamp_ns for status in reversed(statuses) if status.sensors.is_known), 0)
    heights = ((k.stamp_ns, k.height_m) for k in truth)
    leapt = simulation.unknowns.camera_leap.since_s(heights, told_ns) > 0.0
    return sensor_summary(simulation, seen, leapt=leapt)


def _piloted_ns(simulation: Simulation, begun: Sequence[dict[str, Any]], events: Sequence[Event]) -> float:
    """From when on there is a pilot: in our simulator when he takes the sticks; in another one always, but
    where the autopilot itself says that a failsafe of its own took over."""
    if simulation.truth_url:
        failsafe = f"{Phase.PILOT.value}: {Trigger.FAILSAFE_TOOK.value}"
        taken = phase_begins(events, Phase.PILOT)
        return math.inf if any(failsafe in event.text for event in taken) else -math.inf
    return min((note["stamp_ns"] for note in begun if note["kind"] == "pilot"), default=math.inf)


def _cut_off(scenario: Scenario) -> bool:
    """Whether autopilot and computer do not hear each other: by what a scenario expects, or by its faults
    where it expects nothing."""
    if scenario.expect is not None:
        return scenario.expect.cut_off
    return any(fault.kind in _CUT_OFF for fault in scenario.fault)


def _lasted(notes: Sequence[dict[str, Any]]) -> list[tuple[float, float]]:
    """From when to when, ns, each fault of these notes lasted; to infinity where it never ended."""
    return [
        (
            begin["stamp_ns"],
            next(
                (
                    end["stamp_ns"]
                    for end in notes
                    if not end["began"]
                    and end["index"] == begin["index"]
                    and end["stamp_ns"] >= begin["stamp_ns"]
                ),
                math.inf,
            ),
        )
        for begin in notes
        if begin["began"]
    ]


def _lost(log: FlightLog) -> int:
    """Messages that were not written, and one for what cannot be read any more."""
    return int(log.metadata.get("dropped", "0")) + bool(log.damage)


def _rows(log: FlightLog, topic: Topic, kind: type) -> list[dict[str, Any]]:
    """The messages of a topic with the fields of `kind` alone, which viewers' fields stand beside."""
    names = [field.name for field in fields(kind)]
    return [
        {name: entry.message[name] for name in names}
        for entry in log.entries
        if entry.topic == topic and isinstance(entry.message, dict)
    ]
