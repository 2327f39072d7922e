"""How far what is sensed can be believed: sources held against each other, bounds against the map.  Pure."""

from __future__ import annotations

import math

from flightd.config.schema import Config
from flightd.control.oscillation import OscillationMonitor
from flightd.core.geometry import GRAVITY_MPS2
from flightd.core.types import GridPose, Health
from flightd.localisation.state_estimator import Estimate
from flightd.mission.guidance import Guidance, Guide, Warnings
from flightd.site.corridor import Corridor
from flightd.site.site import Site
from flightd.tracking.climb_doubt import ClimbDoubt
from flightd.tracking.frame_monitor import FrameMonitor
from flightd.tracking.line_tracker import LineTracker

_TICK_MEMORY_S = 1.0
_PUSH_MEMORY_S = 2.0
_FRESH_NS = 250_000_000
_OFF_M, _OFF_SHARE = 0.25, 0.12
"""A height is wrong, too, that is off by so much and by so great a share: the wrong height above what was
commanded has to stay within half a metre, whatever is flown at."""
_BOTH_SHARE, _SCALE_SHARE = 0.085, 0.065
"""It is wrong, too, where width and scale are both off by more: lengths on the floor do not come out as the
map and the motion have them.  A focal length alone errs by less (`SensorPriors.scale_share`); a creep that
swings of a stuck reading hide shows in both."""
_AGREED_SHARE, _AGREED_S = 0.1, 0.5
"""A height that was doubted is believed again once the lines agree with it so well for so long: where they
are few, the width of another line lies in between."""
_KNOWN_M, _KNOWN_SHARE = 0.3, 2.0 / 3.0
"""A position less certain than this (standard deviation), or than this share of the way that is free beside
the line, cannot tell whether the corridor is left."""

_BRAKES = 2.0
"""In need speed is lost so much faster than legs plan it: one that ends before a keep-out is not hindered."""


