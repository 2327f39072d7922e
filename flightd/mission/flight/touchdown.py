"""The last metres of a landing: aim, go down in one go, and know when it stands.  Pure."""

from __future__ import annotations

import math
from dataclasses import replace

from flightd.config.mission import MissionConfig
from flightd.core.types import Attitude
from flightd.mission.guidance import FLOOR_M, MissionInputs

ALIGN_M = 0.85
AIM_S = 6.0
"""Not longer: a draught may never let it stand still."""
"""From this height down neither pad nor lines are wholly in the picture for long: aim before."""
_AIMED_M = 0.04
_AIMED_MPS = 0.08
_SLOW_OVER_PAD = 0.62
"""Where it has aimed, it slows down later: what is flown unseen is short then."""
_UNSEEN_S = 1.6
"""So long the last stretch may be flown on the motion known when the last line left the picture."""


_STANDS_M = 0.1
"""What the range finder reads on the floor, until it was read there."""
_RECKONED_M, _RECKONED_SHARE = 0.3, 0.2
"""By how much a dead-reckoned height may be wrong, and by what share of the way."""
_UNHEARD_M = 0.25
"""By how much further than to the floor one sinks that is not heard before it is taken to stand."""
_NEAR_FLOOR_M = 0.08
_HIGH_S = 2.0
_STILL_MPS = 0.1
_STILL_M = 0.04
_STILL_RAD = math.radians(2.0)
_TOUCHES_S, _FLIES_S = 0.3, 0.5
"""Down and still, or kept from sinking, for so long it touches; moving for so long it flies again."""
_KEPT_S = 0.4
"""So near the floor, and for so long no nearer though it sinks, it stands, whatever climb it tells."""
_DEFIES_RAD, _DEFIES_STILL_RAD, _DEFIES_S = math.radians(3.0), math.radians(1.0), 0.4
"""An attitude that stays as it is for so long, though another one is commanded, is held by the floor, so be
the range finder and the climb rate what they may."""
_MOVES_MPS, _MOVES_M, _MOVES_S = 0.3, 0.15, 1.5
"""What touches moves again when it climbs or sinks by more, or is so much higher or lower, by its range
finder or by the climb that it told lately: on the floor a told climb wanders by a third of that."""


