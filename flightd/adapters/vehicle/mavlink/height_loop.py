"""Climb rate to collective thrust, for autopilots that take thrust as thrust.

The hover thrust is found at lift-off: on the floor the thrust is ramped up until the vehicle moves, and
what it then carries is very nearly its weight.  In the air a slow integral follows the sagging battery.
After touch-down the thrust is cut, without which PX4 never reports that it has landed.  In the air the
autopilot's word alone never cuts it: a report that is late or wrong would drop the vehicle.
"""

from __future__ import annotations

import enum
import math

from flightd.core.geometry import GRAVITY_MPS2

_RAMP_START = 0.12
_RAMP_PER_S = 0.25
_THRUST_MAX = 0.95
_LIFTED_MPS = 0.12
_LIFTED_M = 0.04
_LIFTED_S = 0.1
"""For so long without a break it must climb, or be higher: a single sample may be a leap of the estimate."""
_HOVER_SHARE = (0.4, 2.0)
"""What the hover thrust may be learnt to be, of the guess: at lift-off, and as the battery sags."""
_SETTLE_MAX_MPS = 0.5
"""The loop begins with the climb that it finds, but with no more."""
_AT_LIFT_OFF = 0.96
"""Share of the thrust at which lift-off was noticed that is the weight: it is noticed a moment late."""

VELOCITY_PER_S = 4.0
"""Acceleration for each m/s that the climb is off."""
_INTEGRAL_PER_S2 = 4.0
_GAIN_LAGGING = 0.7
_SLEW_MPS2 = 2.5
_TRIM_MAX_MPS2 = 3.0
_LEARN_S = 3.0
_LEAST_IN_AIR = 0.35
"""Share of the hover thrust that is always kept in the air."""

_SINKING_MPS = -0.05
_STANDING_MPS = 0.1
_NEAR_FLOOR_M = 0.06
_NEAR_FLOOR_TOLD_M = 0.25
"""The same when the autopilot says that it stands: a pad may be higher than the floor of the take-off."""
_SURELY_UP_M = 0.5
_LIGHT = 0.75
_TOUCHED_S = 0.4
_STEP_MAX_S = 0.1


class _Stage(enum.Enum):
    FLOOR = "floor"
    RAMP = "ramp"
    AIR = "air"


