"""Line tracks on the floor: from each frame's lines to smooth offsets, velocities and heading.

The filter lives at the capture time of the newest frame, where the measured attitude of that moment is
known; `at` carries them on to the present with the attitude flown since.  So a late picture costs
prediction, never truth.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace

from flightd.config.control import TiltCompensation
from flightd.config.tracking import TrackingConfig
from flightd.core.geometry import Lens, Mount, wrap_pi
from flightd.core.learnt import LearntSensors
from flightd.core.tracks import NOT_SEEN, FloorJunction, MarkerOffset, PadOffset, TrackedLine, TrackSet
from flightd.core.types import Attitude, LineSet
from flightd.tracking.attitude_history import AttitudeHistory
from flightd.tracking.carried_heading import CarriedHeading
from flightd.tracking.carried_lean import CarriedLean, Lean
from flightd.tracking.carried_motion import AT_REST, NO_LEAD, Carried, ExposureMotion, Lead
from flightd.tracking.corrected_view import corrected_attitude, corrected_lens, corrected_mount
from flightd.tracking.feature_trust import FeatureTrust, SeenFrame
from flightd.tracking.floor_filter import FloorFilter
from flightd.tracking.ground_junctions import floor_junctions
from flightd.tracking.ground_squares import placed_squares
from flightd.tracking.gyro_judge import GyroJudge
from flightd.tracking.heading_dispute import HeadingDispute, Turned
from flightd.tracking.heading_vote import heading_vote
from flightd.tracking.held_lines import awaits_survey
from flightd.tracking.line_sight import (
    as_compensated,
    feature_sights,
    line_sight,
    turn_of,
)
from flightd.tracking.motion_model import (
    DELAY,
    HEIGHT,
    HEIGHT_SCALE,
    PITCH,
    PSI,
    ROLL,
    SCALE,
    VX,
    VY,
    Told,
    lean,
)
from flightd.tracking.rolling_shutter import ImageMotion, as_of_one_moment
from flightd.tracking.tilt_compensation import (
    FloorView,
    GroundLine,
    ground_lines,
    heights_by_width,
)
from flightd.tracking.width_heights import NearFloor, WidthHeights, climbed_between_m

_STEP_NS = 20_000_000
_WATCHED_NS = 10_000_000_000
"""For so long without a line the drift of gyros stays within degrees."""
_HARDLY_RISEN_M = 0.5
_STANDING_MPS = 0.15
"""Sigma of the speed of what stands or has hardly risen."""
_ASSUMED_TILT_RAD = math.radians(2.0)
_DEFAULTS = TrackingConfig()


class LineTracker:
    """Feed `attitude` and `frame`, read `at`.  Before the first frame `at` gives None.

    A line whose width is not that of the guide paint, `line_width_m`, within `expert.width_share`, is not
    one."""

    def __init__(
        self,
        lens: Lens,
        mount: Mount,
        line_width_m: float,
        start_yaw_rad: float,
        compensation: TiltCompensation = TiltCompensation.EXACT,
        config: TrackingConfig = _DEFAULTS,
        learnt: LearntSensors | None = None,
        latency_s: float = math.inf,
        readout_s: float = 0.0,
    ) -> None:
        """`learnt` is what another tracker has learnt of the same sensors, `latency_s` the delay that the
        frames' stamps assume, `readout_s` the time in which a picture's rows are exposed."""
        params = config.expert
        self._lens, self._mount, self._compensation = lens, mount, compensation
        self._line_width_m = line_width_m
        self._readout_s = readout_s
        self._params = params
        self._start_yaw_rad = start_yaw_rad
        self._history, self._as_told = AttitudeHistory(), AttitudeHistory()
        self._carried_heading, self._judge = CarriedHeading(), GyroJudge()
        self._carried_lean = CarriedLean(params.priors.attitude_s)
        self._headed = False
        forget_ns = round(params.forget_s * 1e9)
        self._filter = FloorFilter(params.noise, params.priors, params.gate_m, forget_ns, latency_s)
        if learnt is not None:
            self._filter.begin_with(learnt)
        self._forget_ns = forget_ns
        self._lines_ns, self._stands = 0, True
        self._features_ns = [0, 0]
        self._trust = FeatureTrust()
        self._stamp_ns = self._told_ns = 0
        self._seen_in: Attitude | None = None
        self._pads: tuple[PadOffset, ...] = ()
        self._junctions: tuple[FloorJunction, ...] = ()
        self._markers: tuple[MarkerOffset, ...] = ()
        self._widths, self._near_floor = WidthHeights(), NearFloor()
        self._dispute = HeadingDispute()
        self._knocked = False

    @property
    def heading_error_rad(self) -> float:
        """What all lines, or the gyros, lately said against the vehicle's heading; 0 while they agree."""
        return self._dispute.error_rad or -self._carried_heading.leap_rad

    @property
    def height_share(self) -> float:
        """The height told lately against that by the lines' width; 1 when they agree, or tell none."""
        return self._widths.share

    @property
    def height_off_m(self) -> float:
        """The same as metres: how much higher the vehicle tells it to be, m."""
        return self._widths.off_m

    @property
    def scale_share(self) -> float:
        """By which share the focal length is shorter than configured, and the height told too small."""
        return self._filter.mean(SCALE) + self._filter.mean(HEIGHT_SCALE)

    @property
    def delay_leaps(self) -> int:
        """How often the camera's delay became another one."""
        return self._filter.delay_leap.leaps

    @property
    def by_width_m(self) -> float | None:
        """The height by the lines' width in the newest frame; None where they tell none."""
        return self._widths.by_width_m

    @property
    def widths_tell(self) -> bool:
        """The lines of the newest frame tell a height by their width, and so do those before, steadily."""
        return self._widths.tell

    @property
    def newest_ns(self) -> int:
        """The exposure of the newest frame taken; 0 before the first."""
        return self._stamp_ns

    @property
    def lean_leaps(self) -> int:
        """How often roll and pitch were told otherwise while the gyros felt no turn."""
        return self._carried_lean.leaps

    def learnt(self) -> LearntSensors | None:
        """What is known of the sensors, for the tracker after this one; None before a line was seen, and once
        the camera was knocked: somebody will put it right."""
        return self._filter.learnt() if self._lines_ns and not self._knocked else None

    def assume(self, samples: Iterable[Attitude]) -> None:
        """Take what is assumed of the attitude from the newest sample on, in the place of what was."""
        lead_rad, lead_at = self._carried_heading.lead_rad, self._carried_lean.lead_at
        self._history.assume(
            sample.turned_to(wrap_pi(sample.yaw_rad + lead_rad)).leant_by(*lead_at(sample.stamp_ns))
            for sample in samples
        )

    def measured(self, lines: LineSet) -> bool:
        """Whether the attitude at the frame's exposure has been told."""
        return self.exposed_ns(lines) <= self._history.measured_ns

    def attitude(self, sample: Attitude, *, leaps: bool = True) -> Lean:
        """Take a sample of telemetry; by how much its roll and pitch leapt, where a leap is none of the floor
        that it touches."""
        carried = self._carried_heading.take(sample, watched=sample.stamp_ns - self._lines_ns < _WATCHED_NS)
        self._as_told.add(sample)
        self._history.add(self._carried_lean.take(carried, leaps=leaps))
        self._dispute.told(carried)
        if not self._headed:
            self._headed = True
            offset = wrap_pi(self._start_yaw_rad - carried.yaw_rad)
            self._filter.turn_to(offset, self._params.start_yaw_sigma_rad)
        return self._carried_lean.leap

    def stands(self, told_rad: tuple[float, float]) -> tuple[float, float] | None:
        """The drone stands in that roll and pitch, as they are told; returns those of a drone that is level,
        None once lines have told of the attitude: then it is no measurement of its own any more."""
        if self._lines_ns:
            return None
        self._filter.stand_level(told_rad)
        return -self._filter.mean(ROLL), -self._filter.mean(PITCH)

    def exposed_ns(self, lines: LineSet) -> int:
        """When the frame was exposed, by what has been learnt of the camera's delay."""
        return lines.stamp_ns + round(self._filter.mean(DELAY) * 1e9)

    def frame(
        self, lines: LineSet, height_m: float, height_sigma_m: float = 0.0, climb_mps: float = 0.0
    ) -> bool:
        """Take the lines of one frame seen at `height_m`, known to `height_sigma_m`, in a climb of so much;
        False when it could not be used (older than the last, no attitude at its exposure, no height)."""
        stamp_ns = self.exposed_ns(lines)
        attitude = self._history.at(stamp_ns)
        if attitude is None or not self._headed or lines.stamp_ns <= self._told_ns:
            return False
        height_m = self._height_m(lines, attitude, stamp_ns, height_m, climb_mps)
        if not height_m > 0:
            return False
        self._told_ns = lines.stamp_ns
        self._stands = self._stands and height_m < _HARDLY_RISEN_M
        self._filter.height_known_to(height_sigma_m / height_m)
        self._advance(stamp_ns)
        view = self._view(attitude, stamp_ns, height_m, corrected_lens(self._lens, self._filter))
        lines = self._as_of_one_moment(lines, attitude, stamp_ns, height_m)
        params, assumed = self._params, self._history.is_assumed(stamp_ns)
        low, high = (share * self._line_width_m for share in params.width_share)
        seen = ground_lines(lines.lines, view)
        on_floor = [line for line in seen if low <= line.width_m <= high]
        self._settle_dispute(on_floor, attitude)
        yaw = attitude.yaw_rad + self._filter.mean(PSI)
        sigma_yaw, tilt = self._filter.sigma(PSI), (view.attitude.roll_rad, view.attitude.pitch_rad)
        leans = view.mount.roll_rad, view.mount.pitch_rad
        placed = (
            line_sight(line, yaw, sigma_yaw, tilt, height_m, params.min_sigma_m, leans) for line in on_floor
        )
        sights = [as_compensated(sight, self._compensation) for sight in placed if sight is not None]
        # without an exact compensation they do not move as its lines do
        told = lines.features if self._compensation is TiltCompensation.EXACT else ()
        features = feature_sights(told, view, yaw, params.feature_sigma_px / self._lens.fx_px)
        rates, exact = self._history.rates(stamp_ns), self._compensation is TiltCompensation.EXACT
        believed = features if self._trust.holds else []
        for axis in self._filter.update(sights, rates, stamp_ns, believed, assumed=assumed, exact=exact):
            self._features_ns[axis] = stamp_ns
        places = {seen.id: (seen.across[0].offset_m, seen.across[1].offset_m) for seen in features}
        by_lines = self._filter.lines_seen(stamp_ns), self._filter.speeds(stamp_ns)
        self._trust.step(SeenFrame(stamp_ns, height_m, places, *by_lines))
        self._seen_in = None if assumed else attitude
        self._place_marks(lines, view, attitude.yaw_rad + self._filter.mean(PSI))
        if sights:
            self._lines_ns, self._stands = stamp_ns, False
        return True

    def _height_m(
        self, lines: LineSet, attitude: Attitude, stamp_ns: int, told_m: float, climb_mps: float
    ) -> float:
        """The height from which a frame was seen, by what was told of it, by what the lines' width says, and
        by what has been learnt of both; not above 0 where there is none."""
        view = self._view(attitude, stamp_ns, told_m, self._lens)
        by_width_m = [one for one in heights_by_width(lines.lines, view, self._line_width_m) if one > 0.0]
        off_share = self._filter.mean(HEIGHT) + self._filter.mean(HEIGHT_SCALE)
        climbed_m = climbed_between_m(climb_mps, self._filter.delay_sigma_s)
        height_m = self._widths.believed_m(by_width_m, told_m, stamp_ns, climbed_m) * (1.0 + off_share)
        by_lens = 1.0 - self._filter.mean(SCALE)
        return self._near_floor.height_m([by_lens * one for one in by_width_m], height_m, stamp_ns)

    def _place_marks(self, lines: LineSet, view: FloorView, yaw: float) -> None:
        """Where pads, markers and junctions of a frame lie, as the filter has it now."""
        self._pads = tuple(PadOffset(x, y, side) for _, x, y, side in placed_squares(lines.pads, view, yaw))
        marks = placed_squares(lines.markers, view, yaw)
        self._markers = tuple(MarkerOffset(mark.id, x, y, side) for mark, x, y, side in marks)
        self._junctions = floor_junctions(lines.junctions, view, yaw)

    def _as_of_one_moment(
        self, lines: LineSet, attitude: Attitude, stamp_ns: int, height_m: float
    ) -> LineSet:
        if not self._readout_s:
            return lines
        held = self._filter
        velocity = held.mean(VX), held.mean(VY)
        yaw = attitude.yaw_rad + held.mean(PSI)
        lens, mount = corrected_lens(self._lens, held), corrected_mount(self._mount, held)
        motion = ImageMotion.of(self._history.rates(stamp_ns), velocity, yaw, height_m, mount)
        return as_of_one_moment(lines, lens, motion, self._readout_s)

    def exposure_motion(self, now_ns: int) -> ExposureMotion | None:
        """What the newest frame tells of the motion; None where it was laid over an attitude that was only
        assumed, or lines or gyros contradict the heading."""
        seen_in, held, told = self._seen_in, self._filter, self._as_told.at(self._stamp_ns)
        doubted = self._dispute.error_rad or self._carried_heading.leapt_lately
        if seen_in is None or told is None or self._stamp_ns == 0 or doubted:
            return None
        by_lines = held.speeds(self._stamp_ns)
        variances = [
            held.sigma(VX + axis) ** 2
            if by_lines[axis] is not None or self._features_ns[axis] == self._stamp_ns
            else math.nan
            for axis in range(2)
        ]
        return ExposureMotion(
            replace(told, stamp_ns=self._stamp_ns),
            wrap_pi(seen_in.yaw_rad + held.mean(PSI)),
            (held.mean(VX), held.mean(VY)),
            (variances[0], variances[1]),
            self._carried_to(now_ns).way_m,
        )

    def at(self, now_ns: int) -> TrackSet | None:
        """The tracks carried on to `now_ns`, or None before the first frame."""
        if not self._headed or self._stamp_ns == 0:
            return None
        newest = self._history.at(now_ns) or self._history.newest
        assert newest is not None
        held = self._filter
        yaw = wrap_pi(newest.yaw_rad + held.mean(PSI))
        known_ns = now_ns - self._forget_ns
        carried = self._carried_to(now_ns)
        moved_x, moved_y = carried.way_m
        ahead_s, goes_on = (now_ns - self._stamp_ns) * 1e-9, self._stamp_ns > known_ns
        sigma_x, sigma_y = self._speed_sigma(0, ahead_s), self._speed_sigma(1, ahead_s)
        across_x, across_y = (self._lines(0), self._lines(1)) if goes_on else ((), ())
        return TrackSet(
            now_ns,
            self._lines_ns,
            yaw,
            held.sigma(PSI),
            *carried.velocity_mps,
            *carried.accel_mps2,
            tuple(line.moved(moved_x, moved_y, sigma_x * ahead_s) for line in across_x),
            tuple(line.moved(moved_y, moved_x, sigma_y * ahead_s) for line in across_y),
            tuple(pad.moved(moved_x, moved_y) for pad in self._pads),
            self._stamp_ns,
            tuple(seen.moved(moved_x, moved_y) for seen in self._junctions),
            self._stamp_ns,
            sensors=held.sensors() if self._lines_ns else NOT_SEEN,
            push_x_mps2=held.push_after(0, ahead_s),
            push_y_mps2=held.push_after(1, ahead_s),
            markers=tuple(mark.moved(moved_x, moved_y) for mark in self._markers),
            features_ns=(self._features_ns[0], self._features_ns[1]),
            velocity_sigma_mps=(sigma_x, sigma_y),
        )

    def to_survey(self, axis: int) -> bool:
        """Whether `survey` could tell anything new of the tracks across the axis."""
        return awaits_survey(self._filter.held, axis)

    def survey(self, axis: int, places_m: Mapping[int, float], sigma_m: float) -> None:
        """Tracks, by their ids, are lines of the map that lie there, m across the axis, to `sigma_m`."""
        if self._compensation is TiltCompensation.EXACT:
            self._filter.survey(axis, places_m, sigma_m)

    def lead(self, now_ns: int, then_ns: int) -> Lead:
        """The motion from now to a moment to come, by what is assumed of the attitude until then."""
        if not self._headed or self._stamp_ns == 0 or then_ns <= now_ns:
            return NO_LEAD
        yaw_now, yaw_then = (self._attitude_at(stamp_ns).yaw_rad for stamp_ns in (now_ns, then_ns))
        if self._stands:
            return NO_LEAD._replace(yaw_rad=wrap_pi(yaw_then - yaw_now))
        vx, vy = self._carried_to(now_ns).velocity_mps
        then = self._carried(now_ns, then_ns, vx, vy)
        (then_vx, then_vy), turned = then.velocity_mps, wrap_pi(yaw_then - yaw_now)
        return Lead(*then.way_m, then_vx - vx, then_vy - vy, turned, (then_ns - now_ns) * 1e-9)

    def unleant(self, now_ns: int) -> tuple[float, float]:
        """Acceleration along the grid axes (m/s2) that the lean, as it is carried, does not explain: push of
        the air and error of the attitude, as they are expected then; drag is not in it."""
        if self._stands:
            return 0.0, 0.0
        held, told = self._filter, self._attitude_at(now_ns)
        as_told, ahead_s = self._leant(told), (now_ns - self._stamp_ns) * 1e-9
        ax, ay = held.accel(Told(told.roll_rad, told.pitch_rad, told.yaw_rad))
        push = held.push_after(0, ahead_s), held.push_after(1, ahead_s)
        return ax - as_told[0] + push[0], ay - as_told[1] + push[1]

    def leapt(self, now_ns: int) -> tuple[float, float]:
        """Acceleration along the grid axes (m/s2) that the told lean leaves out since it leapt."""
        lead = self._carried_lean.lead_at(now_ns)
        if not any(lead):
            return 0.0, 0.0
        carried = self._attitude_at(now_ns)
        x, y = self._leant(carried)
        told_x, told_y = self._leant(carried.leant_by(-lead.roll_rad, -lead.pitch_rad))
        return x - told_x, y - told_y

    def leant(self, now_ns: int, lean_by: Lean) -> tuple[float, float]:
        """Acceleration along the grid axes (m/s2) that such a lean makes in the heading of now."""
        if not any(lean_by):
            return 0.0, 0.0
        return self._leant(Attitude(now_ns, *lean_by, self._attitude_at(now_ns).yaw_rad))

    def _leant(self, lean_of: Attitude) -> tuple[float, float]:
        """Acceleration along the grid axes that such a lean makes, were it free of errors."""
        told = Told(lean_of.roll_rad, lean_of.pitch_rad, lean_of.yaw_rad)
        return lean(self._filter.without_errors(), told)[0]

    def _carried_to(self, now_ns: int) -> Carried:
        """The motion from the newest frame on; a longer blindness than is remembered is not bridged by
        prediction."""
        if self._stands:
            return AT_REST
        since_ns = max(self._stamp_ns, now_ns - self._forget_ns)
        return self._carried(since_ns, now_ns, self._filter.mean(VX), self._filter.mean(VY))

    def _carried(self, from_ns: int, to_ns: int, vx: float, vy: float) -> Carried:
        """The motion after flying on with a velocity in the attitude told or assumed."""
        pushed, drag = self._filter.carrier(), self._params.noise.drag_per_s
        moved_x = moved_y = ax = ay = 0.0
        stamp_ns = from_ns
        while stamp_ns < to_ns:
            step_ns = min(_STEP_NS, to_ns - stamp_ns)
            middle_ns, dt_s = stamp_ns + step_ns // 2, step_ns * 1e-9
            ax, ay = pushed.accel(self._attitude_at(middle_ns), (middle_ns - self._stamp_ns) * 1e-9)
            ax -= drag * vx
            ay -= drag * vy
            moved_x += vx * dt_s + 0.5 * ax * dt_s * dt_s
            moved_y += vy * dt_s + 0.5 * ay * dt_s * dt_s
            vx += ax * dt_s
            vy += ay * dt_s
            stamp_ns += step_ns
        return Carried((vx, vy), (moved_x, moved_y), (ax, ay))

    def _speed_sigma(self, axis: int, ahead_s: float) -> float:
        """Of the speed along an axis so long after the newest frame."""
        return _STANDING_MPS if self._stands else self._filter.speed_sigma_after(axis, ahead_s)

    def _lines(self, axis: int) -> list[TrackedLine]:
        """All lines held across an axis, nearest to the drone first."""
        held = [
            TrackedLine(
                line.id,
                *self._filter.offset(at),
                line.width_m,
                line.seen_ns,
                line.hits,
                line.from_m,
                line.to_m,
            )
            for at, line in enumerate(self._filter.held)
            if line.axis == axis and line.feature is None
        ]
        return sorted(held, key=lambda line: abs(line.offset_m))

    def _advance(self, stamp_ns: int) -> None:
        """Carry the filter from the last frame to this one."""
        if stamp_ns - self._stamp_ns > self._forget_ns:
            self._filter.forget()
        elif self._stamp_ns:
            while self._stamp_ns < stamp_ns:
                step_ns = min(2 * _STEP_NS, stamp_ns - self._stamp_ns)
                told = self._attitude_at(self._stamp_ns + step_ns // 2)
                self._filter.predict(step_ns * 1e-9, told.roll_rad, told.pitch_rad, told.yaw_rad)
                self._stamp_ns += step_ns
            if self._stands:
                self._filter.stand()
        self._stamp_ns = max(stamp_ns, self._stamp_ns)

    def _attitude_at(self, stamp_ns: int) -> Attitude:
        attitude = self._history.at(stamp_ns) or self._history.newest
        assert attitude is not None
        return attitude

    def _view(self, attitude: Attitude, stamp_ns: int, height_m: float, lens: Lens) -> FloorView:
        """How the floor was seen from that height through that lens, by what has been learnt of attitude and
        mount."""
        sigma_tilt_rad = 0.0 if self._compensation is TiltCompensation.EXACT else self._params.sigma_tilt_rad
        if self._history.is_assumed(stamp_ns):
            sigma_tilt_rad = _ASSUMED_TILT_RAD
        mount = corrected_mount(self._mount, self._filter)
        corrected = corrected_attitude(attitude, self._filter)
        return FloorView(lens, mount, corrected, height_m, self._compensation, sigma_tilt_rad)

    def _settle_dispute(self, on_floor: list[GroundLine], attitude: Attitude) -> None:
        """Believe lines that outvote the heading for long: it, or the camera's mount, has turned."""
        held = self._filter
        yaw, sigma = attitude.yaw_rad + held.mean(PSI), held.sigma(PSI)
        turns = [turn_of(line, yaw) for line in on_floor]
        carried, told = self._carried_heading, self._as_told.at(attitude.stamp_ns)
        if told is not None and not carried.gyros_wrong:
            offset_rad, parted = wrap_pi(yaw - told.yaw_rad), carried.leapt_lately
            right_rad = self._judge.step(attitude.stamp_ns, offset_rad, turns, parted=parted)
            if right_rad is not None:
                carried.distrust()
                held.turn_to(right_rad, self._params.start_yaw_sigma_rad)
        vote = heading_vote(on_floor, yaw, sigma, self._dispute.error_rad)
        turned = self._dispute.step(vote, attitude.stamp_ns)
        if turned is Turned.CAMERA:
            self._knocked = True
            held.turn_mount_by(self._dispute.error_rad)
        elif turned is Turned.HEADING:
            held.turn_to(held.mean(PSI) + self._dispute.error_rad, self._params.start_yaw_sigma_rad)
