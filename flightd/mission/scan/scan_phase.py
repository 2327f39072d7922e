"""The scan as phases of the mission: when it is due, when a view is reached, what the scanner hears."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from flightd.config.mission import Heading, MissionConfig
from flightd.core.geometry import wrap_pi
from flightd.core.types import Phase
from flightd.mission.guidance import MissionInputs
from flightd.mission.plan.flight_plan import HeadingPolicy, Stop
from flightd.mission.scan.scanner import Scanner
from flightd.mission.scan.views import View
from flightd.mission.triggers import Trigger
from flightd.site.site import Site

_TO_VIEW = (Phase.CLIMB, Phase.SCAN)
_ENDS = (Phase.LAND, Phase.DONE, Phase.ABORTED, Phase.PILOT)
_SAME_SHARE = 0.5
"""A position that is corrected by less than this part of the way to the nearest other place is the same."""
_OVER = (Trigger.DWELLED, Trigger.ROUTE_DONE)


class ScanPhase:
    """The mission's side of scanning; without a scanner there is never anything to scan."""

    def __init__(
        self, site: Site, scanner: Scanner | None, params: MissionConfig, policy: HeadingPolicy
    ) -> None:
        self._site = site
        self._heading = policy.heading
        self._scanner = scanner
        self._params = params
        self._scanned = ""
        self._apart_m = _least_apart_m(site)

    def view(self, phase: Phase) -> View | None:
        """Where to look from, None in phases that do not scan."""
        return self._scanner.view if self._scanner is not None and phase in _TO_VIEW else None

    def doubts(self, phase: Phase) -> set[Trigger]:
        """What a shelf that contradicts the place asks for, until the place is sure again."""
        doubted = self._scanner is not None and self._scanner.doubted and phase is not Phase.RELOCATE
        return {Trigger.POSITION_DOUBTED} if doubted else set()

    @property
    def blind(self) -> str:
        """Why nothing is counted although it should be, or an empty text."""
        return self._scanner.blind if self._scanner is not None else ""

    def due(self, phase: Phase, stop: Stop) -> bool:
        """Whether there is anything (left) to scan at the stop that is hovered at."""
        if self._scanner is None or not stop.visit:
            return False
        if phase in _TO_VIEW:
            return self._scanner.view is not None
        return self._scanner.wants(stop.node) and stop.node != self._scanned

    def is_scanned(self, stop: Stop) -> bool:
        """Whether the hover at this stop follows its scan."""
        return stop.node == self._scanned

    def at_view(self, s: MissionInputs, distance_m: float, speed_mps: float) -> bool:
        """Whether the drone is at the view, level with it and facing the shelf."""
        p, view = self._params, self.view(Phase.CLIMB)
        if view is None or s.pose is None:
            return False
        there = distance_m < p.arrive_m and speed_mps < p.expert.arrive_mps
        level = abs(s.height_m - view.height_m) < p.expert.view_height_m
        return there and level and abs(wrap_pi(view.yaw_rad - s.pose.yaw_rad)) < p.expert.arrive_yaw_rad

    def is_over(self, now_ns: int) -> bool:
        """Whether the view that is looked from has told enough."""
        return self._scanner is None or self._scanner.step(now_ns)

    @property
    def look_s(self) -> float:
        """The most that one view is looked from."""
        return self._scanner.look_s if self._scanner is not None else 0.0

    def way_s(self, s: MissionInputs) -> float:
        """How long it may take to reach the view."""
        p, view = self._params, self.view(Phase.CLIMB)
        rise_m = abs(view.height_m - s.height_m) if view is not None else 0.0
        return math.pi / p.turn_rate_radps + (0.0 if math.isnan(rise_m) else rise_m / p.climb_mps)

    def heading_kept(self, s: MissionInputs, before: Stop, stop: Stop) -> Stop:
        """The next stop, flown to backwards where that saves half a turn: along an aisle with the nose to
        the shelf, either side will do, and the drone faces one of them after a scan."""
        scanned = self._scanner is not None and self.is_scanned(before)
        sideways = self._site.nodes[before.node].aisle == self._site.nodes[stop.node].aisle
        if not scanned or not sideways or self._heading is not Heading.SHELF or s.pose is None:
            return stop
        turned = abs(wrap_pi(stop.yaw_rad - s.pose.yaw_rad)) > math.pi * 0.75
        return replace(stop, yaw_rad=wrap_pi(stop.yaw_rad + math.pi)) if turned else stop

    def take_due(self, visited: Sequence[str]) -> tuple[str, ...]:
        """Those of the `visited` nodes that must be visited once more, to count what was withdrawn."""
        due = self._scanner.take_due() if self._scanner is not None else ()
        return tuple(node for node in due if node in visited)

    def changed(
        self, s: MissionInputs, before: Phase, phase: Phase, trigger: Trigger, stop: Stop, shift_m: float
    ) -> None:
        """Tell the scanner of a change of phase at (or on the way to) `stop`; `shift_m` is how far off the
        position was that was doubted."""
        scanner = self._scanner
        if scanner is None:
            return
        certain = s.pose is not None and s.localised and s.pose.integrity >= scanner.least_integrity
        if trigger is Trigger.POSITION_DOUBTED:
            scanner.doubt()
        elif trigger is Trigger.POSITION_SURE:
            if shift_m >= _SAME_SHARE * self._apart_m:
                scanner.withdraw(s.now_ns, f"the position was {shift_m:.2f} m off")
            scanner.trust()
        elif phase in _ENDS and scanner.doubted:
            scanner.withdraw(s.now_ns, "the position was not found again")
        elif trigger is Trigger.ARRIVED:
            scanner.reached(stop.node, certain)
            self._scanned = ""
        elif trigger is Trigger.SCAN_DUE and s.pose is not None:
            scanner.arrive(stop.node, s.height_m, s.pose.yaw_rad)
        elif trigger is Trigger.AT_VIEW:
            scanner.begin(s.now_ns)
        elif before in _TO_VIEW and phase not in _TO_VIEW:
            scanner.leave()
            self._scanned = stop.node if trigger in _OVER else ""
        if trigger is Trigger.ROUTE_DONE:
            scanner.home(certain)


def _least_apart_m(site: Site) -> float:
    """The distance between the two neighbouring nodes or lines of a site that are nearest to each other."""
    rows = sorted({aisle.y_m for aisle in site.aisles})
    along = (spacing_m for aisle in site.aisles for spacing_m in aisle.spacing_m)
    return min((*along, *(b - a for a, b in pairwise(rows))), default=math.inf)
