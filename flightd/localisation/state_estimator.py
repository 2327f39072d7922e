"""Telemetry and lines into tracks, tracks to a pose on the grid: all that is known of the drone's motion."""

from __future__ import annotations

import math
from dataclasses import dataclass

from flightd.config.schema import Config
from flightd.core.learnt import LearntSensors
from flightd.core.tick import TickInput
from flightd.core.tracks import TrackSet
from flightd.core.types import AttitudeSetpoint, GridPose, LineSet, VehicleState
from flightd.localisation.grid_localiser import GridLocaliser
from flightd.localisation.pad_finder import PadFinder
from flightd.localisation.pose_history import PoseHistory
from flightd.site.site import Site
from flightd.tracking.attitude_extrapolation import AttitudeExtrapolation
from flightd.tracking.climb_doubt import ClimbDoubt
from flightd.tracking.frame_monitor import FrameMonitor
from flightd.tracking.height_history import HeightHistory
from flightd.tracking.line_tracker import LineTracker
from flightd.tracking.stuck_height import StuckHeight


@dataclass(frozen=True, slots=True)
class Estimate:
    """The motion at one tick; `pose` is None before the floor was seen, `by_pad` says that it is only that
    over the pad."""

    height_m: float
    tracks: TrackSet | None
    pose: GridPose | None
    by_pad: bool


class StateEstimator:
    """Call `take` with what came in, then `step`; `begin` at the start and whenever the vehicle is armed or
    disarmed."""

    def __init__(
        self,
        site: Site,
        config: Config,
        least_integrity: float,
        stand: tuple[str, float],
        learnt: LearntSensors | None = None,
    ) -> None:
        """`least_integrity` is that of a pose that counts as certain; `stand` as for `begin`; `learnt` is
        what earlier flights have learnt of the sensors."""
        self._site = site
        self._config = config
        self._least_integrity = least_integrity
        self._heights = HeightHistory()
        self._extrapolation = AttitudeExtrapolation()
        self.frames = FrameMonitor()
        self.learnt = learnt
        """What the last flight has learnt of the sensors, or those before it."""
        self._begin(stand, armed=False)

    def begin(self, stand: tuple[str, float], *, armed: bool) -> None:
        """Stand on a node, in a heading (rad), and know nothing else.

        What was seen before arming says nothing: until then the drone may have been carried about.  The
        flight starts on the pad, in the plan's heading.  Nor is anything dead-reckoned once it is disarmed.
        """
        self.learnt = self.tracker.learnt() or self.learnt
        self._begin(stand, armed=armed)

    def _begin(self, stand: tuple[str, float], *, armed: bool) -> None:
        node, yaw_rad = stand
        camera, control = self._config.camera, self._config.control
        self.tracker = LineTracker(
            camera.lens(),
            camera.mount(),
            self._site.line_width_m,
            yaw_rad,
            control.tilt_compensation,
            self._config.tracking,
            self.learnt,
            camera.latency_s,
        )
        view = camera.floor_reach(control.max_tilt_rad)
        self.localiser = GridLocaliser(self._site, node, view, self._config.localisation)
        self.poses = PoseHistory(self._least_integrity)
        self.pads = PadFinder(self._site)
        self._stuck = StuckHeight()
        self.climb = ClimbDoubt()
        self._climbed = HeightHistory()
        self._climbed_m, self._climb_ns = 0.0, 0
        self.armed = armed

    @property
    def height_stuck(self) -> bool:
        """The range finder was found to be stuck."""
        return self._stuck.found

    def take(self, tick: TickInput, commanded: AttitudeSetpoint | None) -> None:
        """Telemetry first: a frame needs the attitude and height of its exposure.  `commanded` is what went
        out with the last tick."""
        for sample in tick.attitudes:
            self.tracker.attitude(sample)
            self.poses.add_attitude(sample)
        heard = tick.vehicle.attitude if tick.vehicle is not None else None
        assumed = self._extrapolation.step(tick.now_ns, heard, commanded)
        if assumed is not None:
            self.tracker.assume(assumed)
        if tick.vehicle is not None:
            v = tick.vehicle
            if not self._stuck.found:
                self._heights.add(v.height_stamp_ns, v.height_m, v.climb_mps)
            self._count_climb(tick.now_ns, v.climb_mps)
            self._mind_height(tick.now_ns, v, commanded)
        for lines in tick.lines:
            if self.frames.take(lines) and self.armed:
                self._take_frame(lines)

    def step(self, now_ns: int) -> Estimate:
        """The motion now."""
        height_m = self._heights.at(now_ns)
        tracks = self.tracker.at(now_ns)
        pose = None if tracks is None else self.localiser.step(tracks, height_m)
        if pose is not None:
            self.poses.add(pose)
        if tracks is not None and pose is not None:
            self.pads.step(tracks, pose)
        by_pad = None if pose is None else self.pads.over(pose, self.localiser.ever_matched)
        return Estimate(height_m, tracks, by_pad or pose, by_pad is not None)

    def _take_frame(self, lines: LineSet) -> None:
        exposed_ns = self.tracker.exposed_ns(lines)
        height_m, climbed_m = self._heights.at(exposed_ns), self._climbed.at(exposed_ns)
        used, by_width_m = self.tracker.frame(lines, height_m), self.tracker.by_width_m
        if used and by_width_m is not None and math.isfinite(height_m + climbed_m):
            self.climb.step(exposed_ns, height_m, by_width_m, climbed_m)

    def _count_climb(self, now_ns: int, climb_mps: float) -> None:
        """What the vehicle tells to have climbed; over a gap nothing is compared."""
        if math.isnan(climb_mps):
            self._climbed, self._climb_ns = HeightHistory(), 0
            self.climb.forget()
            return
        dt_s = (now_ns - self._climb_ns) * 1e-9 if self._climb_ns else 0.0
        self._climbed_m, self._climb_ns = self._climbed_m + climb_mps * dt_s, now_ns
        self._climbed.add(now_ns, self._climbed_m, climb_mps)

    def _mind_height(self, now_ns: int, vehicle: VehicleState, commanded: AttitudeSetpoint | None) -> None:
        """Forget the heights of a range finder that is found to be stuck: then the lines' width tells.  Once
        it is the climb that is wrong it says nothing against the height any more."""
        if not self.armed or commanded is None or self._stuck.found or self.climb.found:
            return
        if self._stuck.step(now_ns, vehicle.height_m, vehicle.climb_mps, commanded.climb_mps):
            self._heights = HeightHistory()
