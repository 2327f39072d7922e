"""How much later than its stamps say a camera's frames are exposed, from a drone that is rocked by hand.

A line in the picture moves with the tilt, whatever its height, the lens or the mount: by gains that are not
known, for roll and for pitch.  Only at the right delay does the told attitude explain the motion.  What the
hand does besides is slow, or goes with the tilt (it rocks about its wrist); both leave the delay alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightd.core.geometry import Lens, wrap_half_pi
from flightd.core.types import Attitude, Line

Floats = NDArray[np.float64]

SEARCHED_S: Final = (-0.25, 0.4)
"""Beyond the stamps; cameras that are configured wrong by more are not looked for."""
LEAST_TILT_RAD: Final = math.radians(1.5)
"""Rms of what must be rocked for the delay to be told."""
LEAST_EXPLAINED: Final = 0.8
"""Share of the lines' motion that the tilt must explain."""
_STEP_S = 0.005
_SLOW_S = 1.5
"""What is slower than this is the hand's own motion, not its rocking."""
_LEAST_FRAMES = 60
_GAP_S = 0.25
_LEAP = 0.15
"""A line that moves by more focal lengths, or turns by more rad, from one frame to the next is another."""


@dataclass(frozen=True, slots=True)
class DelayByTilt:
    """Frames are exposed `delay_s` later than their stamps say, against the attitude; NaN with `explained` 0
    where nothing can be told.  `tilt_rad` is the rms of what was rocked, `frames` so many had a line."""

    delay_s: float
    sigma_s: float
    explained: float
    tilt_rad: float
    frames: int

    @property
    def is_known(self) -> bool:
        return self.explained >= LEAST_EXPLAINED and self.tilt_rad >= LEAST_TILT_RAD


@dataclass(frozen=True, slots=True)
class SeenLine:
    """The place of a line in a frame: offset from the principal point along its normal, in focal lengths.
    `stamp_ns` is the frame's, later or earlier by when the row was exposed that it was seen in."""

    stamp_ns: int
    offset: float


class FollowedLines:
    """Follows the steadiest line of each direction from frame to frame; `runs` are what stayed one line.
    Within `readout_s` the rows of a frame are exposed, from top to bottom, about the frame's stamp."""

    def __init__(self, lens: Lens, readout_s: float = 0.0) -> None:
        self._focal_px, self._height_px, self._readout_s = lens.fx_px, lens.height_px, readout_s
        self._runs: list[list[SeenLine]] = []
        self._open: dict[bool, tuple[float, list[SeenLine]]] = {}

    def add(self, stamp_ns: int, lines: Sequence[Line]) -> None:
        """The lines of the next frame."""
        for is_vertical in (True, False):
            near = [line for line in lines if (math.cos(line.theta_rad) ** 2 > 0.5) is is_vertical]
            open_run = self._open.get(is_vertical)
            chosen = self._going_on(open_run, stamp_ns, near) if open_run else None
            if chosen is not None and open_run is not None:
                theta_rad, offset = chosen
                open_run[1].append(SeenLine(stamp_ns + self._late_ns(offset, theta_rad), offset))
                self._open[is_vertical] = theta_rad, open_run[1]
            elif near and (open_run is None or self._is_over(open_run[1], stamp_ns)):
                best = max(near, key=lambda line: line.support * (line.end_px - line.start_px))
                offset = best.rho_px / self._focal_px
                run = [SeenLine(stamp_ns + self._late_ns(offset, best.theta_rad), offset)]
                self._runs.append(run)
                self._open[is_vertical] = best.theta_rad, run

    def _late_ns(self, offset: float, theta_rad: float) -> int:
        """By how much later than the middle row that of the foot of the line's normal was exposed: the motion
        bends a line about where it is as the foot's row has it."""
        row = offset * self._focal_px * math.sin(theta_rad) / self._height_px
        return round(min(max(row, -0.5), 0.5) * self._readout_s * 1e9)

    def _going_on(
        self, run: tuple[float, list[SeenLine]], stamp_ns: int, lines: Sequence[Line]
    ) -> tuple[float, float] | None:
        """Direction and offset of the line that goes on the run, written as its last one was."""
        theta_rad, seen = run
        if self._is_over(seen, stamp_ns):
            return None
        found = []
        for line in lines:
            turned = abs(wrap_half_pi(line.theta_rad - theta_rad))
            flipped = math.cos(line.theta_rad - theta_rad) < 0.0
            offset = (-line.rho_px if flipped else line.rho_px) / self._focal_px
            if turned < _LEAP and abs(offset - seen[-1].offset) < _LEAP:
                direction = line.theta_rad + (math.pi if flipped else 0.0)
                found.append((abs(offset - seen[-1].offset), direction, offset))
        return min(found)[1:] if found else None

    @staticmethod
    def _is_over(seen: Sequence[SeenLine], stamp_ns: int) -> bool:
        return stamp_ns - seen[-1].stamp_ns > _GAP_S * 1e9

    @property
    def runs(self) -> Sequence[Sequence[SeenLine]]:
        return self._runs