class Standstill:
    """For how long a vehicle that lands has been down and still, whatever its autopilot says of it: near the
    height that it read on the floor (or with none read), neither climbing nor turning over.  One that reads
    more is down, too, if it has been commanded to sink and was still for a while: its range finder errs."""

    def __init__(self, params: MissionConfig) -> None:
        self._hold_s = params.telemetry_hold_s
        self._floor_m = _STANDS_M
        self._since: tuple[int, float, Attitude] | None = None
        self._blocked_s = self._moving_s = self._sank_s = 0.0
        self._touched_m = math.nan
        self._climbed_m = 0.0
        self._held: Attitude | None = None
        self._kept: tuple[int, float] | None = None
        self._doubted = False
        """In this landing the lines contradicted the range finder: nearer to the floor they no longer can."""
        self.touches = False
        """It stands on something: who stands does not follow a lean, and the position loop would ask for more
        and more of it."""

    def stands(self, height_m: float) -> None:
        """It stands on the floor and reads this, NaN for nothing."""
        if height_m < FLOOR_M:
            self._floor_m = height_m

    def begin(self) -> None:
        """A landing begins."""
        self._since = self._held = self._kept = None
        self._blocked_s, self._sank_s, self.touches = 0.0, 0.0, False
        self._doubted = False

    def step(self, s: MissionInputs, *, sinks: bool) -> float:
        """Seconds; 0 while it moves, is higher, or is not heard.  `sinks`: it is commanded to."""
        told_mps = math.nan if s.vehicle is None else s.vehicle.climb_mps
        climb_mps = told_mps - s.warnings.climb_error_mps
        self._doubted |= s.warnings.height_doubted
        if s.warnings.height_stuck or self._doubted:
            s = replace(s, height_m=math.nan)  # what is wrong may be what is read on the floor
        if not sinks:
            self._sank_s = 0.0  # it has stopped at some height, to aim
        elif climb_mps < -_STILL_MPS:
            self._sank_s += s.dt_s
        # near the floor or after it sank, whatever its range finder reads: elsewhere a climb rate of 0 may be
        # one that stands still
        may_touch = s.height_m <= FLOOR_M or self._sank_s > _TOUCHES_S
        is_held = sinks and abs(climb_mps) <= _STILL_MPS and may_touch
        self._blocked_s = self._blocked_s + s.dt_s if is_held else 0.0
        still_s = self._stood_s(s, climb_mps, sinks=sinks)
        stands = max(still_s, self._blocked_s) > _TOUCHES_S
        is_kept = self._kept_s(s, climb_mps, sinks=sinks) > _KEPT_S
        if self._defies(s, sinks=sinks) or is_kept or stands:
            if not self.touches:
                self._touched_m, self._climbed_m = s.height_m, 0.0
            self.touches, self._moving_s = True, 0.0
        elif self.touches:
            moving_s = s.dt_s if self._moves(s, climb_mps, sinks=sinks) else -s.dt_s
            self._moving_s = max(self._moving_s + moving_s, 0.0)
            self.touches = self._moving_s <= _FLIES_S
        return still_s

    def _moves(self, s: MissionInputs, climb_mps: float, *, sinks: bool) -> bool:
        """Whether what was taken to touch shows that it flies, or is well above the floor and kept there."""
        if math.isfinite(climb_mps):
            self._climbed_m += (climb_mps - self._climbed_m / _MOVES_S) * s.dt_s
        by_height = abs(s.height_m - self._touched_m) > _MOVES_M
        by_climb = abs(climb_mps) > _MOVES_MPS or abs(self._climbed_m) > _MOVES_M
        return by_height or by_climb or (not sinks and s.height_m > FLOOR_M)

    def _kept_s(self, s: MissionInputs, climb_mps: float, *, sinks: bool) -> float:
        """For how long the floor keeps it at its height; the climb that it tells may wander meanwhile."""
        near = s.height_m <= self._floor_m + _NEAR_FLOOR_M
        if not sinks or not near or abs(climb_mps) > _MOVES_MPS or s.telemetry_age_s > self._hold_s:
            self._kept = None
            return 0.0
        if self._kept is None or abs(s.height_m - self._kept[1]) > _STILL_M:
            self._kept = s.now_ns, s.height_m
        return (s.now_ns - self._kept[0]) * 1e-9

    def _defies(self, s: MissionInputs, *, sinks: bool) -> bool:
        """It does not follow the lean that is commanded."""
        v, wanted, before = s.vehicle, s.commanded, self._held
        if v is None or wanted is None or not sinks or s.telemetry_age_s > self._hold_s:
            self._held = None
            return False
        told = v.attitude
        off_rad = max(abs(wanted.roll_rad - told.roll_rad), abs(wanted.pitch_rad - told.pitch_rad))
        if before is None or off_rad < _DEFIES_RAD or _turned_rad(before, told) > _DEFIES_STILL_RAD:
            self._held = told
            return False
        return (told.stamp_ns - before.stamp_ns) * 1e-9 > _DEFIES_S  # a sample that is repeated tells nothing

    def _stood_s(self, s: MissionInputs, climb_mps: float, *, sinks: bool) -> float:
        v = s.vehicle
        if v is None or s.telemetry_age_s > self._hold_s or not _is_steady(s.height_m, climb_mps):
            self._since = None
            return 0.0
        high = s.height_m > self._floor_m + _NEAR_FLOOR_M
        if math.isnan(s.height_m):  # one that hovers is still, too
            high = not self._sank_s > _TOUCHES_S
        if high and not sinks:
            self._since = None
            return 0.0
        if self._since is None or not _is_still(self._since[1:], (s.height_m, v.attitude)):
            self._since = s.now_ns, s.height_m, v.attitude
        still_s = (s.now_ns - self._since[0]) * 1e-9
        return max(still_s - _HIGH_S, 0.0) if high else still_s


def _is_steady(height_m: float, climb_mps: float) -> bool:
    return not (math.isnan(height_m) and math.isnan(climb_mps)) and not abs(climb_mps) > _STILL_MPS


