"""Flying on without a view of the floor: down while the dead-reckoned position still holds.  Pure.

What drifts unseen does so with the square of the time, so a drone whose camera shows nothing sinks at once,
low enough to stand soon, high enough to find the lines again; one that sees frames without lines climbs to
see more, for a short while.
"""

from __future__ import annotations

import math

from flightd.config.schema import Config
from flightd.mission.guidance import MissionInputs

_FLARE_PER_S, _STAND_M = 2.5, 0.10
"""A blind descent slows down towards the floor: its rate over the height of the skids."""
_EASE_PER_S = 1.2
"""One that has to end above something slows down so that it does not sink past its end."""


class FloorViewMonitor:
    """What is known of the view: call `step` at each tick."""

    def __init__(self, config: Config) -> None:
        self._params = config.mission
        self._hazards = config.hazards.expert
        self.unseen_s = 0.0
        """Age of the newest line of the map; on a leg that of the line which is followed, for what drifts
        off that one drifts into the shelves."""
        self.shows = True
        """The camera shows something, lines or not."""
        self._since_ns: int | None = None
        self._lost_s = 0.0

    def step(self, s: MissionInputs, leg_along_x: bool | None) -> None:
        """Take what one tick brings on, or stopped on, a leg along the map's x axis (None: on no leg)."""
        hold_s, w = self._params.lines_hold_s, s.warnings
        ages_s = s.x_age_s, s.y_age_s
        self.unseen_s = min(ages_s) if leg_along_x is None else ages_s[leg_along_x]
        self.shows = max(w.frame_age_s, w.frozen_s, w.blank_s) <= hold_s
        # what is lost from view while it is not heard is the telemetry's hazard, with its own times
        heard = s.telemetry_age_s <= self._params.telemetry_hold_s
        if self.unseen_s <= hold_s or not heard:
            self._since_ns = None
        elif self._since_ns is None:
            self._since_ns = s.now_ns
        self._lost_s = 0.0 if self._since_ns is None else hold_s + (s.now_ns - self._since_ns) * 1e-9

    @property
    def too_long(self) -> bool:
        """The drift can no longer be answered for."""
        h = self._hazards
        return self._lost_s > (h.search_land_s if self.shows else h.blind_land_s)

    @property
    def is_blind(self) -> bool:
        """Nothing of the floor is seen, and no climb would help."""
        return not self.shows and self.unseen_s > self._params.lines_hold_s

    def rate_mps(self, height_m: float) -> float:
        """Rate of a descent without a view, slower towards the floor; slow where the height is unknown."""
        p = self._params
        if math.isnan(height_m):
            return p.land_mps
        return min(max(_FLARE_PER_S * (height_m - _STAND_M), p.expert.touch_blind_mps), p.expert.blind_mps)

    def sink_mps(self, height_m: float, floor_m: float = 0.0) -> float:
        """Rate at which a drone that holds blind goes down to the height from which it soon stands, above
        what stands up to `floor_m` below it."""
        if not height_m > max(self._hazards.blind_m, floor_m):
            return 0.0
        rate_mps = self.rate_mps(height_m)
        return min(rate_mps, _EASE_PER_S * (height_m - floor_m)) if floor_m > 0.0 else rate_mps