class HeightLoop:
    """One flight's height loop.  Time comes with each call; `release` before a new take-over."""

    def __init__(self) -> None:
        self.hover = 0.5
        """The hover thrust: a guess until the first lift-off."""
        self._stage: _Stage | None = None
        self._stamp_ns = 0
        self._thrust = 0.0
        self._wanted_mps = 0.0
        self._climb_mps = 0.0
        self._trim_mps2 = 0.0
        self._floor_m = math.nan
        self._touched_s = 0.0
        self._lifted_s = self._stuck_s = 0.0
        self._guess = self.hover
        self._gain = 1.0

    @property
    def wanted_mps(self) -> float:
        """The climb rate that it pushes towards in the air: the commanded one, which it reaches by and by."""
        return self._wanted_mps

    @property
    def in_air(self) -> bool:
        """Whether this loop carries the vehicle."""
        return self._stage is _Stage.AIR

    def release(self) -> None:
        """The vehicle is not ours now; where it stands is looked up anew."""
        self._stage = None

    def step(
        self,
        now_ns: int,
        wanted_mps: float,
        *,
        climb_mps: float,
        height_m: float,
        tilt_cos: float,
        armed: bool,
        on_floor: bool,
        lags: bool = False,
    ) -> float:
        """Thrust, 0..1, for a climb rate.

        `climb_mps` and `height_m` are measured just now, NaN when unknown: without a climb rate the last
        one is ended by dead reckoning, and the hover thrust kept.  `on_floor` is what the autopilot says; in
        the air it counts only where the vehicle does not move and is near the floor (or, unseen, the floor
        carries some weight).  `lags`: the climb rate comes late, and is answered more gently.
        """
        dt_s = min(max(now_ns - self._stamp_ns, 0) * 1e-9, _STEP_MAX_S)
        self._stamp_ns = now_ns
        if lags and self._gain == 1.0:
            self._trim_mps2 = 0.0  # it answered a rate that was none
        self._gain = _GAIN_LAGGING if lags else 1.0
        if not armed:
            self._stage, wanted_mps = _Stage.FLOOR, 0.0
        elif self._stage is None:
            up = abs(climb_mps) >= _STANDING_MPS or height_m > _SURELY_UP_M
            self._stage = _Stage.FLOOR if on_floor and not up else _Stage.AIR
            self._settle(climb_mps)
        match self._stage:
            case _Stage.FLOOR:
                self._stand(wanted_mps, height_m)
            case _Stage.RAMP:
                self._ramp(dt_s, wanted_mps, climb_mps, height_m)
            case _:
                self._fly(dt_s, wanted_mps, climb_mps, tilt_cos)
                self._feel_floor(dt_s, wanted_mps, climb_mps, height_m, on_floor)
                self._doubt_lift_off(dt_s, wanted_mps, climb_mps, height_m)
        return self._thrust

    def guess(self, hover: float) -> None:
        """The hover thrust as the autopilot's own parameters have it."""
        self.hover = self._guess = hover

    def _settle(self, climb_mps: float) -> None:
        known = 0.0 if math.isnan(climb_mps) else climb_mps
        self._wanted_mps = min(max(known, -_SETTLE_MAX_MPS), _SETTLE_MAX_MPS)
        self._climb_mps = known
        self._trim_mps2 = self._touched_s = self._stuck_s = 0.0

    def _learn(self, hover: float) -> None:
        """Take a hover thrust within what the guess allows."""
        least, most = (max(share * self._guess, 0.1) for share in _HOVER_SHARE)
        self.hover = min(max(hover, least), most, 0.8)

    def _stand(self, wanted_mps: float, height_m: float) -> None:
        self._thrust = 0.0
        self._floor_m = height_m
        self._lifted_s = 0.0
        if wanted_mps > 0.0:
            self._stage, self._thrust = _Stage.RAMP, _RAMP_START

    def _ramp(self, dt_s: float, wanted_mps: float, climb_mps: float, height_m: float) -> None:
        if wanted_mps <= 0.0:
            self._stage, self._thrust = _Stage.FLOOR, 0.0
            return
        self._thrust = min(self._thrust + _RAMP_PER_S * dt_s, _THRUST_MAX)
        lifted = climb_mps > _LIFTED_MPS or height_m - self._floor_m > _LIFTED_M
        self._lifted_s = self._lifted_s + dt_s if lifted else 0.0
        if self._lifted_s >= _LIFTED_S:
            self._stage = _Stage.AIR
            self._learn((self._thrust - _RAMP_PER_S * self._lifted_s) * _AT_LIFT_OFF)
            self._settle(climb_mps)

    def _fly(self, dt_s: float, wanted_mps: float, climb_mps: float, tilt_cos: float) -> None:
        unknown, slew = math.isnan(climb_mps), _SLEW_MPS2 * dt_s
        wanted_mps = 0.0 if unknown else wanted_mps
        self._wanted_mps += min(max(wanted_mps - self._wanted_mps, -slew), slew)
        if unknown:  # an old rate, taken for the present one, would be answered for as long as it stands
            if abs(self._climb_mps) >= _STANDING_MPS:
                self._trim_mps2 = 0.0  # half of it answered the change of the climb
            felt_mps2 = self._gain * VELOCITY_PER_S * (self._wanted_mps - self._climb_mps)
            self._climb_mps += felt_mps2 * dt_s
            accel = felt_mps2 + self._trim_mps2
        else:
            self._climb_mps = climb_mps
            error_mps = self._wanted_mps - climb_mps
            self._trim_mps2 += self._gain**2 * _INTEGRAL_PER_S2 * error_mps * dt_s
            self._trim_mps2 = min(max(self._trim_mps2, -_TRIM_MAX_MPS2), _TRIM_MAX_MPS2)
            accel = self._gain * VELOCITY_PER_S * error_mps + self._trim_mps2
            learnt = self._trim_mps2 * min(dt_s / _LEARN_S, 1.0)
            self._trim_mps2 -= learnt
            self._learn(self.hover * (1.0 + learnt / GRAVITY_MPS2))
        thrust = self.hover * (1.0 + accel / GRAVITY_MPS2) / max(tilt_cos, 0.5)
        self._thrust = min(max(thrust, _LEAST_IN_AIR * self.hover), _THRUST_MAX)

    def _doubt_lift_off(self, dt_s: float, wanted_mps: float, climb_mps: float, height_m: float) -> None:
        """Up is wanted, nothing moves and the floor is as near as before: it never left it.  The ramp goes on
        from the thrust that it has."""
        stands = abs(climb_mps) < _STANDING_MPS and height_m - self._floor_m < _LIFTED_M
        self._stuck_s = self._stuck_s + dt_s if stands and wanted_mps > 0.0 else 0.0
        if self._stuck_s >= _TOUCHED_S:
            self._stage, self._lifted_s = _Stage.RAMP, 0.0

    def _feel_floor(
        self, dt_s: float, wanted_mps: float, climb_mps: float, height_m: float, told: bool
    ) -> None:
        """Down is wanted (or, told that it stands, no climb), nothing moves, and the floor is near (or,
        unseen, carries some weight)."""
        above_m = height_m - self._floor_m
        near = above_m < (_NEAR_FLOOR_TOLD_M if told else _NEAR_FLOOR_M)
        if math.isnan(above_m):
            near = self._thrust < _LIGHT * self.hover
        still = abs(climb_mps) < _STANDING_MPS
        wants_down = wanted_mps < _SINKING_MPS or (told and wanted_mps <= 0.0)
        self._touched_s = self._touched_s + dt_s if still and wants_down and near else 0.0
        if self._touched_s >= _TOUCHED_S:
            self._stage, self._thrust = _Stage.FLOOR, 0.0
