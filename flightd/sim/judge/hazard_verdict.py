"""How a flight with something wrong went: found by the daemon's own log, answered as the table says."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

from flightd.core.types import Event, Phase
from flightd.mission.safety.hazard_table import PHASE_OF, Action, Hazard
from flightd.sim.judge.expectation import Expectation
from flightd.sim.judge.flight_evidence import FlightEvidence
from flightd.sim.judge.flight_score import FlightScore
from flightd.sim.judge.verdict import DOWN_S, MISSION_KINDS, JudgedFault
from flightd.sim.plant.kinematics import ON_FLOOR_M, Kinematics
from flightd.site.site import Site

_AT_PAD_M = 0.5
_LANDS = frozenset({Action.LAND, Action.STOP})
_ENDS = {"landed": {"landed", "home"}, "down": {"landed", "home", "completed"}}
"""What is as good an end as the one that is expected."""


@dataclass(frozen=True, slots=True)
class HazardVerdict:
    """One row.  `found_s` counts from the first fault (without faults, or where that was there before: from
    take-off), None when the hazard was not found; `down_s` from there (unfound: from the fault) to the floor;
    where the row asks for no landing at once, from when one began that the plan has not, and where the
    autopilot takes over and nobody flies, from the fault.  None where no landing followed.  `faults` are all
    that was wrong with the flight, those that the scenario expects left out."""

    hazard: str
    found_s: float | None
    action: str
    phases: tuple[str, ...]
    outcome: str
    down_s: float | None
    min_clearance_m: float | None
    off_leg_max_m: float | None
    max_overshoot_m: float | None
    uncontrolled_s: float | None
    faults: tuple[JudgedFault, ...]


def judged_hazard(
    row: Hazard,
    expected: Expectation,
    flight: FlightEvidence,
    score: FlightScore,
    faults: Sequence[JudgedFault],
    begun_ns: Sequence[int],
) -> HazardVerdict:
    """`faults` are the flight's own (`verdict.judged`), `begun_ns` the times at which what goes wrong
    began, in time order."""
    off_ns = round(flight.begun_s * 1e9) if len(flight.in_air) else 0
    first_ns = min(begun_ns, default=off_ns)
    from_ns = max(first_ns, off_ns)
    found_s = _found_s(row, flight.events, first_ns, from_ns)
    after = [status.phase for status in flight.statuses if status.stamp_ns >= from_ns]
    lands = expected.ends != "completed" or row.shows_landing
    if row.action in _LANDS:
        down_s = _down_s(row, flight, from_ns, found_s) if lands else None
    else:
        down_s = _led_down_s(row, flight, from_ns)
    outcome = _outcome(flight, after[-1] if after else None)
    at_s = _finite(from_ns * 1e-9 - flight.begun_s)
    own = [fault for fault in faults if fault.kind not in _expected(expected)]
    if row.trigger is not None and found_s is None:
        own.append(JudgedFault("not_found", at_s, 0.0))
    elif row.trigger is not None and found_s is not None and found_s > expected.found_s:
        own.append(JudgedFault("found_late", at_s, round(found_s, 2)))
    phase = PHASE_OF.get(row.action) if row.trigger is not None else None
    if phase is not None and phase not in after:
        own.append(JudgedFault("other_action", at_s, 0.0))
    if outcome not in _ENDS.get(expected.ends, {expected.ends}):
        own.append(JudgedFault("other_end", at_s, 0.0))
    if down_s is not None and down_s > DOWN_S and all(fault.kind != "down_late" for fault in own):
        own.append(JudgedFault("down_late", at_s, round(down_s, 2)))
    return HazardVerdict(
        row.name,
        None if found_s is None else round(found_s, 2),
        row.action.value,
        tuple(phase.value for phase, _ in groupby(after)),
        outcome,
        None if down_s is None else round(down_s, 2),
        score.min_clearance_m,
        score.cross_track_max_m,
        score.max_overshoot_m,
        score.uncontrolled_s,
        tuple(fault for fault in own if fault.kind not in expected.tolerates),
    )


def _expected(expected: Expectation) -> frozenset[str]:
    """The kinds of fault that are none in this scenario."""
    mission = MISSION_KINDS if expected.ends != "completed" else frozenset()
    return mission | frozenset(expected.tolerates)


def _found_s(row: Hazard, events: Sequence[Event], first_ns: int, from_ns: int) -> float | None:
    """None where it was not told since `first_ns`."""
    if row.trigger is None:
        return None
    told = f"{row.trigger.value}: "  # what is done follows; other hazards' texts begin like this one's
    for event in events:
        if event.name == "hazard" and event.stamp_ns >= first_ns and event.text.startswith(told):
            return max(0.0, (event.stamp_ns - from_ns) * 1e-9)
    return None


def _down_s(row: Hazard, flight: FlightEvidence, from_ns: int, found_s: float | None) -> float | None:
    """From the finding until it flies no more.  Unfound: from the fault, whatever the daemon did then, for
    nobody may hear it; but what shows only while it lands, from when it began to."""
    if not len(flight.in_air):
        return None
    landing = (s.stamp_ns for s in flight.statuses if s.stamp_ns >= from_ns and s.phase is Phase.LAND)
    if row.shows_landing and (landing_ns := next(landing, None)) is not None:
        since_s = landing_ns * 1e-9
    else:
        since_s = from_ns * 1e-9 + (found_s or 0.0)
    return max(0.0, float(flight.in_air.stamp_s[-1]) - since_s)


def _led_down_s(row: Hazard, flight: FlightEvidence, from_ns: int) -> float | None:
    """Of a row that does not land at once: from the landing that it led to, if any, or from the fault where
    the autopilot took over and nobody flies, until it flies no more."""
    if not len(flight.in_air):
        return None
    since_ns = next((event.stamp_ns for event in flight.landings_in_need if event.stamp_ns >= from_ns), None)
    if row.action is Action.HANDS_OFF:
        since_ns = None if flight.handed_over else from_ns
    if since_ns is None:
        return None
    return max(0.0, float(flight.in_air.stamp_s[-1]) - since_ns * 1e-9)


def _outcome(flight: FlightEvidence, phase: Phase | None) -> str:
    if phase is Phase.PILOT:
        return "handed over"
    if not len(flight.in_air):
        return "never flew"
    if (end := flight.truth[-1]).height_m > ON_FLOOR_M:
        return "in the air"
    if phase is Phase.DONE:
        return "completed"
    return "home" if _on_pad(flight.site, end) else "landed"


def _on_pad(site: Site, end: Kinematics) -> bool:
    centres = (site.pad_centre(pad) for pad in site.pads)
    return any(math.hypot(end.x_m - x_m, end.y_m - y_m) < _AT_PAD_M for x_m, y_m in centres)


def _finite(value: float) -> float:
    return round(value, 2) if math.isfinite(value) else 0.0
