"""What the mission's inputs say of hazards: which of them hold now, each after its own time.  Pure."""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass
from typing import TypeAlias

from flightd.config.schema import Config
from flightd.core.types import VehicleState
from flightd.mission.debounce_timer import DebounceTimer
from flightd.mission.guidance import MissionInputs
from flightd.mission.safety.hazard_table import Action, triggers_of
from flightd.mission.safety.view_monitor import FloorViewMonitor
from flightd.mission.triggers import Trigger

GIVE_UP_S = 60.0
"""A vehicle that nobody heard for so long while it should land is not waited for."""
_TICK_S = 0.06
_GAP_S = 0.3
"""Shorter than what the autopilot's own failsafe for a silent computer takes."""
_NEWS_S = 1.0
"""Something that was replaced is news for so long."""
_CLOCK_S = 0.3
"""So soon clocks are compared anew after a reboot or a jump."""
_CLIMBS_UNSEEING_S = 1.0
"""So long a take-off, which hardly steers, goes on without a picture, or with the same one."""
_OFF_FLOOR_M = 0.5
"""Below, a picture may well stay the same: of the pad itself, packed so that its noise is gone."""
_RISES_UNSEEING_M, _RISES_UNSEEING_SHARE = 1.0, 0.65
"""So high, or so far up to its flying height, goes a take-off that sees no line of the map: nothing steers
it, and it drifts by the square of the time."""
TAKEN_OVER = triggers_of(Action.HANDS_OFF)
"""Somebody else has the vehicle."""
_SWINGS_LAND_S = 12.0
"""A drone that swings about its place, and does nothing worse, is held for so long: its loop has been slowed
down, and corridor and push are judged by themselves."""
_JUMPED = 2
"""So many attitudes with a senseless time are no stray datagram."""

_HOLDING_BUT_LINES = triggers_of(Action.HOLD) - {Trigger.LINES_LOST}
_Conditions: TypeAlias = dict[Trigger, tuple[bool, float]]
"""Whether each hazard's condition holds now, and for how long it is tolerated."""


@dataclass(frozen=True, slots=True)
class FlightContext:
    """What the mission is at: in the air, paused, on or stopped on a leg along the map's x axis (None: on no
    leg), holding, high enough that lines are to be seen."""

    airborne: bool
    paused: bool
    leg_along_x: bool | None
    holds: bool = False
    at_height: bool = True
    takes_off: bool = False


class Counted:
    """Whether a count has lately risen, by at least `step` at once or within the time it is news."""

    def __init__(self, least: int = 1) -> None:
        self._least = least
        self._base = 0
        self._count = 0
        self._risen_ns: int | None = None

    def step(self, count: int, now_ns: int) -> bool:
        if count < self._count:  # counted anew, by what came in its place
            self._risen_ns, self._base = None, 0
        if count > self._count:
            self._risen_ns = now_ns
        elif self._risen_ns is not None and (now_ns - self._risen_ns) * 1e-9 > _NEWS_S:
            self._risen_ns, self._base = None, count
        self._count = count
        return self._risen_ns is not None and count - self._base >= self._least


