"""How far the drone was from where it was to stand, at its stops: over the node, and where a scan looks
again from nearer or from aside, at the place of that view."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TypeAlias

import numpy as np

from flightd.core.types import AT_STOP, Event, Phase, Status
from flightd.sim.judge.flight_evidence import FlightEvidence
from flightd.site.site import Site

Place: TypeAlias = tuple[float, float]


def hover_errors(flight: FlightEvidence, visits: Iterable[Event]) -> list[float]:
    """Horizontal distances, m, during the whole dwell or scan of each visit (its event ends the stop)."""
    stamps_ns = np.array([status.stamp_ns for status in flight.statuses], np.int64)
    errors: list[float] = []
    motion = flight.motion
    for visit in visits:
        if visit.text not in flight.site.nodes:
            continue
        last = int(np.searchsorted(stamps_ns, visit.stamp_ns)) - 1
        first = last
        while first >= 0 and flight.statuses[first].phase in AT_STOP:
            first -= 1
        wanted = _wanted(flight.statuses[first + 1 : last + 1], flight.site, visit.text)
        if not wanted:
            continue
        begins_s, ends_s = stamps_ns[first + 1] * 1e-9, visit.stamp_ns * 1e-9
        inside = np.flatnonzero((motion.stamp_s > begins_s) & (motion.stamp_s < ends_s))
        told = np.searchsorted(stamps_ns[first + 1 : last + 1] * 1e-9, motion.stamp_s[inside]) - 1
        errors += [
            _apart_m(float(motion.x_m[i]), float(motion.y_m[i]), *wanted[number])
            for i, number in zip(inside, told, strict=True)
        ]
    return errors


def told_view(status: Status) -> Place | None:
    """The place on the map from which a shelf is looked at; None where the status tells none."""
    x_m, y_m = status.view_x_m, status.view_y_m
    return None if x_m is None or y_m is None else (x_m, y_m)


def _wanted(stop: Iterable[Status], site: Site, node: str) -> list[tuple[Place, Place]]:
    """At each status of a stop the line that the drone may be on: from the place before to the one it flies
    to, and where it is to stand that place alone."""
    over_node = site.nodes[node].x_m, site.nodes[node].y_m
    before = here = over_node
    lines = []
    for status in stop:
        place = told_view(status) or over_node
        if place != here:
            before, here = here, place
        if status.phase is not Phase.CLIMB:
            before = here
        lines.append((before, here))
    return lines


def _apart_m(x_m: float, y_m: float, a: Place, b: Place) -> float:
    """Distance of a point from the line between two others."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    length2 = dx * dx + dy * dy
    share = ((x_m - a[0]) * dx + (y_m - a[1]) * dy) / length2 if length2 else 0.0
    share = min(max(share, 0.0), 1.0)
    return math.hypot(x_m - a[0] - share * dx, y_m - a[1] - share * dy)