class PlausibilityMonitor:
    """Call `step` at each tick for the warnings, `steered` with what the mission then wanted."""

    def __init__(self, site: Site, config: Config) -> None:
        self._judged_above_m = config.mission.expert.steer_above_m
        self._height_share = config.hazards.height_share
        self._ceiling_m = site.ceiling_m - config.hazards.headroom_m
        most_mps2 = GRAVITY_MPS2 * math.tan(config.control.max_tilt_rad)
        brake_mps2 = min(_BRAKES * config.mission.accel_mps2, most_mps2)
        self._corridor = Corridor(site, config.hazards.corridor_m, brake_mps2)
        self._tick_s = 0.02
        self._off_m = 0.0
        self._doubt = False
        self._agreed_s = 0.0
        self.oscillation = OscillationMonitor()
        self.push_mps2 = (0.0, 0.0)
        """The mean push of the last seconds in which lines were seen, map axes."""

    def begin(self) -> None:
        """Another flight: how its loop behaves, and the air, is to be found out anew."""
        self.oscillation = OscillationMonitor()
        self.push_mps2 = (0.0, 0.0)

    def step(
        self,
        now_ns: int,
        dt_s: float,
        known: Estimate,
        *,
        tracker: LineTracker,
        frames: FrameMonitor,
        climb: ClimbDoubt,
        height_stuck: bool,
        health: Health,
    ) -> Warnings:
        pose, height_m, tracks = known.pose, known.height_m, known.tracks
        self._tick_s += min(dt_s / _TICK_MEMORY_S, 1.0) * (dt_s - self._tick_s)
        off_share, off_m = abs(tracker.height_share - 1.0), abs(tracker.height_off_m)
        is_off = off_share > self._height_share or (off_m > _OFF_M and off_share > _OFF_SHARE)
        is_off = is_off or _both_off(1.0 - tracker.height_share, tracker.scale_share)
        highest_m = max(height_m, height_m - tracker.height_off_m)  # one that sticks near the floor is low
        if is_off or off_share >= _AGREED_SHARE:
            self._agreed_s = 0.0
        elif tracker.widths_tell:
            self._agreed_s += dt_s
        is_off = is_off or (self._doubt and self._agreed_s < _AGREED_S)
        self._doubt = is_off and highest_m > self._judged_above_m
        if tracks is not None and now_ns - max(tracks.lines_ns, min(tracks.features_ns)) < _FRESH_NS:
            part = min(dt_s / _PUSH_MEMORY_S, 1.0)
            x, y = self.push_mps2
            self.push_mps2 = x + part * (tracks.push_x_mps2 - x), y + part * (tracks.push_y_mps2 - y)
        outside_m, line_m = 0.0, (0.0, 0.0)
        if pose is not None:
            near = self._corridor.nearest(pose.x_m, pose.y_m)
            line_m = (near.x_m, near.y_m)
            if self._tells_side(pose, line_m):
                outside_m = self._corridor.outside_m(pose.x_m, pose.y_m)
        return Warnings(
            frame_age_s=frames.age_s(now_ns),
            frozen_s=frames.frozen_s(now_ns),
            blank_s=frames.blank_s(now_ns),
            heading_error_rad=tracker.heading_error_rad,
            height_doubted=self._doubt,
            height_error_m=tracker.height_off_m,
            height_stuck=height_stuck,
            climb_wrong=climb.found,
            climb_error_mps=climb.error_mps(now_ns),
            push_mps2=math.hypot(*self.push_mps2),
            off_m=self._off_m,
            swings=self.oscillation.swings,
            headroom_m=self._ceiling_m - height_m,
            outside_m=outside_m,
            line_m=line_m,
            delay_leaps=tracker.delay_leaps,
            lean_leaps=tracker.lean_leaps,
            tick_s=self._tick_s,
            health=health,
        )

    def steered(self, now_ns: int, guidance: Guidance, pose: GridPose | None) -> None:
        """What the mission made of it: how far the drone is from where it should be, and how fast beside
        that."""
        self._off_m = 0.0
        if guidance.guide is not Guide.STEER or pose is None:
            self.oscillation.rest()
            return
        reference = guidance.reference
        self._off_m = math.hypot(reference.x_m - pose.x_m, reference.y_m - pose.y_m)
        self.oscillation.step(now_ns, pose.vx_mps - reference.vx_mps, pose.vy_mps - reference.vy_mps)

    def height_m(self, reported_m: float) -> float:
        """The height by which to climb: NaN while the lines contradict it."""
        return math.nan if self._doubt else reported_m

    def back(
        self, pose: GridPose | None, line_m: tuple[float, float], height_m: float = math.inf
    ) -> tuple[float, float] | None:
        """The way back into the corridor, or away from a keep-out that is as high as this, (forward, right)
        of the body; None inside it, and where the position is too uncertain to tell the side of the line,
        whose nearest point is `line_m`."""
        if pose is None or not self._tells_side(pose, line_m):
            return None
        back = self._corridor.back(pose.x_m, pose.y_m, pose.vx_mps, pose.vy_mps, height_m)
        if back is None:
            return None
        cos, sin = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
        return cos * back[0] + sin * back[1], -sin * back[0] + cos * back[1]

    def _tells_side(self, pose: GridPose, line_m: tuple[float, float]) -> bool:
        """The position is known well enough to say how far the nearest line, and keep-out, is."""
        area = self._corridor.nearest_keep_out(pose.x_m, pose.y_m)
        free_m = self._corridor.nearest_way(pose.x_m, pose.y_m).free_m
        by_line = _across_sigma_m(pose, line_m) < min(_KNOWN_M, _KNOWN_SHARE * free_m)
        return by_line and (
            math.isinf(area.distance_m) or _across_sigma_m(pose, (area.x_m, area.y_m)) < _KNOWN_M
        )


def _both_off(by_width: float, by_scale: float) -> bool:
    """Both say that the height is told too small, or both that it is too great, as shares of it."""
    agree = by_width * by_scale > 0.0
    return agree and abs(by_width) > _BOTH_SHARE and abs(by_scale) > _SCALE_SHARE


def _across_sigma_m(pose: GridPose, line_m: tuple[float, float]) -> float:
    """Standard deviation of the position towards the nearest line."""
    dx, dy = line_m[0] - pose.x_m, line_m[1] - pose.y_m
    square = dx * dx + dy * dy
    xx, xy, yy = pose.covariance[0], pose.covariance[1], pose.covariance[4]
    return math.sqrt(max(dx * dx * xx + 2.0 * dx * dy * xy + dy * dy * yy, 0.0) / square) if square else 0.0
