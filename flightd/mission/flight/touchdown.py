"""The last metres above a pad: wait until it lies straight below, then down in one go.  Pure."""

from __future__ import annotations

import math

from flightd.config.mission import MissionConfig
from flightd.mission.guidance import MissionInputs

ALIGN_M = 0.85
"""From this height down neither pad nor lines are wholly in the picture for long: aim before."""
_AIMED_M = 0.04
_AIMED_MPS = 0.08
_AIM_S = 6.0
"""Not longer: a draught may never let it stand still."""
_SLOW_OVER_PAD = 0.62
"""Where it has aimed, it slows down later: what is flown unseen is short then."""
_UNSEEN_S = 1.6
"""So long the last stretch may be flown on the motion known when the last line left the picture."""


class Touchdown:
    """One planned landing: call `begin`, then `rate_mps` at each tick."""

    def __init__(self, params: MissionConfig) -> None:
        self._params = params
        self._left_s = _AIM_S

    def begin(self) -> None:
        self._left_s = _AIM_S

    def rate_mps(self, s: MissionInputs, target_m: tuple[float, float] | None) -> float:
        """Rate of descent; 0 while it still aims at `target_m` (None: it lands where it is)."""
        p = self._params
        height_m = 0.0 if math.isnan(s.height_m) else s.height_m
        if (
            target_m is not None
            and abs(height_m - ALIGN_M) < 0.1
            and self._left_s > 0.0
            and s.pose is not None
        ):
            off_m = math.hypot(s.pose.x_m - target_m[0], s.pose.y_m - target_m[1])
            if off_m > _AIMED_M or math.hypot(s.pose.vx_mps, s.pose.vy_mps) > _AIMED_MPS:
                self._left_s -= s.dt_s
                return 0.0
        slow_below_m = p.expert.touch_below_m if target_m is None else _SLOW_OVER_PAD * p.expert.touch_below_m
        return p.expert.touch_mps if height_m < slow_below_m else p.land_mps

    def unseen_s(self, s: MissionInputs, target_m: tuple[float, float] | None) -> float:
        """How old the newest line may be to steer by: the usual, and more just above the pad."""
        over_pad = target_m is not None and s.height_m < ALIGN_M
        return _UNSEEN_S if over_pad else self._params.lines_hold_s