def delay_by_tilt(runs: Sequence[Sequence[SeenLine]], attitudes: Sequence[Attitude]) -> DelayByTilt:
    """The delay at which the told attitude explains best how the lines moved, by least squares."""
    nothing = DelayByTilt(math.nan, math.nan, 0.0, 0.0, sum(map(len, runs)))
    if len(attitudes) < 2:
        return nothing
    stamps_s = np.array([a.stamp_ns for a in attitudes], np.float64) * 1e-9
    told = np.array([(math.tan(a.roll_rad), math.tan(a.pitch_rad)) for a in attitudes])
    parts = list(_parts(runs, stamps_s[0] - SEARCHED_S[0], stamps_s[-1] - SEARCHED_S[1]))
    frames = sum(len(times) for times, _, _ in parts)
    if frames < _LEAST_FRAMES:
        return nothing
    delays = np.arange(SEARCHED_S[0], SEARCHED_S[1] + _STEP_S / 2, _STEP_S)
    left = np.array([_left(parts, stamps_s, told, delay) for delay in delays])
    whole = sum(float(moved @ moved) for _, moved, _ in parts)
    best = int(left.argmin())
    tilt = np.concatenate([_rocked(times, keep, stamps_s, told, delays[best]) for times, _, keep in parts])
    tilt_rad = float(np.sqrt((tilt**2).sum(axis=1).mean()))
    explained = 1.0 - float(left[best]) / whole if whole > 0.0 else 0.0
    if not 0 < best < len(delays) - 1:  # it lies beyond what is searched, or nowhere
        return DelayByTilt(math.nan, math.nan, 0.0, tilt_rad, frames)
    before, at, after = left[best - 1 : best + 2]
    bend = (before - 2.0 * at + after) / _STEP_S**2
    delay_s = float(delays[best] + (before - after) / (2.0 * bend * _STEP_S))
    # Gauss-Newton: RSS = RSS_0 + bend / 2 (tau - tau_0)^2, and sigma^2 = RSS_0 / n of each offset
    sigma_s = math.sqrt(2.0 * float(at) / frames / float(bend))
    return DelayByTilt(delay_s, sigma_s, explained, tilt_rad, frames)


def _parts(
    runs: Sequence[Sequence[SeenLine]], from_s: float, to_s: float
) -> Iterator[tuple[Floats, Floats, Floats]]:
    """Of each run that is long enough: times (n,), how it moved without what is slow (n,), and the matrix
    (n, n) that takes out what is slow."""
    for run in runs:
        times = np.array([seen.stamp_ns for seen in run], np.float64) * 1e-9
        inside = (times >= from_s) & (times <= to_s)
        times, offsets = times[inside], np.array([seen.offset for seen in run])[inside]
        if len(times) < _LEAST_FRAMES // 2 or times[-1] - times[0] < 2.0 * _SLOW_S:
            continue
        near = np.exp(-0.5 * ((times[:, None] - times[None, :]) / (_SLOW_S / 2.0)) ** 2)
        keep = np.eye(len(times)) - near / near.sum(axis=1, keepdims=True)
        yield times, keep @ offsets, keep


def _rocked(times: Floats, keep: Floats, stamps_s: Floats, told: Floats, delay_s: float) -> Floats:
    """(n, 2) of roll and pitch (their tangents) at the frames' exposures, without what is slow."""
    at = times + delay_s
    columns = [np.interp(at, stamps_s, told[:, axis]) for axis in (0, 1)]
    rocked: Floats = keep @ np.stack(columns, axis=1)
    return rocked


def _left(
    parts: Sequence[tuple[Floats, Floats, Floats]], stamps_s: Floats, told: Floats, delay_s: float
) -> float:
    """What the tilt at that delay leaves unexplained, each run with gains of its own."""
    left = 0.0
    for times, moved, keep in parts:
        rocked = _rocked(times, keep, stamps_s, told, delay_s)
        gains = np.linalg.lstsq(rocked, moved, rcond=None)[0]
        rest = moved - rocked @ gains
        left += float(rest @ rest)
    return left
