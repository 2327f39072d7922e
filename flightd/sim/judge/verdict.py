"""The one verdict on a flight: good, or bad by these faults."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from flightd.core.types import Event, Phase
from flightd.mission.safety.hazard_table import Action
from flightd.sim.judge.clearance import clearances
from flightd.sim.judge.flight_evidence import FlightEvidence, phase_begins
from flightd.sim.judge.flight_score import FlightScore, longest_uncontrolled, off_leg_in_air, overshoot
from flightd.sim.judge.motion import GAP_S
from flightd.sim.plant.kinematics import OFF_FLOOR_M
from flightd.site.site import Site
from flightd.site.ways import BODY_RADIUS_M

OFF_LEG_M = 0.9
"""Further beside its leg it is lost, and nearer where shelves leave less room (`off_leg_bound_m`)."""
OVERSHOOT_M = 0.5
UNCONTROLLED_S, CUT_OFF_S = 1.0, 10.0
"""Longer without control is bad; where autopilot and computer do not hear each other, by what the scenario
does to them, the autopilot must be landing by the second."""
DOWN_S = 20.0
"""On the floor at most so long after a hazard that asks for landing was found, or led to one."""
_OFF_PAD_M = 0.5
_STANDS_M = 0.12
"""A body origin at most this high stands."""
_TOUCHES_M = 0.105
"""One so high carries weight on its legs."""
_HARD_MPS = 1.2
_STAYS_ARMED_S = 15.0
_LEANS_DEG, _SETTLES_S = 6.0, 0.8
"""Whoever leans so much so long after touching down, motors on, slides or tips over its legs."""


@dataclass(frozen=True, slots=True)
class JudgedFault:
    """One thing that was wrong: when, s after take-off, and how much (metres, seconds or a number of
    things, as `kind` says in `KINDS`)."""

    kind: str
    at_s: float
    value: float


KINDS = {
    "hit_rack": "the body touched a rack, by m",
    "hit_ceiling": "the body touched the ceiling, by m",
    "hit_keep_out": "the body was in a keep-out, by m",
    "left_leg": f"more than {OFF_LEG_M:g} m, or than shelves leave room, beside the leg that was meant, by m",
    "too_high": f"more than {OVERSHOOT_M:g} m above the commanded height, by m",
    "out_of_control": (
        f"in the air for more than {UNCONTROLLED_S:g} s without setpoint or landing ({CUT_OFF_S:g} s where a"
        " scenario keeps computer and autopilot from hearing each other), s"
    ),
    "hard_landing": f"touched the floor faster than {_HARD_MPS:g} m/s, m/s",
    "leaned_on_floor": f"commanded to lean by more than {_LEANS_DEG:g} deg while it stands, motors on, deg",
    "stayed_up": "in the air at the end, m above the floor",
    "stayed_armed": f"armed on the floor for more than {_STAYS_ARMED_S:g} s, or at the end, s",
    "record_lost": "messages that the flight log did not take, or its end, number",
    "truth_lost": f"what the log of the truth lacks, and gaps of more than {GAP_S:g} s in the air, number",
    "aborted": "the mission was not completed, nodes left",
    "miscounted": "nodes visited that were others",
    "not_visited": "planned nodes that a completed mission left out",
    "off_pad": f"landed more than {_OFF_PAD_M:g} m beside the pad's centre, m",
    "codes_wrong": "codes in the inventory that are not on the shelf",
    "empty_wrong": "places called empty that are not",
    "unanswered": "planned places of which a completed mission has no look that counts",
    "not_found": "the scenario's hazard was not found",
    "found_late": "the hazard was found later than the scenario allows, s",
    "other_action": "the daemon did not do what the table of hazards says",
    "other_end": "the flight did not end as the scenario says",
    "down_late": f"down later than {DOWN_S:g} s after a hazard that asks for landing, or led to it, s",
}
"""What each kind of fault says, with its value."""

MISSION_KINDS = frozenset({"aborted", "not_visited", "off_pad", "unanswered"})
"""What is no fault where a scenario asks for another end than a completed mission."""
SAFETY_KINDS = frozenset(
    {
        "hit_rack",
        "hit_ceiling",
        "hit_keep_out",
        "too_high",
        "out_of_control",
        "hard_landing",
        "leaned_on_floor",
        "stayed_up",
        "stayed_armed",
        "down_late",
        "truth_lost",
    }
)
"""What must never be, whatever goes wrong; and without the truth nobody knows of it."""
_ASKS_FOR_LANDING = tuple(f": {action.value}" for action in (Action.LAND, Action.STOP))


def judged(
    flight: FlightEvidence,
    score: FlightScore,
    *,
    codes_wrong: int = 0,
    empty_wrong: int = 0,
    not_looked_at: int = 0,
    truth_lost: int = 0,
    cut_off: bool = False,
) -> list[JudgedFault]:
    """All faults of a flight, in the order of `KINDS`.  `not_looked_at`: places that were to be counted,
    and of which it is not even known that they are unreadable or covered; `truth_lost`: what its log lacks,
    and how often nothing is known of the motion for too long; `cut_off`: the scenario keeps autopilot and
    computer from hearing each other."""
    end_s = float(flight.truth[-1].stamp_ns * 1e-9) - flight.begun_s if flight.truth else 0.0
    counts = {
        "record_lost": flight.lost,
        "truth_lost": truth_lost,
        "miscounted": score.nodes_miscounted,
        "codes_wrong": codes_wrong,
        "empty_wrong": empty_wrong,
    }
    if score.mission != "completed":
        counts["aborted"] = max(score.nodes_planned - score.nodes_visited, 1)
    else:
        counts["not_visited"] = score.nodes_planned - score.nodes_visited
        counts["unanswered"] = not_looked_at
    found = [JudgedFault(kind, _finite(end_s), float(count)) for kind, count in counts.items() if count]
    if len(flight.in_air):
        found += [*_in_the_air(flight, CUT_OFF_S if cut_off else UNCONTROLLED_S), *_at_the_floor(flight)]
    if (score.landed_error_m or 0.0) > _OFF_PAD_M and score.landed_error_m is not None:
        found.append(JudgedFault("off_pad", _finite(end_s), score.landed_error_m))
    return sorted(found, key=lambda fault: list(KINDS).index(fault.kind))


def off_leg_bound_m(site: Site) -> float:
    """How far beside its leg a drone may be: what the narrowest aisle's shelves leave for its body."""
    lines_m = {node.y_m for node in site.nodes.values()}
    rooms_m = [abs(shelf.y_m - y_m) - BODY_RADIUS_M for shelf in site.shelves for y_m in lines_m]
    return min(OFF_LEG_M, *rooms_m) if rooms_m else OFF_LEG_M


