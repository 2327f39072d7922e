"""Line tracks on the floor: from each frame's lines to smooth offsets, velocities and heading.

The filters live at the capture time of the newest frame, where the measured attitude of that moment is
known; `at` carries them on to the present with the attitude flown since.  So a late picture costs
prediction, never truth.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from statistics import median
from typing import TypeVar

from flightd.config.control import TiltCompensation
from flightd.config.tracking import TrackingConfig
from flightd.core.geometry import GRAVITY_MPS2, Lens, Mount, wrap_pi
from flightd.core.tracks import FloorJunction, MarkerOffset, PadOffset, TrackedLine, TrackSet
from flightd.core.types import Attitude, LineSet, MarkerSight, PadSight
from flightd.tracking.attitude_history import AttitudeHistory
from flightd.tracking.axis_filters import AxisTracker, HeadingTracker, LineMeasurement
from flightd.tracking.ground_junctions import floor_junctions
from flightd.tracking.tilt_compensation import (
    FloorView,
    GroundLine,
    ground_lines,
    ground_point,
)

_STEP_NS = 20_000_000
_ASSUMED_TILT_RAD = math.radians(2.0)
_PARALLEL_RAD = math.radians(20.0)
_WIDTH_GAIN = 0.15
_AGREEING, _DOUBTED = 0.15, 0.2
_SAME_RAD = math.radians(3.0)
_DISPUTE_NS, _SHOWN_NS = 600_000_000, 1_500_000_000
_DEFAULTS = TrackingConfig()
_Square = TypeVar("_Square", PadSight, MarkerSight)


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
    ) -> None:
        params = config.expert
        self._lens, self._mount, self._compensation = lens, mount, compensation
        self._line_width_m = line_width_m
        self._params = params
        self._start_yaw_rad = start_yaw_rad
        self._history = AttitudeHistory()
        self._heading: HeadingTracker | None = None
        forget_ns = round(params.forget_s * 1e9)
        self._x = AxisTracker(params.noise, params.gate_m, forget_ns)
        self._y = AxisTracker(params.noise, params.gate_m, forget_ns)
        self._forget_ns = forget_ns
        self._lines_ns = 0
        self._stamp_ns = 0
        self._pads: tuple[PadOffset, ...] = ()
        self._junctions: tuple[FloorJunction, ...] = ()
        self._markers: tuple[MarkerOffset, ...] = ()
        self.rejected = 0
        self.height_share = 1.0
        """The height told lately against that by the lines' width; 1 when they agree."""
        self._widths_agreed = False
        self._dispute = _Dispute()

    @property
    def heading_error_rad(self) -> float:
        """What all lines lately said against the vehicle's heading; 0 while any of them agrees."""
        return self._dispute.error_rad

    def assume(self, sample: Attitude) -> None:
        """Take an attitude that is only assumed, while the vehicle is silent."""
        self._history.assume(sample)

    def attitude(self, sample: Attitude) -> None:
        self._history.add(sample)
        if self._heading is None:
            offset = wrap_pi(self._start_yaw_rad - sample.yaw_rad)
            self._heading = HeadingTracker(offset, self._params.start_yaw_sigma_rad)

    def frame(self, lines: LineSet, height_m: float) -> bool:
        """Take the lines of one frame seen at `height_m`; False when it could not be used (older than
        the last, no attitude at its exposure, no height)."""
        attitude = self._history.at(lines.stamp_ns)
        height_m = self._believed_height_m(lines, height_m)
        if attitude is None or self._heading is None or not height_m > 0 or lines.stamp_ns <= self._stamp_ns:
            self.rejected += 1
            return False
        self._advance(lines.stamp_ns)
        params = self._params
        assumed = self._history.is_assumed(lines.stamp_ns)
        sigma_tilt_rad = _ASSUMED_TILT_RAD if assumed else params.sigma_tilt_rad
        view = FloorView(self._lens, self._mount, attitude, height_m, self._compensation, sigma_tilt_rad)
        low, high = (share * self._line_width_m for share in params.width_share)
        seen = ground_lines(lines.lines, view)
        on_floor = [line for line in seen if low <= line.width_m <= high]
        yaw = self._turn(on_floor, attitude)
        across_x: list[LineMeasurement] = []
        across_y: list[LineMeasurement] = []
        cos, sin = math.cos(yaw), math.sin(yaw)
        for line in on_floor:
            sigma = max(line.sigma_m, params.min_sigma_m)
            x = cos * line.forward_m - sin * line.right_m
            y = sin * line.forward_m + cos * line.right_m
            direction = line.theta_rad + yaw
            if abs(math.sin(direction)) < math.sin(_PARALLEL_RAD):
                spread = math.hypot(sigma, x * self._heading.sigma_rad)
                ends = sorted(cos * forward - sin * right for forward, right in line.ends_m)
                across_y.append(LineMeasurement(y, spread, line.width_m, ends[0], ends[1]))
            elif abs(math.cos(direction)) < math.sin(_PARALLEL_RAD):
                spread = math.hypot(sigma, y * self._heading.sigma_rad)
                ends = sorted(sin * forward + cos * right for forward, right in line.ends_m)
                across_x.append(LineMeasurement(x, spread, line.width_m, ends[0], ends[1]))
        self._pads = tuple(PadOffset(x, y, side) for _, x, y, side in _placed(lines.pads, view, yaw))
        marks = _placed(lines.markers, view, yaw)
        self._markers = tuple(MarkerOffset(mark.id, x, y, side) for mark, x, y, side in marks)
        self._x.update(across_x, lines.stamp_ns)
        self._y.update(across_y, lines.stamp_ns)
        self._junctions = floor_junctions(lines.junctions, view, yaw)
        if across_x or across_y:
            self._lines_ns = lines.stamp_ns
        return True

    def at(self, now_ns: int) -> TrackSet | None:
        """The tracks carried on to `now_ns`, or None before the first frame."""
        if self._heading is None or self._stamp_ns == 0:
            return None
        newest = self._history.at(now_ns) or self._history.newest
        assert newest is not None
        yaw = wrap_pi(newest.yaw_rad + self._heading.offset_rad)
        moved_x = moved_y = 0.0
        vx, vy = self._x.velocity_mps, self._y.velocity_mps
        ax = ay = 0.0
        known_ns = now_ns - self._forget_ns  # a longer blindness is not bridged by prediction
        stamp_ns = max(self._stamp_ns, known_ns)
        while stamp_ns < now_ns:
            step_ns = min(_STEP_NS, now_ns - stamp_ns)
            ax, ay = self._accel(stamp_ns + step_ns // 2)
            dt_s = step_ns * 1e-9
            ahead_s = (stamp_ns + step_ns // 2 - self._stamp_ns) * 1e-9
            ax += self._x.disturbance_after(ahead_s) - self._x.drag_per_s * vx
            ay += self._y.disturbance_after(ahead_s) - self._y.drag_per_s * vy
            moved_x += vx * dt_s + 0.5 * ax * dt_s * dt_s
            moved_y += vy * dt_s + 0.5 * ay * dt_s * dt_s
            vx += ax * dt_s
            vy += ay * dt_s
            stamp_ns += step_ns
        return TrackSet(
            now_ns,
            self._lines_ns,
            yaw,
            self._heading.sigma_rad,
            vx,
            vy,
            ax,
            ay,
            tuple(_moved(line, moved_x, moved_y) for line in self._x.lines() if line.seen_ns > known_ns),
            tuple(_moved(line, moved_y, moved_x) for line in self._y.lines() if line.seen_ns > known_ns),
            tuple(replace(pad, x_m=pad.x_m - moved_x, y_m=pad.y_m - moved_y) for pad in self._pads),
            self._stamp_ns,
            tuple(
                replace(seen, dx_m=seen.dx_m - moved_x, dy_m=seen.dy_m - moved_y) for seen in self._junctions
            ),
            self._stamp_ns,
            push_x_mps2=self._x.disturbance_after((now_ns - self._stamp_ns) * 1e-9),
            push_y_mps2=self._y.disturbance_after((now_ns - self._stamp_ns) * 1e-9),
            markers=tuple(
                replace(mark, x_m=mark.x_m - moved_x, y_m=mark.y_m - moved_y) for mark in self._markers
            ),
        )

    def _advance(self, stamp_ns: int) -> None:
        """Carry the filters from the last frame to this one."""
        assert self._heading is not None
        if stamp_ns - self._stamp_ns > self._forget_ns:
            self._x.forget()
            self._y.forget()
        elif self._stamp_ns:
            while self._stamp_ns < stamp_ns:
                step_ns = min(2 * _STEP_NS, stamp_ns - self._stamp_ns)
                ax, ay = self._accel(self._stamp_ns + step_ns // 2)
                self._x.predict(step_ns * 1e-9, ax)
                self._y.predict(step_ns * 1e-9, ay)
                self._heading.predict(step_ns * 1e-9)
                self._stamp_ns += step_ns
        self._stamp_ns = stamp_ns

    def _accel(self, stamp_ns: int) -> tuple[float, float]:
        """Acceleration along the grid axes that the attitude makes at constant height, g tan(tilt)."""
        attitude = self._history.at(stamp_ns) or self._history.newest
        assert attitude is not None
        assert self._heading is not None
        yaw = attitude.yaw_rad + self._heading.offset_rad
        forward = -GRAVITY_MPS2 * math.tan(attitude.pitch_rad)
        right = GRAVITY_MPS2 * math.tan(attitude.roll_rad)
        return math.cos(yaw) * forward - math.sin(yaw) * right, math.sin(yaw) * forward + math.cos(
            yaw
        ) * right

    def _turn(self, on_floor: list[GroundLine], attitude: Attitude) -> float:
        """Correct the heading by every line near a grid direction; return the yaw at exposure."""
        assert self._heading is not None
        told: list[float] = []
        agreed = False
        for line in on_floor:
            yaw = attitude.yaw_rad + self._heading.offset_rad
            # a line of the grid has direction -yaw or 90 deg - yaw in the level frame
            innovation = (-line.theta_rad - yaw + math.pi / 4) % (math.pi / 2) - math.pi / 4
            sigma = max(line.sigma_theta_rad, math.radians(0.2))
            if abs(innovation) < max(math.radians(4.0), 4.0 * math.hypot(self._heading.sigma_rad, sigma)):
                self._heading.update(innovation, sigma)
                agreed = True
            told.append(innovation)
        if self._dispute.step(told, agreed, attitude.stamp_ns):
            self._heading.restart(self._dispute.error_rad, self._params.start_yaw_sigma_rad)
        return attitude.yaw_rad + self._heading.offset_rad

    def _believed_height_m(self, lines: LineSet, told_m: float) -> float:
        """The height told, unless there is none or the width of the lines contradicts it: then theirs."""
        if not lines.lines:
            return told_m
        scale = self._line_width_m * self._lens.fx_px
        heights_m = [scale / line.width_px for line in lines.lines if line.width_px > 0]
        if not told_m > 0 or not heights_m:
            return median(heights_m) if heights_m else told_m
        by_width_m = min(heights_m, key=lambda height_m: abs(height_m - told_m))  # one that agrees is enough
        self._widths_agreed |= abs(told_m / by_width_m - 1.0) < _AGREEING
        if not self._widths_agreed:  # then it is the line that is another
            return told_m
        self.height_share += _WIDTH_GAIN * (told_m / by_width_m - self.height_share)
        return by_width_m if abs(self.height_share - 1.0) > _DOUBTED else told_m


class _Dispute:
    """Lines that all contradict the vehicle's heading, and by the same angle, frame after frame."""

    def __init__(self) -> None:
        self.error_rad = 0.0
        self._since_ns = 0
        self._settled_ns: int | None = None

    def step(self, told: list[float], agreed: bool, stamp_ns: int) -> bool:
        """Take what one frame's lines say; True when the lines have it.  The error is then shown for a
        while longer, so that nobody overlooks it."""
        if self._settled_ns is not None:
            if stamp_ns - self._settled_ns > _SHOWN_NS:
                self._settled_ns, self.error_rad = None, 0.0
            return False
        if agreed or not told:
            self.error_rad = 0.0
            return False
        error = median(told)
        if not self.error_rad or abs(error - self.error_rad) > _SAME_RAD:
            self._since_ns = stamp_ns
        self.error_rad = error
        if stamp_ns - self._since_ns < _DISPUTE_NS:
            return False
        self._settled_ns = stamp_ns
        return True


def _placed(
    squares: Iterable[_Square], view: FloorView, yaw_rad: float
) -> list[tuple[_Square, float, float, float]]:
    """Each square with its centre on the floor, in grid axes about the drone at the time of the frame, and
    the length of its sides; without those that the view cannot place."""
    cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
    found = []
    for square in squares:
        point = ground_point(square.x_px, square.y_px, view)
        if point is not None:
            forward, right, metres_per_px = point
            x_m, y_m = cos * forward - sin * right, sin * forward + cos * right
            found.append((square, x_m, y_m, square.side_px * metres_per_px))
    return found


def _moved(line: TrackedLine, across_m: float, along_m: float) -> TrackedLine:
    """The line as the drone sees it after moving so far across it and along it."""
    return replace(
        line,
        offset_m=line.offset_m - across_m,
        from_m=line.from_m - along_m,
        to_m=line.to_m - along_m,
    )