class HazardMonitor:
    """Call `step` at each tick: the triggers of all hazards that hold, and of lines found again."""

    def __init__(self, config: Config) -> None:
        self._params = config.mission
        self._hazards = config.hazards
        self._debounce: defaultdict[Trigger, DebounceTimer] = defaultdict(DebounceTimer)
        self._trouble, self._worse = DebounceTimer(), DebounceTimer()
        self._detectors, self._writers, self._stamps = Counted(), Counted(), Counted(_JUMPED)
        self._delay_leaps, self._lean_leaps = Counted(), Counted()
        self._seen = DebounceTimer()
        self.blind = FloorViewMonitor(config)
        self._unseen_ns: int | None = None
        self.unseen_s = 0.0
        """For how long the lines have been lost, glimpses not counted."""

    def step(self, s: MissionInputs, situation: FlightContext) -> set[Trigger]:
        conditions = self._links(s)
        conditions |= self._daemon(s)
        found = self._sight(s, situation)
        if s.vehicle is not None:
            found |= self._authority(s, s.vehicle) if situation.airborne else set()
            conditions |= self._vehicle(s, s.vehicle)
        conditions |= self._pictures(s, situation)
        conditions |= self._place(s)
        for trigger, (present, tolerated_s) in conditions.items():
            holds = present and situation.airborne
            if self._debounce[trigger].step(holds, s.now_ns) >= tolerated_s and holds:
                found.add(trigger)
        holding = found & _HOLDING_BUT_LINES
        held_s = self._trouble.step(bool(holding), s.now_ns)
        worse_s = self._worse.step(bool(holding - {Trigger.SWINGS}), s.now_ns)
        lasts_s = self._params.lines_land_s
        if held_s > max(_SWINGS_LAND_S, lasts_s) or worse_s > lasts_s:
            found.add(Trigger.HAZARD_LASTS)
        return found - {Trigger.LINES_FOUND} if holding else found

    def battery_low(self, s: MissionInputs) -> bool:
        p, charge = self._params, s.charge
        return p.battery_land <= charge.frac < p.battery_home or charge.low

    def _authority(self, s: MissionInputs, v: VehicleState) -> set[Trigger]:
        if v.unheard or s.telemetry_age_s >= self._params.telemetry_hold_s:
            return set()  # silence is no pilot: a lost link is lost
        if not v.armed:
            return {Trigger.DISARMED}
        if v.in_control:
            return set()
        return {Trigger.FAILSAFE_TOOK if v.in_failsafe else Trigger.PILOT_TOOK}

    def _vehicle(self, s: MissionInputs, v: VehicleState) -> _Conditions:
        p, h = self._params, self._hazards
        heartbeat_s = (s.now_ns - v.heartbeat_ns) * 1e-9
        jumped = self._stamps.step(v.stamps_refused, s.now_ns) or s.dt_s > _GAP_S
        heard = s.telemetry_age_s <= p.telemetry_hold_s  # silence as a whole is another hazard
        climbless = math.isnan(v.climb_mps) or v.climb_contradicted
        return {
            Trigger.CLIMB_LOST: (climbless and heard, p.telemetry_hold_s),
            Trigger.HEARTBEAT_LOST: (heartbeat_s > h.heartbeat_land_s, 0.0),
            Trigger.BATTERY_CRITICAL: (s.charge.frac < p.battery_land or s.charge.empty, 0.0),
            Trigger.BATTERY_UNKNOWN: (s.charge.doubt is not None, 0.0),
            Trigger.BATTERY_LOW: (self.battery_low(s), 0.0),
            Trigger.CLOCK_JUMP: (jumped, 0.0),
            Trigger.CLOCK_UNSURE: (not v.clock_error_s <= h.clock_error_s, _CLOCK_S),
        }

    def _links(self, s: MissionInputs) -> _Conditions:
        p = self._params
        age_s = s.telemetry_age_s
        beat_s = math.inf if s.vehicle is None else (s.now_ns - s.vehicle.heartbeat_ns) * 1e-9
        return {
            Trigger.TELEMETRY_STALE: (age_s > p.telemetry_hold_s, 0.0),
            Trigger.TELEMETRY_LOST: (age_s > p.telemetry_land_s, 0.0),
            Trigger.VANISHED: (max(age_s, beat_s) > p.telemetry_land_s, GIVE_UP_S),
            Trigger.HEIGHT_LOST: (math.isnan(s.height_m), p.telemetry_land_s),
        }

    def _daemon(self, s: MissionInputs) -> _Conditions:
        h, w, health = self._hazards, s.warnings, s.warnings.health
        slow = health.latency_p99_s > h.latency_s or w.tick_s > _TICK_S
        return {
            Trigger.OVERLOAD: (slow, h.overload_s),
            Trigger.RECORD_LOST: (bool(health.recorder_error), 0.0),
            Trigger.AISLE_OPEN: (not s.aisle_closed, 0.0),
            Trigger.DETECTOR_LOST: (self._detectors.step(health.detectors_replaced, s.now_ns), 0.0),
            Trigger.RECORDER_DEAD: (self._writers.step(health.recorder_restarts, s.now_ns), 0.0),
        }

    def _pictures(self, s: MissionInputs, situation: FlightContext) -> _Conditions:
        tolerated_s, w = self._params.lines_hold_s, s.warnings
        if situation.takes_off:
            tolerated_s = max(tolerated_s, _CLIMBS_UNSEEING_S)
        by_floor = situation.takes_off and not s.height_m > _OFF_FLOOR_M
        return {
            Trigger.CAMERA_FROZEN: (w.frozen_s > tolerated_s and not by_floor, 0.0),
            Trigger.CAMERA_BLIND: (w.blank_s > tolerated_s and not by_floor, 0.0),
            Trigger.FRAMES_STALE: (w.frame_age_s > tolerated_s, 0.0),
        }

    def _place(self, s: MissionInputs) -> _Conditions:
        h, w = self._hazards, s.warnings
        return {
            Trigger.HEIGHT_STUCK: (w.height_stuck, 0.0),
            Trigger.CLIMB_WRONG: (w.climb_wrong, 0.0),
            Trigger.HEIGHT_WRONG: (w.height_doubted, h.disagree_s),
            Trigger.ATTITUDE_WRONG: (abs(w.heading_error_rad) > h.heading_rad, h.disagree_s),
            Trigger.WIND: (w.push_mps2 > h.expert.push_mps2 or w.off_m > h.expert.off_m, h.expert.push_s),
            Trigger.SWINGS: (w.swings, 0.0),
            Trigger.DELAY_LEAPT: (self._delay_leaps.step(w.delay_leaps, s.now_ns), 0.0),
            Trigger.LEAN_LEAPT: (self._lean_leaps.step(w.lean_leaps, s.now_ns), 0.0),
            Trigger.CEILING_LEFT: (w.headroom_m < 0.0, h.expert.outside_s),
            Trigger.CORRIDOR_LEFT: (w.outside_m > 0.0, h.expert.outside_s),
        }

    def _sight(self, s: MissionInputs, situation: FlightContext) -> set[Trigger]:
        """Lines lost and found; on a leg the line that is followed must be seen, whatever else is.  The time
        without lines runs on through short glimpses: only lines that stay for a while end it."""
        p = self._params
        lost = min(s.x_age_s, s.y_age_s) > p.lines_hold_s or not s.localised
        self.blind.step(s, situation.leg_along_x)
        tolerated_s = p.lines_hold_s if situation.holds else p.expert.followed_hold_s
        lost = lost or self.blind.unseen_s > tolerated_s
        seen_s = self._seen.step(not lost, s.now_ns)
        if seen_s > p.expert.lines_found_s or not situation.at_height:
            self._unseen_ns = None
        elif lost and self._unseen_ns is None:
            self._unseen_ns = s.now_ns
        self.unseen_s = 0.0 if self._unseen_ns is None else (s.now_ns - self._unseen_ns) * 1e-9
        if situation.takes_off:
            return self._lost_in_take_off(s)
        if lost and (self.unseen_s > p.lines_land_s or self.blind.too_long):
            return {Trigger.LINES_LOST, Trigger.LINES_LOST_LONG}
        if lost:
            return {Trigger.LINES_LOST}
        return {Trigger.LINES_FOUND} if seen_s > p.lines_hold_s and not situation.paused else set()

    def climbs_no_further(self, s: MissionInputs) -> bool:
        """A take-off goes up no more, off the floor with a camera that shows nothing: no climb would help."""
        return self.blind.is_blind and s.height_m > _OFF_FLOOR_M

    @property
    def sees_from_m(self) -> float:
        """From this height up the picture is wide enough for a line of the map, or the pad's mat."""
        return min(_RISES_UNSEEING_M, _RISES_UNSEEING_SHARE * self._params.height_m)

    def _lost_in_take_off(self, s: MissionInputs) -> set[Trigger]:
        """Lines never seen from the pad, nor its mat, or lost for too long: nearer to the floor they come and
        go."""
        if s.by_pad or not s.height_m > self.sees_from_m:
            return set()
        if math.isinf(min(s.x_age_s, s.y_age_s)):
            return {Trigger.NO_LINES}
        return {Trigger.LINES_LOST_LONG} if self.blind.too_long else set()
