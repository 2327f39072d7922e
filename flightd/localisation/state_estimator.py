"""Telemetry and lines into tracks, tracks to a pose on the grid: all that is known of the drone's motion."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

from flightd.config.schema import Config
from flightd.control.flight_controller import CALM, Conditions
from flightd.core.learnt import LearntSensors
from flightd.core.shared_pose import SharedPose
from flightd.core.tick import TICK_S, TickInput
from flightd.core.tracks import TrackSet
from flightd.core.types import AttitudeSetpoint, GridPose, LineSet, VehicleState
from flightd.localisation.grid_localiser import GridLocaliser
from flightd.localisation.pad_finder import PadFinder
from flightd.localisation.pose_history import PoseHistory
from flightd.site.site import Site
from flightd.tracking.attitude_response import AttitudeResponse
from flightd.tracking.carried_height import CarriedHeight
from flightd.tracking.carried_lean import LEVEL
from flightd.tracking.carried_motion import NO_LEAD, Lead
from flightd.tracking.climb_doubt import ClimbDoubt
from flightd.tracking.frame_monitor import FrameMonitor
from flightd.tracking.height_history import HeightHistory
from flightd.tracking.line_tracker import LineTracker
from flightd.tracking.standing_tilt import StandingTilt
from flightd.tracking.stuck_height import StuckHeight
from flightd.tracking.told_level import ToldLevel

_LATE_GAIN, _MOST_LATE_S = 0.02, 0.15
"""How soon the usual delay of attitudes is believed, and the most of it."""
_FREE_S, _LEAST_EASE, _UNSURE = 0.2, 0.35, 4.0 / 3.0
"""The configured gains are for a loop that is no later than this, beside the attitude's own; a later one
answers more slowly in proportion, down to this share.  What is not known of how late setpoints are obeyed,
over which nothing is foreseen, weighs so much more: 0.21 s of it would take all the phase margin."""
_JITTERS, _MOST_JITTER_S = 2.0, 0.5
"""What comes from the vehicle jitters by so much in the mean; what goes there by as much again."""
_ATTITUDE_LAG_S = 0.2
"""Of an attitude loop of 10 rad/s, for which the gains are."""
_UNLEANT_S = 0.1
"""Over so long a push is averaged before it is leant against."""
_LEAPT_MPS2 = 0.03
"""What is left of a leap and makes less is over."""
_LEAPS_ABOVE_M = 0.5
"""Nearer to the floor a body that touches it turns faster than is told."""
_MAP_SIGMA_M = 0.02
"""Of a distance between two lines of the map, as it is painted."""
_SILENT_S = 0.1
"""A vehicle whose newest attitude is older than usual by so much is not waited for."""
_CLIMB_DOUBT_M = 1.0
"""Below, the rotors' own wash moves the barometer, and the adapter holds rate and height apart.  A climb that
was found to be wrong is put right down to the floor."""
_GAP_NS = 100_000_000
"""Frames further apart do not follow each other."""
_LEAST_INTEGRITY = 0.5
"""Below, nothing is told to the vehicle's own estimator."""
_WAIT_NS = 300_000_000
"""So old a frame is used by the attitude that is assumed of its exposure."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """The motion at one tick; `pose` is None before the floor was seen, `by_pad` says that it is only that
    over the pad."""

    height_m: float
    tracks: TrackSet | None
    pose: GridPose | None
    by_pad: bool
    lead: Lead = NO_LEAD
    conditions: Conditions = CALM
    shared: SharedPose | None = None
    """What the vehicle's own estimator may be told, once for each frame."""


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
        self.response = AttitudeResponse()
        self._telemetry_s = self._late_s = self._jitter_s = 0.0
        self._attitude_ns = 0
        self._obeys = False
        self.frames = FrameMonitor()
        self._standing = StandingTilt()
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
            camera.readout_s,
        )
        view = camera.floor_reach(control.max_tilt_rad)
        self.localiser = GridLocaliser(self._site, node, view, self._config.localisation)
        self.poses = PoseHistory(self._least_integrity)
        self.pads = PadFinder(self._site)
        self._stuck, self._height_ns = StuckHeight(), 0
        self.climb = ClimbDoubt()
        self._climbed = HeightHistory()
        self._climbed_m, self._climb_ns, self._climb_mps = 0.0, 0, math.nan
        self._carried = CarriedHeight()
        self._waiting: deque[LineSet] = deque()
        self._judged_ns = self._shared_ns = 0
        self._frames_s = 0.0
        self._unleant = (0.0, 0.0)
        self._risen = self._is_high = False
        self._level = ToldLevel(self._config.tracking.expert.priors.attitude_s)
        self.armed = armed

    @property
    def height_stuck(self) -> bool:
        """The range finder was found to be stuck."""
        return self._stuck.found

    def take(self, tick: TickInput, commanded: AttitudeSetpoint | None) -> None:
        """Telemetry first: a frame needs the attitude and height of its exposure.  `commanded` is what went
        out with the last tick."""
        obeys = self._obeys_now(tick)
        self.response.sent(tick.now_ns, commanded if obeys else None)
        v = tick.vehicle
        self._risen = self._risen or (v is not None and v.may_fly)
        # once it is told to rise it may lean already; what levels itself by how it stands tells nothing of it
        stands = v is not None and not (self._risen or v.hovers_unsteered) and commanded is None
        height_m = self._carried.at(tick.now_ns, self._heights.at(tick.now_ns), self._climbed.at(tick.now_ns))
        self._is_high = height_m > _LEAPS_ABOVE_M or (self._is_high and math.isnan(height_m))
        for sample in tick.attitudes:
            late_s = max((tick.now_ns - sample.stamp_ns) * 1e-9, 0.0)
            self._telemetry_s += _LATE_GAIN * (min(late_s, _MOST_LATE_S) - self._telemetry_s)
            self._attitude_ns = sample.stamp_ns
            leap = self.tracker.attitude(sample, leaps=self._is_high)
            if leap != LEVEL:
                self._level.leaps(sample.stamp_ns, leap)
            self.poses.add_attitude(sample)
            # what leaps answers no setpoint
            self.response.told(sample, obeys=obeys and leap == LEVEL)
            if stands:
                self._standing.take(sample)
        if tick.attitudes:
            self._mind_jitter((tick.now_ns - self._attitude_ns) * 1e-9)
        if stands or not self._level.is_known:  # some are in the air with the first that they tell once armed
            self._mind_standing(tick.now_ns)
        self.tracker.assume(self.response.foreseen(tick.now_ns))
        if v is not None:
            if not self._stuck.found:
                self._heights.add(v.height_stamp_ns, v.height_m, v.climb_mps)
            self._count_climb(tick.now_ns, v.climb_mps)
            if not (self._stuck.found or self.climb.found or math.isnan(v.height_m)):
                at_ns = v.height_stamp_ns
                self._carried.measured(at_ns, self._heights.at(at_ns), self._climbed.at(at_ns))
            self._mind_height(tick.now_ns, v, commanded)
        self._waiting += (lines for lines in tick.lines if self.frames.take(lines) and self.armed)
        while self._waiting and self._is_due(self._waiting[0], tick.now_ns):
            lines = self._waiting.popleft()
            self._judged_ns = lines.stamp_ns
            self._take_frame(lines)

    def _mind_standing(self, now_ns: int) -> None:
        tilt_rad = self._standing.at(now_ns)
        if self.armed and tilt_rad is not None:
            self._level.stood(now_ns, self.tracker.stands(tilt_rad))

    def _mind_jitter(self, late_s: float) -> None:
        late_s = min(max(late_s, 0.0), _MOST_JITTER_S)
        self._jitter_s += _LATE_GAIN * (abs(late_s - self._late_s) - self._jitter_s)
        self._late_s += _LATE_GAIN * (late_s - self._late_s)

    def _obeys_now(self, tick: TickInput) -> bool:
        """Whether the vehicle does as it is told; one that fell silent goes on with what it did."""
        v = tick.vehicle
        silent = not tick.attitudes and self.telemetry_age_s(tick.now_ns, self._attitude_ns) > _SILENT_S
        if v is None or not silent:
            self._obeys = v is not None and v.in_control and v.may_fly
        return self._obeys

    def telemetry_age_s(self, now_ns: int, stamp_ns: int) -> float:
        """How much older a told attitude is than attitudes are on their usual way: that is bridged by what
        was sent since, silence is not."""
        return max((now_ns - stamp_ns) * 1e-9 - self._telemetry_s, 0.0)

    def sight_age_s(self, now_ns: int, told_ns: int) -> float:
        """For how long the floor has told nothing since then: without frames, or in those that are judged.
        In frames that wait for their attitude nobody has looked yet."""
        waiting_ns = 0
        if self._waiting and self._judged_ns:  # a gap before the first that waits is a gap
            judged_ns = max(self._judged_ns, self._waiting[0].stamp_ns - _GAP_NS)
            waiting_ns = min(self._waiting[-1].stamp_ns - judged_ns, _WAIT_NS)
        return max(now_ns - told_ns - waiting_ns, 0) * 1e-9 if told_ns else math.inf

    def _is_due(self, lines: LineSet, now_ns: int) -> bool:
        """A frame waits for the attitude at its exposure, but not for ever, nor for one that fell silent."""
        silent = self.telemetry_age_s(now_ns, self._attitude_ns) > _SILENT_S
        return silent or self.tracker.measured(lines) or now_ns - self.tracker.exposed_ns(lines) > _WAIT_NS

    def step(self, now_ns: int) -> Estimate:
        """The motion now."""
        height_m = self._heights.at(now_ns)
        tracks = self.tracker.at(now_ns)
        pose = None
        if tracks is not None:
            seen_from_m = self._carried.at(now_ns, height_m, self._climbed.at(now_ns))
            pose = self.localiser.step(tracks, seen_from_m)
        if pose is not None:
            self.poses.add(pose)
            for axis in (0, 1):
                if self.tracker.to_survey(axis):
                    self.tracker.survey(axis, self.localiser.map_lines(axis), _MAP_SIGMA_M)
        if tracks is not None and pose is not None:
            self.pads.step(tracks, pose)
        by_pad = None if pose is None else self.pads.over(pose, self.localiser.ever_matched)
        lead = self.tracker.lead(now_ns, now_ns + round(self.response.lead_s * 1e9))
        conditions, shared = self._conditions(now_ns), None if pose is None else self._shared(now_ns, pose)
        return Estimate(height_m, tracks, by_pad or pose, by_pad is not None, lead, conditions, shared)

    def _shared(self, now_ns: int, pose: GridPose) -> SharedPose | None:
        """What a new frame tells the vehicle's own estimator; nothing of lines that the map does not have,
        nor over heights that a stuck range finder made.

        The motion hangs on the lines, not on which node they belong to: of two places that are confused it is
        the same.  Only once no place is likelier than all others the lines themselves are doubted."""
        seen_ns = self.tracker.newest_ns
        motion = self.tracker.exposure_motion(now_ns) if seen_ns > self._shared_ns else None
        height_m = self._heights.at(seen_ns)
        if motion is None or self._stuck.found or not height_m > 0.0 or pose.integrity < _LEAST_INTEGRITY:
            return None
        self._shared_ns = seen_ns
        told_ns = self.localiser.told_ns
        x_variance, y_variance = (
            variance if seen_ns - told_ns[axis] < _GAP_NS else math.nan
            for axis, variance in enumerate(motion.variances)
        )
        if math.isnan(x_variance) and math.isnan(y_variance):
            return None
        return SharedPose(
            stamp_ns=seen_ns,
            attitude=motion.attitude,
            yaw_rad=motion.yaw_rad,
            x_m=pose.x_m - motion.since_m[0],
            y_m=pose.y_m - motion.since_m[1],
            vx_mps=motion.speed_mps[0],
            vy_mps=motion.speed_mps[1],
            height_m=height_m,
            position_variances=(pose.covariance[0], pose.covariance[4]),
            speed_variances=(x_variance, y_variance),
            height_variance=self._heights.error_m**2,
            integrity=pose.integrity,
            corrections=self.localiser.corrections,
        )

    def _conditions(self, now_ns: int) -> Conditions:
        """What the position loop has to reckon with: a push that nothing leans against yet, and how late it
        may all be still: frames, what is made of them, and what that is answered with.

        How little is known of the camera's delay is none of it.  Lines that a lean moves are weighed by that,
        and tell it: 60 ms off, or a leap of 50 ms, is known to 10 ms within a second, and a push is damped
        meanwhile at full gain (tests/sim/ideal/test_unknown_delay.py).  Were 60 ms off not learnt, 0.4 of the
        gain would swing too: what errs then is the speed, not how soon it is answered."""
        tracker, response = self.tracker, self.response
        seen_ns = tracker.newest_ns
        if not seen_ns:
            return Conditions(level_rad=self._level.at(now_ns))
        late_s = min(max((now_ns - seen_ns) * 1e-9, 0.0), _MOST_LATE_S)
        self._frames_s += _LATE_GAIN * (late_s - self._frames_s)
        slower_s = max(2.0 / response.bandwidth_radps - _ATTITUDE_LAG_S, 0.0)
        unsure_s = response.delay_sigma_s + _JITTERS * self._jitter_s
        total_s = self._frames_s + response.delay_s + _UNSURE * (slower_s + unsure_s)
        part = TICK_S / _UNLEANT_S
        x, y = self._unleant
        now_x, now_y = tracker.unleant(now_ns)
        self._unleant = x, y = x + part * (now_x - x), y + part * (now_y - y)
        ease = min(max(_FREE_S / total_s, _LEAST_EASE), 1.0)
        leapt_x, leapt_y = tracker.leapt(now_ns)  # is answered at once
        blind_x, blind_y = tracker.leant(now_ns, self._level.by_leaps(now_ns))
        return Conditions(
            (x + leapt_x, y + leapt_y),
            ease,
            self._level.at(now_ns),
            leapt=math.hypot(leapt_x, leapt_y) > _LEAPT_MPS2,
            blind_mps2=(-blind_x, -blind_y),
        )

    def _take_frame(self, lines: LineSet) -> None:
        exposed_ns, carried = self.tracker.exposed_ns(lines), self._carried
        measured_m, climbed_m = self._heights.at(exposed_ns), self._climbed.at(exposed_ns)
        height_m = carried.at(exposed_ns, measured_m, climbed_m)
        error_m = math.hypot(self._heights.error_m, carried.error_m(exposed_ns))
        used = self.tracker.frame(lines, height_m, error_m, self._climb_mps)
        by_width_m = self.tracker.by_width_m
        if used and by_width_m is not None:
            carried.by_width(exposed_ns, by_width_m, climbed_m)
        # without a range finder the lines alone contradict the climb: such a drone lands anyhow
        alone = math.isnan(measured_m)
        told_m = by_width_m if alone else measured_m
        width_m = by_width_m if used else None
        if width_m is None and self.climb.found and not alone:
            width_m = measured_m  # near the floor no line is wide enough: what both have told goes on
        if told_m is not None and told_m < _CLIMB_DOUBT_M and not self.climb.found:
            self.climb.forget()
        elif told_m is not None and width_m is not None and math.isfinite(climbed_m):
            self.climb.step(exposed_ns, told_m, width_m, climbed_m, alone=alone)
            if self.climb.found:
                carried.forget()

    def _count_climb(self, now_ns: int, climb_mps: float) -> None:
        """What the vehicle tells to have climbed; over a gap nothing is compared."""
        self._climb_mps = climb_mps
        if math.isnan(climb_mps):
            self._climbed, self._climb_ns = HeightHistory(), 0
            self.climb.forget()
            self._carried.forget()
            return
        dt_s = (now_ns - self._climb_ns) * 1e-9 if self._climb_ns else 0.0
        self._climbed_m, self._climb_ns = self._climbed_m + climb_mps * dt_s, now_ns
        self._climbed.add(now_ns, self._climbed_m, climb_mps)

    def _mind_height(self, now_ns: int, vehicle: VehicleState, commanded: AttitudeSetpoint | None) -> None:
        """Forget the heights of a range finder that is found to be stuck: then the lines' width tells.  Once
        it is the climb that is wrong it says nothing against the height any more.  One that is silent is not
        stuck: its last height is judged once."""
        is_new, self._height_ns = vehicle.height_stamp_ns > self._height_ns, vehicle.height_stamp_ns
        if not self.armed or commanded is None or self._stuck.found or self.climb.found:
            return
        height_m = vehicle.height_m if is_new else math.nan
        if self._stuck.step(now_ns, height_m, vehicle.climb_mps, commanded.climb_mps):
            self._heights = HeightHistory()
            self._carried.forget()