def _in_the_air(flight: FlightEvidence, most_alone_s: float) -> Iterator[JudgedFault]:
    off = off_leg_in_air(flight)
    above = overshoot(flight)
    # a body slides into a rack on the floor, too
    free, stamps_s = clearances(flight.site, flight.motion), flight.motion.stamp_s
    air_s = flight.in_air.stamp_s
    off_leg_m = off_leg_bound_m(flight.site)
    measured = [
        *((f"hit_{e.obstacle}", stamps_s, -e.free_m, 0.0) for e in free),
        ("left_leg", air_s, off, off_leg_m),  # infinite where nothing was meant: off any leg
        *([("too_high", air_s, above, OVERSHOOT_M)] if len(above) else []),
    ]
    for kind, at_s, values, bound in measured:
        if (wrong := values > bound).any():
            first_s = float(at_s[int(np.argmax(wrong))]) - flight.begun_s
            worst = float(values[np.isfinite(values)].max(initial=bound))
            yield JudgedFault(kind, round(first_s, 2), round(worst, 3))
    since_s, alone_s = longest_uncontrolled(flight)
    if alone_s > most_alone_s:
        yield JudgedFault("out_of_control", round(since_s - flight.begun_s, 2), round(alone_s, 2))


def _at_the_floor(flight: FlightEvidence) -> Iterator[JudgedFault]:
    """How it came down, and how it stands there."""
    motion, begun_s = flight.motion, flight.begun_s
    flying = motion.flying
    touched = np.flatnonzero(flying[:-1] & ~flying[1:])
    low = motion.height_m[:-1] <= OFF_FLOOR_M
    touching = np.flatnonzero(low & (motion.height_m[:-1] > _STANDS_M)).tolist() + touched.tolist()
    sink_mps = -motion.climb_mps[touching]
    if len(sink_mps) and sink_mps.max() > _HARD_MPS:
        at_s = float(motion.stamp_s[touching[int(np.argmax(sink_mps))]]) - begun_s
        yield JudgedFault("hard_landing", round(at_s, 2), round(float(sink_mps.max()), 2))
    yield from _leaning(flight)
    yield from _staying_armed(flight)
    if flight.handed_over:
        return
    asked_s = [event.stamp_ns * 1e-9 for event in _asking_for_landing(flight)]
    last_s = float(flight.in_air.stamp_s[-1])
    first_s = min((at_s for at_s in asked_s if at_s < last_s), default=last_s)
    if last_s - first_s > DOWN_S:
        yield JudgedFault("down_late", round(first_s - begun_s, 2), round(last_s - first_s, 2))
    last = flight.truth[-1]
    end_s = last.stamp_ns * 1e-9
    if last.height_m > OFF_FLOOR_M:
        yield JudgedFault("stayed_up", round(end_s - begun_s, 2), round(last.height_m, 2))


