"""How good a flight was, against the simulator's truth: the figures of `summary.json`.

Both sides are read from their logs after the flight: what the daemon claimed from its own, where the
drone really was from the simulator's.  The whole flight counts, from take-off to landing or to the pilot's
take-over, whatever phase the daemon claims to be in.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from flightd.core.types import Event, EventLevel, Phase
from flightd.sim.judge.clearance import clearances
from flightd.sim.judge.flight_evidence import FlightEvidence
from flightd.sim.judge.hover_error import hover_errors
from flightd.sim.judge.meant_leg import off_leg
from flightd.sim.judge.motion import TrueMotion, Values
from flightd.sim.plant.kinematics import OFF_FLOOR_M

_AT_NODE_M = 0.5
"""A node counts as visited rightly when the drone was within this of it (less than half a cell)."""
_ASIDE_M = 0.4
"""So much farther along the aisle where no other node is as near: from there a shelf is looked at again
(`scan.aside_m`)."""
_CONTROL_GAP_S = 0.5
"""Setpoints further apart leave the drone to itself."""
_SUNK_M, _SINKS_S = 0.1, 1.0
"""Who is lower by so much than it ever was until so long ago, since nobody steers it, is being landed by
its autopilot; who bobs or sags is not."""


@dataclass(frozen=True, slots=True)
class FlightScore:
    """The flight's part of the summary; metres, seconds.  None where there was nothing to measure.

    `hover_error_p95_m` is off the place where it was to stand (`hover_error`), `cross_track_*` are off the
    leg that was meant (`meant_leg`); `min_clearance_m` is free between the body with its propellers and
    racks, ceiling and keep-outs, below 0 in them; `max_overshoot_m` how far above the commanded height it
    came; `uncontrolled_s` the longest time in the air in which neither setpoints went out nor the autopilot
    was landing it."""

    mission: str
    reason: str
    nodes_planned: int
    nodes_visited: int
    nodes_miscounted: int
    cross_track_rms_m: float | None
    cross_track_max_m: float | None
    hover_error_p95_m: float | None
    landed_error_m: float | None
    flight_time_s: float
    sorties: int
    min_clearance_m: float | None
    max_overshoot_m: float | None
    uncontrolled_s: float | None


def score(flight: FlightEvidence) -> FlightScore:
    """Measure one flight."""
    final = flight.statuses[-1] if flight.statuses else None
    visits = [event for event in flight.events if event.name == "visited"]
    right = [event for event in visits if _at_node(flight, event)]
    off = off_leg_in_air(flight)
    off = off[np.isfinite(off)]
    hover = hover_errors(flight, visits)
    above = overshoot(flight)
    free = [clearance.least_m for clearance in clearances(flight.site, flight.motion)]
    return FlightScore(
        mission="completed" if final and final.phase is Phase.DONE else "aborted",
        reason=final.reason if final else "the daemon never spoke",
        nodes_planned=flight.plan.nodes,
        nodes_visited=len(flight.plan.to_visit & {visit.text for visit in visits}),
        nodes_miscounted=len(visits) - len(right),
        cross_track_rms_m=_rounded(math.sqrt(float(np.mean(off**2))) if len(off) else None),
        cross_track_max_m=_rounded(float(off.max()) if len(off) else None),
        hover_error_p95_m=_rounded(_p95(hover)),
        landed_error_m=_rounded(_landed_error_m(flight)),
        flight_time_s=_flight_time_s(flight.motion),
        sorties=sum(
            after.phase is Phase.TAKE_OFF and before.phase is not Phase.TAKE_OFF
            for before, after in pairwise(flight.statuses)
        ),
        min_clearance_m=_rounded(min(free, default=None)),
        max_overshoot_m=_rounded(max(0.0, float(above.max())) if len(above) else None),
        uncontrolled_s=_rounded(longest_uncontrolled(flight)[1] if flight.setpoints is not None else None),
    )


def off_leg_in_air(flight: FlightEvidence) -> Values:
    """How far beside its leg each sample in the air is, (n,) metres."""
    return off_leg(flight.site, flight.plan.start, flight.statuses, flight.in_air)


def overshoot(flight: FlightEvidence) -> Values:
    """How far above the commanded height each sample in the air is, (n,) metres.  Who has yet to come down
    to it may be as high as it was, and no higher.  Empty where the log tells no commanded height."""
    told = [(s.stamp_ns * 1e-9, s.height_goal_m) for s in flight.statuses if s.height_goal_m is not None]
    motion = flight.in_air
    if not told:
        return np.empty(0)
    stamps, goals = (np.asarray(column, np.float64) for column in zip(*told, strict=True))
    numbers = np.maximum(np.searchsorted(stamps, motion.stamp_s, side="right") - 1, 0)
    above, bound = np.empty(len(motion)), 0.0
    for i, (height_m, goal_m) in enumerate(zip(motion.height_m, goals[numbers], strict=True)):
        bound = max(goal_m, min(bound, height_m))
        above[i] = height_m - bound
    return above


def longest_uncontrolled(flight: FlightEvidence) -> tuple[float, float]:
    """When the longest time without control began, s of the clock, and how long it was, s; 0 where nothing is
    known of setpoints, which is not where none was sent."""
    motion = flight.in_air
    if flight.setpoints is None:
        return math.inf, 0.0
    sent = np.array([setpoint.stamp_ns for setpoint in flight.setpoints], np.float64) * 1e-9
    if not len(motion):
        return math.inf, 0.0
    before = np.searchsorted(sent, motion.stamp_s, side="right")
    age_s = motion.stamp_s - np.r_[-math.inf, sent][before]
    alone = age_s > _CONTROL_GAP_S
    alone &= ~_sinks(motion, alone)
    longest, since = (math.inf, 0.0), math.inf
    for stamp_s, is_alone in zip(motion.stamp_s, alone, strict=True):
        since = min(since, stamp_s) if is_alone else math.inf
        if stamp_s - since > longest[1]:
            longest = (float(since), float(stamp_s - since))
    return longest


def _sinks(motion: TrueMotion, alone: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """At which samples, (n,), of those where the drone is `alone` its autopilot lands it."""
    sinks = np.zeros(len(motion), np.bool_)
    least_m, seen = math.inf, 0
    for number in range(len(motion)):
        if not alone[number]:
            least_m, seen = math.inf, number + 1
            continue
        while motion.stamp_s[seen] <= motion.stamp_s[number] - _SINKS_S:
            least_m = min(least_m, float(motion.height_m[seen]))
            seen += 1
        sinks[number] = math.isfinite(least_m) and motion.height_m[number] < least_m - _SUNK_M
    return sinks


def _landed_error_m(flight: FlightEvidence) -> float | None:
    """From the centre of the pad that it landed on by plan; None where the landing was ordered elsewhere."""
    landed = flight.landed
    begun = flight.landings
    goal = next((status.goal for status in reversed(flight.statuses) if status.phase is Phase.LAND), None)
    pad = next((pad for pad in flight.site.pads if pad.node == goal), None)
    if landed is None or pad is None or not begun or begun[-1].level is not EventLevel.INFO:
        return None
    x_m, y_m = flight.site.pad_centre(pad)
    return math.hypot(landed.x_m - x_m, landed.y_m - y_m)


def _at_node(flight: FlightEvidence, event: Event) -> bool:
    node, there = flight.site.nodes.get(event.text), flight.truth_at(event.stamp_ns)
    if node is None or there is None:
        return False
    along_m = abs(there.x_m - node.x_m)
    if flight.site.nearest(there.x_m, there.y_m) == node:
        along_m = max(along_m - _ASIDE_M, 0.0)
    return math.hypot(along_m, there.y_m - node.y_m) < _AT_NODE_M


def _flight_time_s(motion: TrueMotion) -> float:
    """Time off the floor, in all sorties together."""
    both = np.minimum(motion.height_m[1:], motion.height_m[:-1]) > OFF_FLOOR_M
    return round(float(np.diff(motion.stamp_s)[both].sum()), 2)


def _p95(values: Sequence[float]) -> float | None:
    return sorted(values)[min(int(0.95 * len(values)), len(values) - 1)] if values else None


def _rounded(value: float | None) -> float | None:
    return None if value is None or math.isinf(value) else round(value, 4)
