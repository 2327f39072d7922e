"""How good a flight was, against the simulator's truth: what `summary.json` says.

Both sides are read from their logs after the flight: what the daemon claimed from its own, where the
drone really was from the simulator's.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_left
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise

from flightd.core.types import Event, EventLevel, Phase, Status
from flightd.mission.plan.flight_plan import FlightPlan
from flightd.sim.plant.kinematics import Kinematics
from flightd.site.site import Site

_AT_NODE_M = 0.5
"""A node counts as visited rightly when the drone was within this of it (less than half a cell)."""
_OFF_FLOOR_M = 0.3
_AT_STOP = {Phase.HOVER, Phase.CLIMB, Phase.SCAN}
"""A scan's views are all straight above the node."""
_LAND_BEGINS = re.compile(r"(?!land )\w+ -> land: .*")
"""An event of this phase is a warning where the landing is not the plan's."""
_ON_LINES = _AT_STOP | {Phase.FOLLOW, Phase.TURN, Phase.ACQUIRE, Phase.HOLD}


@dataclass(frozen=True, slots=True)
class FlightScore:
    """The flight's part of the summary; metres, seconds.  None where there was nothing to measure."""

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
    min_shelf_distance_m: float | None


def score(
    site: Site,
    plan: FlightPlan,
    statuses: Sequence[Status],
    events: Sequence[Event],
    truth: Sequence[Kinematics],
) -> FlightScore:
    """Measure one flight.  `statuses`, `events` are the daemon's, all in time order."""
    final = statuses[-1] if statuses else None
    visits = [event for event in events if event.name == "visited"]
    right = [event for event in visits if _at_node(site, event, truth)]
    flying = [t for t in truth if t.height_m > _OFF_FLOOR_M]
    phases = _Phases(statuses)
    on_lines = [_off_line(site, t) for t in flying if phases.at(t.stamp_ns) in _ON_LINES]
    hover = _hover_errors(site, visits, truth, phases)
    landed = truth[-1] if truth and truth[-1].height_m < _OFF_FLOOR_M and flying else None
    return FlightScore(
        mission="completed" if final and final.phase is Phase.DONE else "aborted",
        reason=final.reason if final else "the daemon never spoke",
        nodes_planned=plan.nodes,
        nodes_visited=len({visit.text for visit in visits}),
        nodes_miscounted=len(visits) - len(right),
        cross_track_rms_m=_rounded(_rms(on_lines)),
        cross_track_max_m=_rounded(max(on_lines, default=None)),
        hover_error_p95_m=_rounded(_p95(hover)),
        landed_error_m=_rounded(_landed_error_m(site, statuses, events, landed)) if landed else None,
        flight_time_s=_flight_time_s(truth),
        sorties=sum(
            after.phase is Phase.TAKE_OFF and before.phase is not Phase.TAKE_OFF
            for before, after in pairwise(statuses)
        ),
        min_shelf_distance_m=_rounded(min((shelf_distance_m(site, t) for t in flying), default=None)),
    )


def _landed_error_m(
    site: Site, statuses: Sequence[Status], events: Sequence[Event], landed: Kinematics
) -> float | None:
    """From the centre of the pad that it landed on by plan; None where the landing was ordered elsewhere."""
    begun = [event for event in events if event.name == "phase" and _LAND_BEGINS.fullmatch(event.text)]
    goal = next((status.goal for status in reversed(statuses) if status.phase is Phase.LAND), None)
    pad = next((pad for pad in site.pads if pad.node == goal), None)
    if pad is None or not begun or begun[-1].level is not EventLevel.INFO:
        return None
    x_m, y_m = site.pad_centre(pad)
    return math.hypot(landed.x_m - x_m, landed.y_m - y_m)


def as_summary(result: FlightScore) -> dict[str, object]:
    return asdict(result)


class _Phases:
    """The phase that the daemon said to be in, at any time."""

    def __init__(self, statuses: Sequence[Status]) -> None:
        self._stamps = [status.stamp_ns for status in statuses]
        self._phases = [status.phase for status in statuses]

    def at(self, stamp_ns: int) -> Phase:
        index = bisect_left(self._stamps, stamp_ns) - 1
        return self._phases[index] if index >= 0 else Phase.PREFLIGHT


def _nearest_in_time(truth: Sequence[Kinematics], stamp_ns: int) -> Kinematics | None:
    index = bisect_left(truth, stamp_ns, key=lambda t: t.stamp_ns)
    return truth[min(index, len(truth) - 1)] if truth else None


def _at_node(site: Site, event: Event, truth: Sequence[Kinematics]) -> bool:
    node, there = site.nodes.get(event.text), _nearest_in_time(truth, event.stamp_ns)
    if node is None or there is None:
        return False
    return math.hypot(there.x_m - node.x_m, there.y_m - node.y_m) < _AT_NODE_M


def _off_line(site: Site, t: Kinematics) -> float:
    """Distance from the drone to the nearest edge of the grid, on the floor."""
    return min(_to_segment(t.x_m, t.y_m, site, edge.a, edge.b) for edge in site.edges)


def _to_segment(x: float, y: float, site: Site, a: str, b: str) -> float:
    p, q = site.nodes[a], site.nodes[b]
    dx, dy = q.x_m - p.x_m, q.y_m - p.y_m
    share = ((x - p.x_m) * dx + (y - p.y_m) * dy) / (dx * dx + dy * dy)
    share = min(max(share, 0.0), 1.0)
    return math.hypot(x - p.x_m - share * dx, y - p.y_m - share * dy)


def _hover_errors(
    site: Site, visits: Iterable[Event], truth: Sequence[Kinematics], phases: _Phases
) -> list[float]:
    """Distances from the node during its whole dwell or scan, for each visit."""
    errors: list[float] = []
    for visit in visits:
        node = site.nodes.get(visit.text)
        index = bisect_left(truth, visit.stamp_ns, key=lambda t: t.stamp_ns) - 1
        while node is not None and index >= 0 and phases.at(truth[index].stamp_ns) in _AT_STOP:
            errors.append(math.hypot(truth[index].x_m - node.x_m, truth[index].y_m - node.y_m))
            index -= 1
    return errors


def shelf_distance_m(site: Site, t: Kinematics) -> float:
    """From the drone to the nearest shelf that stands as high as it flies; infinite without one."""
    distances = [
        math.hypot(max(shelf.x0_m - t.x_m, 0.0, t.x_m - shelf.x1_m), t.y_m - shelf.y_m)
        for shelf in site.shelves
        if t.height_m < shelf.height_m
    ]
    return min(distances, default=math.inf)


def _flight_time_s(truth: Sequence[Kinematics]) -> float:
    """Time off the floor, in all sorties together."""
    spans = [
        b.stamp_ns - a.stamp_ns for a, b in pairwise(truth) if min(a.height_m, b.height_m) > _OFF_FLOOR_M
    ]
    return round(sum(spans) * 1e-9, 2)


def _rms(values: Sequence[float]) -> float | None:
    return math.sqrt(math.fsum(v * v for v in values) / len(values)) if values else None


def _p95(values: Sequence[float]) -> float | None:
    return sorted(values)[min(int(0.95 * len(values)), len(values) - 1)] if values else None


def _rounded(value: float | None) -> float | None:
    return None if value is None or math.isinf(value) else round(value, 4)