def _asking_for_landing(flight: FlightEvidence) -> list[Event]:
    """The hazards that ask for a landing at once, the landings that others led to, and where there is no
    pilot the take-overs by the autopilot's failsafe, which lands."""
    hazards = [e for e in flight.events if e.name == "hazard" and e.text.endswith(_ASKS_FOR_LANDING)]
    return [*hazards, *flight.landings_in_need, *phase_begins(flight.events, Phase.PILOT)]


def _staying_armed(flight: FlightEvidence) -> Iterator[JudgedFault]:
    """Before each take-off and after each landing; what is armed when a pilot takes over is his."""
    end_s = math.inf if flight.handed_over else float(flight.motion.stamp_s[-1])
    wrong = []
    for down_s, up_s in flight.motion.on_floor_s():
        for since_s, until_s in flight.armed_s():
            first_s, last_s = max(down_s, since_s), min(up_s, until_s)
            if first_s <= last_s == end_s < until_s < math.inf:  # it was heard for longer than it was seen
                last_s = until_s
            at_the_end = until_s == math.inf and first_s <= last_s == end_s
            if last_s - first_s > _STAYS_ARMED_S or at_the_end:
                wrong.append((first_s, last_s - first_s))
    if wrong:
        yield JudgedFault(
            "stayed_armed", round(wrong[0][0] - flight.begun_s, 2), round(max(s for _, s in wrong), 2)
        )


def _leaning(flight: FlightEvidence) -> Iterator[JudgedFault]:
    """What was commanded while it stands: the simulated airframe does not tip over by it, a real one does."""
    motion, sent = flight.motion, flight.setpoints
    stands = motion.height_m <= _TOUCHES_M
    if not sent or not len(motion):
        return
    began = np.flatnonzero(stands & ~np.r_[True, stands[:-1]])  # after a flight, not before the first
    since_s = np.full(len(motion), math.inf)
    for index in began:
        ends = np.flatnonzero(~stands[index:])
        since_s[index : index + ends[0] if len(ends) else None] = motion.stamp_s[index] + _SETTLES_S
    stamps_s = np.array([setpoint.stamp_ns for setpoint in sent], np.float64) * 1e-9
    lean_deg = np.degrees([math.hypot(setpoint.roll_rad, setpoint.pitch_rad) for setpoint in sent])
    at = np.clip(np.searchsorted(motion.stamp_s, stamps_s, side="right") - 1, 0, None)
    wrong = (stamps_s > since_s[at]) & (lean_deg > _LEANS_DEG) & (stamps_s < flight.handed_over_ns * 1e-9)
    if wrong.any():
        first_s = float(stamps_s[int(np.argmax(wrong))]) - flight.begun_s
        yield JudgedFault("leaned_on_floor", round(first_s, 2), round(float(lean_deg[wrong].max()), 1))


def _finite(value: float) -> float:
    """0 for a flight that never began."""
    return round(value, 2) if math.isfinite(value) else 0.0
