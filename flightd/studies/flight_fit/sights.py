"""Which painted line of the map each line of a frame is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flightd.config.control import TiltCompensation
from flightd.core.geometry import Lens, Matrix, Mount
from flightd.core.types import Attitude, Line, LineSet
from flightd.site.painted_lines import PaintMap
from flightd.site.site import Site
from flightd.tracking.tilt_compensation import FloorView, ground_lines

_PARALLEL_RAD = math.radians(8.0)
_WIDTHS = (0.6, 1.6)
"""A line that is seen narrower or wider than so many of the guide lines' width is none."""
_BEYOND_M = 0.3
"""So far past the ends of a line on the map it may have been painted."""
_RIVAL = 2.0
"""The next line must be farther than so many times as far as the nearest."""
_LEAST_PX = 20.0
"""A shorter piece of a line tells little and is often none."""
_NOISE_PX, _NOISE_RAD = 0.4, math.radians(0.15)
"""What the detector's own sigma does not tell: worn edges, the lens, the shutter."""


@dataclass(frozen=True, slots=True)
class PaintedLines:
    """The L lines of a map as a fit takes them: (L, 2) reference points, (L,) directions from x, clockwise.
    Lines across x first, then those across y, as in `PaintMap`."""

    at_m: Matrix
    direction_rad: Matrix
    across_x: int
    """So many of them lie across x."""

    @classmethod
    def of(cls, site: Site) -> PaintedLines:
        across_x, across_y = PaintMap.of(site).axes
        x = [
            (at, (a + b) / 2) for at, a, b in zip(across_x.at_m, across_x.from_m, across_x.to_m, strict=True)
        ]
        y = [
            ((a + b) / 2, at) for at, a, b in zip(across_y.at_m, across_y.from_m, across_y.to_m, strict=True)
        ]
        turned = [math.pi / 2] * len(x) + [0.0] * len(y)
        return cls(np.array([*x, *y]).reshape(-1, 2), np.array(turned), len(x))

    def moved(self, offset_m: Matrix, angle_rad: Matrix) -> PaintedLines:
        """The same lines (L,) metres further along x or y, turned clockwise about their reference points."""
        at_m = self.at_m.copy()
        at_m[: self.across_x, 0] += offset_m[: self.across_x]
        at_m[self.across_x :, 1] += offset_m[self.across_x :]
        return PaintedLines(at_m, self.direction_rad + angle_rad, self.across_x)


@dataclass(frozen=True, slots=True)
class Sights:
    """N lines seen and known: (N,) index of frame and of painted line, (N, 2, 2) both ends in pixels from the
    picture's first one, (N, 2, 2) covariance of what the ends lie off the line."""

    frame: NDArray[np.int64]
    line: NDArray[np.int64]
    ends_px: Matrix
    covariance_px2: Matrix

    def __len__(self) -> int:
        return len(self.frame)

    def counted(self, lines: int) -> NDArray[np.int64]:
        """(L,) in how many frames each line was seen."""
        pairs = np.unique(np.stack([self.line, self.frame], axis=1), axis=0)
        return np.bincount(pairs[:, 0], minlength=lines)


@dataclass(frozen=True, slots=True)
class Poses:
    """Where the drone is believed to have been at each of K frames, (K,) each."""

    x_m: Matrix
    y_m: Matrix
    height_m: Matrix
    roll_rad: Matrix
    pitch_rad: Matrix
    yaw_rad: Matrix


def associate(
    frames: Sequence[LineSet],
    site: Site,
    lens: Lens,
    mount: Mount,
    poses: Poses,
    off_m: Matrix,
    gate_m: float,
) -> Sights:
    """The lines of each frame that are surely one of the map's, which lie (L,) `off_m` beside it as far as
    one knows, along x or y."""
    axes = PaintMap.of(site).axes
    split = len(axes[0].at_m)
    places = axes[0].at_m + off_m[:split], axes[1].at_m + off_m[split:]
    numbers, lines, ends, spreads = [], [], [], []
    low_m, high_m = (share * site.line_width_m for share in _WIDTHS)
    for k, seen in enumerate(frames):
        attitude = Attitude(0, float(poses.roll_rad[k]), float(poses.pitch_rad[k]), 0.0)
        view = FloorView(lens, mount, attitude, float(poses.height_m[k]), TiltCompensation.EXACT, 0.0)
        long = [line for line in seen.lines if line.span_px >= _LEAST_PX]
        cos, sin = math.cos(poses.yaw_rad[k]), math.sin(poses.yaw_rad[k])
        taken: dict[int, tuple[float, Line]] = {}
        for line in long:
            for ground in ground_lines([line], view):
                if not low_m <= ground.width_m <= high_m:
                    continue
                x_m = float(poses.x_m[k]) + cos * ground.forward_m - sin * ground.right_m
                y_m = float(poses.y_m[k]) + sin * ground.forward_m + cos * ground.right_m
                turned = ground.theta_rad + float(poses.yaw_rad[k])
                axis = _axis(turned)
                if axis is None:
                    continue
                across, along = (x_m, y_m) if axis == 0 else (y_m, x_m)
                lying = axes[axis]
                found = _nearest(places[axis], lying.from_m, lying.to_m, across, along, gate_m)
                if found is None:
                    continue
                index, apart_m = found
                index += split * axis
                if index not in taken or apart_m < taken[index][0]:
                    taken[index] = apart_m, line
        for index, (_, line) in taken.items():
            numbers.append(k)
            lines.append(index)
            ends.append(_ends(line, lens))
            spreads.append(_spread(line))
    return Sights(
        np.array(numbers, np.int64),
        np.array(lines, np.int64),
        np.array(ends).reshape(-1, 2, 2),
        np.array(spreads).reshape(-1, 2, 2),
    )


def _axis(direction_rad: float) -> int | None:
    if abs(math.cos(direction_rad)) < math.sin(_PARALLEL_RAD):
        return 0
    return 1 if abs(math.sin(direction_rad)) < math.sin(_PARALLEL_RAD) else None


def _nearest(
    at_m: Matrix, from_m: Matrix, to_m: Matrix, across_m: float, along_m: float, gate_m: float
) -> tuple[int, float] | None:
    """The line within `gate_m`, and how far it is; None where there is none, or another nearly as near."""
    there = np.flatnonzero((from_m - _BEYOND_M <= along_m) & (along_m <= to_m + _BEYOND_M))
    if not len(there):
        return None
    apart = np.abs(at_m[there] - across_m)
    order = np.argsort(apart)
    nearest = float(apart[order[0]])
    if nearest > gate_m or (len(order) > 1 and apart[order[1]] < _RIVAL * nearest):
        return None
    return int(there[order[0]]), nearest


def _ends(line: Line, lens: Lens) -> list[tuple[float, float]]:
    cx, cy = lens.centre_px
    points = (line.point_at(line.start_px), line.point_at(line.end_px))
    return [(x + cx, y + cy) for x, y in points]


def _spread(line: Line) -> list[list[float]]:
    """(2, 2) covariance of what both ends lie off, along the line's normal: rho less `along` times theta."""
    along = (line.start_px, line.end_px)
    middle = sum(along) / 2
    rho2, theta2, both = line.sigma_rho_px**2, line.sigma_theta_rad**2, line.rho_theta_cov
    return [
        [
            rho2
            - (a + b) * both
            + a * b * theta2
            + _NOISE_PX**2
            + (a - middle) * (b - middle) * _NOISE_RAD**2
            for b in along
        ]
        for a in along
    ]