def _is_still(before: tuple[float, Attitude], now: tuple[float, Attitude]) -> bool:
    return not abs(before[0] - now[0]) > _STILL_M and _turned_rad(before[1], now[1]) < _STILL_RAD


def _turned_rad(a: Attitude, b: Attitude) -> float:
    return max(abs(a.roll_rad - b.roll_rad), abs(a.pitch_rad - b.pitch_rad))


class ReckonedHeight:
    """How high above the floor the drone is at least: as measured, by the lines where they contradict that,
    and from then on by the climb that the vehicle tells.  Call `step` at each tick in the air."""

    def __init__(self) -> None:
        self._height_m = math.nan
        self._moved_m: float | None = None
        """How far it has climbed and sunk since it was measured; None while it is."""

    def step(self, s: MissionInputs) -> None:
        climb_mps = math.nan if s.vehicle is None else s.vehicle.climb_mps
        if s.warnings.height_stuck:
            self._height_m = math.nan  # nobody knows since when
        elif not math.isnan(s.height_m):
            self._height_m, self._moved_m = s.believed_height_m, None
        else:
            self._height_m += climb_mps * s.dt_s
            self._moved_m = (self._moved_m or 0.0) + abs(climb_mps) * s.dt_s

    @property
    def least_m(self) -> float:
        """NaN where nothing tells."""
        doubt_m = 0.0 if self._moved_m is None else _RECKONED_M + _RECKONED_SHARE * self._moved_m
        return self._height_m - doubt_m


class UnheardDescent:
    """How far a vehicle that is not heard was commanded to sink since it told its height last: it stands by
    then, and what lines seen from the floor say of its motion is nothing to lean by."""

    def __init__(self, params: MissionConfig) -> None:
        self._hold_s = params.telemetry_hold_s
        self._left_m = math.nan

    def height_m(self, s: MissionInputs) -> float:
        """What is believed of the height: of one that is not heard, what it was commanded to have left; NaN
        where it is not known."""
        return s.believed_height_m if s.telemetry_age_s <= self._hold_s else self._left_m

    def step(self, s: MissionInputs, sink_mps: float) -> bool:
        """Whether it should stand, after sinking at that rate for this tick."""
        if s.telemetry_age_s > self._hold_s:
            self._left_m -= sink_mps * s.dt_s
        else:
            self._left_m = s.believed_height_m if math.isfinite(s.believed_height_m) else math.nan
        return self._left_m < -_UNHEARD_M


class Touchdown:
    """One planned landing: call `begin`, then `rate_mps` at each tick; `height` is stepped by its owner."""

    def __init__(self, params: MissionConfig, height: ReckonedHeight) -> None:
        self._params = params
        self._height = height
        self._left_s = AIM_S

    def begin(self) -> None:
        self._left_s = AIM_S

    def rate_mps(self, s: MissionInputs, target_m: tuple[float, float] | None) -> float:
        """Rate of descent; 0 while it still aims at `target_m` (None: it lands where it is) by what it
        sees."""
        p = self._params
        if (
            target_m is not None
            and abs(s.height_m - ALIGN_M) < 0.1
            and self._left_s > 0.0
            and s.pose is not None
            and min(s.x_age_s, s.y_age_s) <= p.lines_hold_s
        ):
            off_m = math.hypot(s.pose.x_m - target_m[0], s.pose.y_m - target_m[1])
            if off_m > _AIMED_M or math.hypot(s.pose.vx_mps, s.pose.vy_mps) > _AIMED_MPS:
                self._left_s -= s.dt_s
                return 0.0
        slow_below_m = p.expert.touch_below_m if target_m is None else _SLOW_OVER_PAD * p.expert.touch_below_m
        return p.land_mps if self._height.least_m >= slow_below_m else p.expert.touch_mps  # NaN: slowly

    def unseen_s(self, s: MissionInputs, target_m: tuple[float, float] | None) -> float:
        """How old the newest line may be to steer by: the usual, and more just above the pad."""
        over_pad = target_m is not None and s.height_m < ALIGN_M
        return _UNSEEN_S if over_pad else self._params.lines_hold_s
