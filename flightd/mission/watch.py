"""What the mission's senses say of hazards: which of them hold now, each after its own time.  Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass

from flightd.mission.guidance import MissionParams, Senses
from flightd.mission.triggers import Trigger

_HEARTBEAT_S = 2.0
"""A heartbeat comes each second; older than this, modes and arming are those of the past."""


@dataclass(frozen=True, slots=True)
class Situation:
    """What the mission is at: in the air, paused, on a leg along the map's x axis (None: on no leg)."""

    airborne: bool
    paused: bool
    leg_along_x: bool | None


class Lasting:
    """For how long something has held without a break."""

    def __init__(self) -> None:
        self._since_ns: int | None = None

    def step(self, condition: bool, now_ns: int) -> float:
        """Seconds for which `condition` has held; 0 while it does not."""
        if not condition:
            self._since_ns = None
            return 0.0
        if self._since_ns is None:
            self._since_ns = now_ns
        return (now_ns - self._since_ns) * 1e-9


class Watch:
    """Call `step` at each tick: the triggers of all hazards that hold, and of lines found again."""

    def __init__(self, params: MissionParams) -> None:
        self._params = params
        self._no_height = Lasting()
        self._seen = Lasting()
        self._unseen_ns: int | None = None

    def step(self, s: Senses, situation: Situation) -> set[Trigger]:
        found = self._vehicle(s) if situation.airborne else set()
        found |= self._links(s)
        return found | self._sight(s, situation)

    def ground_lost(self, s: Senses) -> bool:
        return s.ground_silent_s > self._params.ground_lost_s

    def battery_low(self, s: Senses) -> bool:
        p = self._params
        return s.vehicle is not None and p.battery_land_frac <= s.vehicle.battery_frac < p.battery_home_frac

    def _vehicle(self, s: Senses) -> set[Trigger]:
        p, v = self._params, s.vehicle
        if v is None:
            return set()
        found = set()
        silent_s = max(s.telemetry_age_s, (s.now_ns - v.heartbeat_ns) * 1e-9 - _HEARTBEAT_S)
        heard = silent_s < p.telemetry_hold_s
        if heard and not v.armed:
            found.add(Trigger.DISARMED)
        elif heard and not v.in_control:  # silence is no pilot: a lost link is a lost link
            found.add(Trigger.PILOT_TOOK)
        if v.battery_frac < p.battery_land_frac:
            found.add(Trigger.BATTERY_CRITICAL)
        return found

    def _links(self, s: Senses) -> set[Trigger]:
        p = self._params
        found = set()
        if s.telemetry_age_s > p.telemetry_land_s:
            found.add(Trigger.TELEMETRY_LOST)
        if self._no_height.step(math.isnan(s.height_m), s.now_ns) > p.telemetry_land_s:
            found.add(Trigger.HEIGHT_LOST)
        return found

    def _sight(self, s: Senses, situation: Situation) -> set[Trigger]:
        """Lines lost and found.  The time without lines runs on through short glimpses: only lines that
        stay for a while end it."""
        p = self._params
        lost = min(s.x_age_s, s.y_age_s) > p.lines_hold_s or not s.localised
        lost = lost or self._off_line(s, situation.leg_along_x)
        seen_s = self._seen.step(not lost, s.now_ns)
        if lost and self._unseen_ns is None:
            self._unseen_ns = s.now_ns
        elif seen_s > p.lines_found_s:
            self._unseen_ns = None
        unseen_s = 0.0 if self._unseen_ns is None else (s.now_ns - self._unseen_ns) * 1e-9
        if lost and unseen_s > p.lines_land_s:
            return {Trigger.LINES_LOST, Trigger.LINES_LOST_LONG}
        if lost:
            return {Trigger.LINES_LOST}
        return {Trigger.LINES_FOUND} if seen_s > p.lines_hold_s and not situation.paused else set()

    def _off_line(self, s: Senses, along_x: bool | None) -> bool:
        """On a leg, the line that is followed must be seen, whatever else is."""
        if along_x is None:
            return False
        return (s.y_age_s if along_x else s.x_age_s) > self._params.followed_hold_s
