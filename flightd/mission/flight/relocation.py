"""Doubt about the position, and what to do about it: stop, look, climb a little, move on if that is safe, or
else back the way it came.

The localiser says how sure it is of the node (`GridPose.integrity`) and, now and then, that the drone
was somewhere else all along: then its position jumps.  Either stops the flight where it is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from flightd.config.mission import MissionConfig
from flightd.core.types import Phase
from flightd.mission.debounce_timer import DebounceTimer
from flightd.mission.flight.flown_trail import FlownTrail
from flightd.mission.guidance import MissionInputs
from flightd.mission.triggers import Trigger

_JUMP_M = 0.3
_SPEED_SHARE = 3.0
"""A position that changes faster than this many times the flying speed has jumped."""
_BACK_M = 0.5
"""So far back it looks again: what made it doubt is judged anew once it was out of view."""
_PAST_M = 1.0
"""So far from where a doubt began the next one is another: at what lies there for good it does not doubt for
ever."""
_RISING = frozenset({Phase.PREFLIGHT, Phase.ARMING, Phase.TAKE_OFF})
"""A drone whose height is not known may stand then."""


class Relocator:
    """Call `step` at each tick, first of all; then `jump_m` says how far the position jumped with it, and
    `shift_m` how far in all since it was last sure for a while."""

    def __init__(self, params: MissionConfig, ceiling_m: float, overhead_m: Sequence[float]) -> None:
        """`ceiling_m` is how high may be flown anywhere, `overhead_m` are the heights below the
        keep-outs."""
        self._params = params
        self._ceiling_m = ceiling_m
        self._overhead_m = overhead_m
        self._doubt = DebounceTimer()
        self._sure = DebounceTimer()
        self._look = DebounceTimer()
        self._last: tuple[float, float] | None = None
        self._trail = FlownTrail()
        self._moved = False
        self._doubted: tuple[float, float] | None = None
        self._sought_s = 0.0
        self.jump_m = (0.0, 0.0)
        self._shift = (0.0, 0.0)

    @property
    def shift_m(self) -> float:
        """How far off the position was when the doubt began, as far as it is known by now."""
        return math.hypot(*self._shift)

    @property
    def jumped(self) -> bool:
        """The position is another one with this tick."""
        return self.jump_m != (0.0, 0.0)

    def step(self, s: MissionInputs, phase: Phase, phase_s: float) -> set[Trigger]:
        """The triggers of a position doubted, sure again, or not found in time."""
        p = self._params
        self._watch_jumps(s, phase)
        self._watch_way(s, phase)
        sure = s.pose is not None and s.pose.integrity >= p.integrity_min
        doubt_s = self._doubt.step(s.pose is not None and not sure, s.now_ns)
        sure_s = self._sure.step(sure, s.now_ns)
        if phase is not Phase.RELOCATE:
            patience_s = p.expert.first_look_s if phase is Phase.ACQUIRE else p.expert.doubt_s
            if sure_s > p.expert.settled_s and not self._moved:
                self._shift = (0.0, 0.0)
                if self._doubted is not None and s.distance_m(self._doubted) > _PAST_M:
                    self._doubted, self._sought_s = None, 0.0
            elif self._doubted is not None and not sure:
                self._sought_s += s.dt_s
            doubted = (
                self._moved or min(doubt_s, phase_s if phase is Phase.ACQUIRE else math.inf) > patience_s
            )
            return {Trigger.POSITION_DOUBTED} if doubted else set()
        self._moved = False
        if self._doubted is None and s.pose is not None:
            self._doubted = s.pose.x_m, s.pose.y_m
        self._sought_s += s.dt_s
        if sure_s > p.expert.settled_s and phase_s > p.expert.settled_s:
            return {Trigger.POSITION_SURE}
        return {Trigger.POSITION_UNKNOWN} if self._sought_s > p.relocate_s else set()

    def next_look(self, s: MissionInputs, anchor: tuple[float, float]) -> tuple[float, float]:
        """Where to look from: the same place for a while, then along a way that is safe.  Where the map knows
        none, for the drone may be anywhere, back the way it came: there the floor was known, and what was
        flown through is free."""
        if self._look.step(True, s.now_ns) <= self._params.expert.relocate_look_s:
            return anchor
        if s.way_out is not None:
            on = anchor[0] + s.way_out[0], anchor[1] + s.way_out[1]
        elif (back := self._trail.back(anchor, _BACK_M)) is not None:
            on = back
        else:
            return anchor
        self._look = DebounceTimer()
        return on

    def begin(self) -> None:
        """A new look begins."""
        self._look = DebounceTimer()

    def height_m(self, flown_m: float) -> float:
        """The height to look from: above what is flown now, more of the floor is in view."""
        return self.raised_m(flown_m, self._params.expert.relocate_climb_m)

    def raised_m(self, flown_m: float, by_m: float) -> float:
        """A height above what is flown now.  Wherever the drone is, that stays below the ceiling and below
        the keep-outs that begin above what is flown now."""
        above = (height_m for height_m in self._overhead_m if height_m >= flown_m)
        return max(flown_m, min(flown_m + by_m, self._ceiling_m, *above))

    def _watch_way(self, s: MissionInputs, phase: Phase) -> None:
        """Keep the way that is flown in sight of the floor."""
        if s.pose is None or s.sight_s > self._params.lines_hold_s:
            self._trail.clear()
        elif phase is not Phase.RELOCATE:
            self._trail.step(s.pose.x_m, s.pose.y_m)

    def _watch_jumps(self, s: MissionInputs, phase: Phase) -> None:
        self.jump_m = (0.0, 0.0)
        if s.pose is None:  # a new flight begins on its pad, wherever the last one was believed to end
            self._last = None
            self._doubted, self._sought_s = None, 0.0
            self._moved, self._shift = False, (0.0, 0.0)
            return
        at = s.pose.x_m, s.pose.y_m
        if self._last is not None:
            dx, dy = at[0] - self._last[0], at[1] - self._last[1]
            if max(abs(dx), abs(dy)) > _JUMP_M + _SPEED_SHARE * self._params.speed_mps * s.dt_s:
                self.jump_m = (dx, dy)
                self._trail.clear()  # it may have been reckoned wrongly only since it last saw a line
                if self._doubted is not None:
                    self._doubted = self._doubted[0] + dx, self._doubted[1] + dy
                self._shift = (self._shift[0] + dx, self._shift[1] + dy)
                unknown = math.isnan(s.height_m) and phase not in _RISING
                self._moved |= unknown or s.height_m > self._params.expert.steer_above_m
        self._last = at
