"""How a flight with something wrong went: found by the daemon's own log, safe or not by the truth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

from flightd.core.types import Event, Phase, Status
from flightd.mission.safety.hazard_table import PHASE_OF, Hazard
from flightd.sim.judge.flight_score import shelf_distance_m
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.scenario.scenario import Expectation
from flightd.site.corridor import Corridor
from flightd.site.site import Site

BODY_M = 0.3
"""Half the width of the drone, with its propellers."""
WAY_M = 0.9
"""The free way to both sides of the line: the shelves of the demo site less the drone."""
_OFF_FLOOR_M = 0.3
_ON_FLOOR_M = 0.2
_AT_PAD_M = 0.5


@dataclass(frozen=True, slots=True)
class ScenarioVerdict:
    """One row.  `found_s` counts from the first fault (without faults: from take-off), None when the hazard
    was not found; `wrong` says what is not as the table and the scenario have it, "" when all is."""

    hazard: str
    found_s: float | None
    action: str
    phases: tuple[str, ...]
    outcome: str
    min_shelf_distance_m: float | None
    off_line_max_m: float
    left_corridor: bool
    wrong: str


def judge(
    row: Hazard,
    expected: Expectation,
    site: Site,
    begun_ns: Sequence[int],
    statuses: Sequence[Status],
    events: Sequence[Event],
    truth: Sequence[Kinematics],
) -> ScenarioVerdict:
    """`begun_ns` are the times at which faults began; all in time order."""
    ours_ns = next((status.stamp_ns for status in statuses if status.phase is Phase.PILOT), math.inf)
    flying = [t for t in truth if t.height_m > _OFF_FLOOR_M and t.stamp_ns < ours_ns]  # then it is his
    if not flying:
        return ScenarioVerdict(
            row.name, None, row.action.value, (), "never flew", None, 0.0, False, "never flew"
        )
    start_ns = min(begun_ns, default=flying[0].stamp_ns)
    found_s = _found_s(row, events, start_ns)
    after = [status.phase for status in statuses if status.stamp_ns >= start_ns]
    phases = tuple(phase.value for phase, _ in groupby(after))
    shelf_m = min(shelf_distance_m(site, t) for t in flying)
    corridor = Corridor(site, WAY_M)
    off_m = max(corridor.nearest(t.x_m, t.y_m).distance_m for t in flying)
    outcome = _outcome(site, after[-1] if after else None, truth[-1])
    wrongs = []
    if row.trigger is not None and (found_s is None or found_s > expected.found_s):
        wrongs.append("not found" if found_s is None else f"found later than {expected.found_s:g} s")
    phase = PHASE_OF.get(row.action) if row.trigger is not None else None
    if phase is not None and phase not in after:
        wrongs.append(f"never in {phase.value}")
    if outcome != expected.ends:
        wrongs.append(f"{outcome} instead of {expected.ends}")
    if shelf_m <= BODY_M:
        wrongs.append("hit a shelf")
    if off_m > WAY_M:
        wrongs.append("left the corridor")
    return ScenarioVerdict(
        row.name,
        None if found_s is None else round(found_s, 2),
        row.action.value,
        phases,
        outcome,
        None if math.isinf(shelf_m) else round(shelf_m, 2),
        round(off_m, 2),
        off_m > WAY_M,
        "; ".join(wrongs),
    )


def _found_s(row: Hazard, events: Sequence[Event], start_ns: int) -> float | None:
    if row.trigger is None:
        return None
    for event in events:
        if event.name == "hazard" and event.stamp_ns >= start_ns and event.text.startswith(row.trigger.value):
            return (event.stamp_ns - start_ns) * 1e-9
    return None


def _outcome(site: Site, phase: Phase | None, end: Kinematics) -> str:
    if phase is Phase.PILOT:
        return "handed over"
    if end.height_m > _ON_FLOOR_M:
        return "in the air"
    if phase is Phase.DONE:
        return "completed"
    centres = (site.pad_centre(pad) for pad in site.pads)
    home = any(math.hypot(end.x_m - x_m, end.y_m - y_m) < _AT_PAD_M for x_m, y_m in centres)
    return "home" if home else "landed"
