"""The scan along the phases of a mission: where it is due, and what each change of phase means for it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from flightd.core.types import OVER, Event, Phase
from flightd.mission.guidance import MissionInputs
from flightd.mission.plan.flight_plan import Stop
from flightd.mission.plan.sweep_leg import SweepLeg
from flightd.mission.reasons import NothingRead
from flightd.mission.scan.no_scan import AnyScanner
from flightd.mission.scan.views import View
from flightd.mission.triggers import Trigger
from flightd.site.site import Site

_TO_VIEW = (Phase.CLIMB, Phase.SCAN)
_ENDS = (Phase.LAND, Phase.DONE, Phase.ABORTED, Phase.PILOT)
_SAME_SHARE = 0.5
"""A position that is corrected by less than this part of the way to the nearest other place is the same."""
_OVER = (Trigger.DWELLED, Trigger.ROUTE_DONE)
_ON_PAD = (Trigger.DOWN_TO_SWAP, Trigger.DOWN_AS_TOLD)
"""Landings after which another flight begins at a position of its own."""
_PASSING = (Phase.FOLLOW, Phase.HOVER, Phase.TURN)
"""In which the pictures of a flight past a shelf count."""


class ShelfScan:
    """Leads a scanner through a flight: `follow` at each change of phase."""

    def __init__(self, site: Site, scanner: AnyScanner) -> None:
        self._scanner = scanner
        self._scanned = ""
        self._sweeping = self._lands_home = False
        self.legs: tuple[SweepLeg, ...] = ()
        """What is to be flown past from the stop that is hovered at."""
        self._apart_m = _least_apart_m(site)

    @property
    def sweeping(self) -> bool:
        """Whether shelves are flown past, which ends with stops before what that leaves open."""
        return self._sweeping

    @property
    def blind(self) -> NothingRead | None:
        """Why the count is none, if it is."""
        return self._scanner.blind

    def take_due(self) -> tuple[str, ...]:
        """The nodes to fly to once more, as `Scanner.take_due`."""
        return self._scanner.take_due()

    def count_anew(self) -> None:
        """The next flight is another count."""
        self._scanned = ""
        self._scanner.count_anew()

    def drain_events(self) -> list[Event]:
        """What the scan has to report since the last call."""
        return self._scanner.drain_events()

    def view(self, phase: Phase) -> View | None:
        """Where to look from, None in phases that do not scan."""
        return self._scanner.view if phase in _TO_VIEW else None

    def doubts(self, phase: Phase) -> set[Trigger]:
        """What a shelf that contradicts the place asks for, until the place is sure again."""
        doubted = self._scanner.doubted and phase is not Phase.RELOCATE
        return {Trigger.POSITION_DOUBTED} if doubted else set()

    def due(self, phase: Phase, stop: Stop) -> bool:
        """Whether there is anything (left) to scan at the stop that is hovered at."""
        if not stop.visit or self.legs:
            return False
        if phase in _TO_VIEW:
            return self._scanner.view is not None
        return self._scanner.wants(stop.node) and not self.is_scanned(stop)

    def is_scanned(self, stop: Stop) -> bool:
        """Whether the hover at this stop follows its scan."""
        return stop.node == self._scanned

    def look_ahead(self, s: MissionInputs, stop: Stop, run: Sequence[str]) -> None:
        """The stop is reached, and with it the nodes `run` of its aisle are to be counted."""
        self.legs = ()
        if stop.visit and s.pose is not None:
            self.legs = self._scanner.legs(run, stop.node, s.pose.yaw_rad, s.height_m)

    def begin_sweep(self) -> tuple[SweepLeg, ...]:
        """Fly past what is to be flown past: its legs."""
        legs, self.legs = self.legs, ()
        self._scanner.begin_sweep(legs)
        self._sweeping = True
        return legs

    def step(self, s: MissionInputs, stop: Stop) -> None:
        """Decide what has been flown past by now on the way to `stop`, and whether its pad proves the way."""
        if self._lands_home and s.pose is not None:
            self._lands_home = s.pose.node == stop.node  # else it was not there before, either
            self._scanner.home(self._lands_home and self._is_certain(s))
        if self._sweeping:
            self._scanner.step_sweep(s.now_ns, stop.sweep, s.speed_mps)

    def paced(self, stop: Stop) -> Stop:
        """What is flown past on the way to it flown past as slowly as its light asks for."""
        if stop.sweep is None or not self._scanner.passing_mps < stop.speed_mps:
            return stop
        return replace(stop, sweep=replace(stop.sweep, speed_mps=self._scanner.passing_mps))

    def end_sweep(self, now_ns: int) -> None:
        """What was not decided in passing is counted by stopping."""
        if self._sweeping:
            self._scanner.end_sweep(now_ns)
            self._sweeping = False

    def follow(
        self, s: MissionInputs, before: Phase, phase: Phase, trigger: Trigger, stop: Stop, shift_m: float
    ) -> None:
        """A phase has changed at (or on the way to) `stop`; `shift_m` is how far off the position was that
        was doubted."""
        scanner = self._scanner
        certain = self._is_certain(s)
        if trigger is Trigger.POSITION_DOUBTED:
            scanner.doubt()
        elif trigger is Trigger.POSITION_SURE:
            moved = shift_m >= _SAME_SHARE * self._apart_m
            if moved:
                scanner.withdraw(s.now_ns, f"the position was {shift_m:.2f} m off")
            scanner.trust(moved=moved)
        elif phase in _ENDS and scanner.doubted:
            scanner.withdraw(s.now_ns, "the position was not found again")
        elif trigger is Trigger.ARRIVED:
            scanner.reached(stop.node, certain)
            self._scanned = ""
        elif trigger is Trigger.SCAN_DUE and s.pose is not None:
            scanner.arrive(stop.node, s.height_m, s.pose.yaw_rad)
        elif trigger is Trigger.AT_VIEW:
            scanner.begin(s.now_ns)
        elif trigger is Trigger.VIEW_MISSED:
            scanner.miss(s.now_ns)
        elif before in _TO_VIEW and phase not in _TO_VIEW:
            scanner.leave()
            self._scanned = stop.node if trigger in _OVER else ""
        if self._sweeping:
            self._lead_sweep(s, phase, trigger, stop)
        self._come_home(s, phase, trigger)

    def _come_home(self, s: MissionInputs, phase: Phase, trigger: Trigger) -> None:
        """Over its pad all is proven, or becomes so on the way down; what is not by then is told, and where
        another flight follows from there it counts no more."""
        self._lands_home = trigger is Trigger.ROUTE_DONE
        if self._lands_home:
            self._scanner.home(self._is_certain(s))
        if trigger in _ON_PAD and self._scanner.unproven:
            self._scanner.withdraw(s.now_ns, "its place was not certain down to the pad")
        if phase in OVER or trigger is Trigger.DOWN_AS_TOLD:
            self._scanner.end(s.now_ns)

    def _is_certain(self, s: MissionInputs) -> bool:
        """Whether what the position says is good enough to prove findings."""
        sure = s.pose is not None and s.pose.integrity >= self._scanner.least_integrity
        return sure and s.localised

    def _lead_sweep(self, s: MissionInputs, phase: Phase, trigger: Trigger, stop: Stop) -> None:
        """Pictures count from the beginning of a leg until the next one's, but for interruptions."""
        if trigger is Trigger.ARRIVED and stop.sweep is not None:
            self._scanner.end_leg(stop.sweep)
        if phase in _ENDS or (trigger is Trigger.TURNED and stop.sweep is None):
            self.end_sweep(s.now_ns)
        elif phase in _PASSING:
            self._scanner.begin_leg(s.now_ns)
        else:
            self._scanner.pause_leg()


def _least_apart_m(site: Site) -> float:
    """The distance between the two neighbouring nodes or lines of a site that are nearest to each other."""
    rows = sorted({aisle.y_m for aisle in site.aisles})
    along = (spacing_m for aisle in site.aisles for spacing_m in aisle.spacing_m)
    return min((*along, *(b - a for a, b in pairwise(rows))), default=math.inf)
