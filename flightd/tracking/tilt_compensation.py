"""From lines in the picture to lines on the floor, with the camera's tilt taken out.

Three ways are selectable.  EXACT maps the line by the homography of the ground plane, l' = H.T l.
FIRST_ORDER is the paper's (eqs. 8, 9): scale by height, then subtract H tan(roll) from a vertical and
H tan(pitch) from a horizontal line; it is the exact form's first-order limit.  NONE only scales.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from flightd.config.control import TiltCompensation
from flightd.core.geometry import Lens, Matrix, Mount, ground_homography, level_from_body, normalise_line
from flightd.core.types import Attitude, Line

_MAX_TILT_RAD = math.radians(45.0)


@dataclass(frozen=True, slots=True)
class GroundLine:
    """A line on the floor in the level frame of the body (core.geometry: right cos(theta) - forward
    sin(theta) = rho), with the middle and both ends of its visible part (forward, right) and the
    standard deviations of the offset in the middle and of theta."""

    rho_m: float
    theta_rad: float
    forward_m: float
    right_m: float
    sigma_m: float
    sigma_theta_rad: float
    width_m: float
    ends_m: tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True, slots=True)
class FloorView:
    """How the floor was seen in one frame: attitude at exposure and height of the body above the floor.

    `sigma_tilt_rad` is what one does not know of roll and pitch; it moves every line alike.
    """

    lens: Lens
    mount: Mount
    attitude: Attitude
    height_m: float
    compensation: TiltCompensation
    sigma_tilt_rad: float


class _Camera(NamedTuple):
    """How a tilted camera maps the floor; all that looks at one frame shares it, so nothing changes it."""

    homography: Matrix
    """`ground_homography`."""
    inverse: Matrix
    lever_m: Matrix
    """(forward, right, down) of the camera from the body, level frame."""


@lru_cache(maxsize=4)
def _camera(lens: Lens, mount: Mount, roll_rad: float, pitch_rad: float) -> _Camera:
    homography = ground_homography(lens, mount, roll_rad, pitch_rad)
    inverse: Matrix = np.asarray(np.linalg.inv(homography), dtype=np.float64)
    lever_m: Matrix = np.asarray(
        level_from_body(roll_rad, pitch_rad) @ np.array(mount.offset_m), dtype=np.float64
    )
    return _Camera(homography, inverse, lever_m)


def ground_point(x_px: float, y_px: float, view: FloorView) -> tuple[float, float, float] | None:
    """(forward, right) in metres of a point of the floor seen at centred image coordinates, level frame of
    the body, and metres per pixel there; None for what the view cannot place.  Always the exact form."""
    roll, pitch = view.attitude.roll_rad, view.attitude.pitch_rad
    if abs(roll) > _MAX_TILT_RAD or abs(pitch) > _MAX_TILT_RAD:
        return None
    homography, _, lever = _camera(view.lens, view.mount, roll, pitch)
    height_m = view.height_m - float(lever[2])
    centre = view.lens.centre_px
    x, y, depth = np.linalg.solve(homography, np.array([x_px + centre[0], y_px + centre[1], 1.0])).tolist()
    if depth < 0.2 or not height_m > 0.02:  # the horizon, or nearly
        return None
    scale = height_m / depth
    forward, right = x * scale + float(lever[0]), y * scale + float(lever[1])
    return forward, right, height_m / view.lens.fx_px / depth**1.5


def ground_lines(lines: Sequence[Line], view: FloorView) -> list[GroundLine]:
    """The lines as they lie on the floor, without those that the view cannot place (horizon, no height)."""
    roll, pitch = view.attitude.roll_rad, view.attitude.pitch_rad
    if abs(roll) > _MAX_TILT_RAD or abs(pitch) > _MAX_TILT_RAD:
        return []
    if view.compensation is not TiltCompensation.EXACT:
        roll = pitch = 0.0
    homography, inverse, lever = _camera(view.lens, view.mount, roll, pitch)
    camera_height_m = view.height_m - float(lever[2])
    if not camera_height_m > 0.02:
        return []
    centre = view.lens.centre_px
    placed = (_place(line, view, homography, inverse, centre, camera_height_m, lever) for line in lines)
    return [line for line in placed if line is not None]


def _place(
    line: Line,
    view: FloorView,
    homography: Matrix,
    inverse: Matrix,
    centre: tuple[float, float],
    height_m: float,
    lever: Matrix,
) -> GroundLine | None:
    a, b = math.cos(line.theta_rad), math.sin(line.theta_rad)
    c = -(line.rho_px + a * centre[0] + b * centre[1])
    # l' = H.T l on the floor at unit distance
    forward, right, offset = (homography.T @ np.array([a, b, c])).tolist()
    norm = math.hypot(forward, right)
    middle_px = (line.start_px + line.end_px) / 2
    x, y = line.point_at(middle_px)
    mid_x, mid_y, depth = (inverse @ np.array([x + centre[0], y + centre[1], 1.0])).tolist()
    if norm < 1e-12 or depth < 0.2:  # the horizon, or nearly
        return None
    mid_forward, mid_right = mid_x / depth * height_m, mid_y / depth * height_m
    # the normal (right, -forward) = (cos, sin) and its offset in metres
    rho, theta = normalise_line(-offset / norm * height_m, math.atan2(-forward, right))
    tan_shift = 0.0
    if view.compensation is TiltCompensation.FIRST_ORDER:
        tan_roll, tan_pitch = math.tan(view.attitude.roll_rad), math.tan(view.attitude.pitch_rad)
        tan_shift = height_m * (tan_roll * math.cos(theta) + tan_pitch * math.sin(theta))
        mid_right -= height_m * tan_roll
        mid_forward += height_m * tan_pitch
    lever_rho = float(lever[1]) * math.cos(theta) - float(lever[0]) * math.sin(theta)
    metres_per_px = height_m / view.lens.fx_px / depth**2
    variance_px = (
        line.sigma_rho_px**2 - 2 * middle_px * line.rho_theta_cov + (middle_px * line.sigma_theta_rad) ** 2
    )
    ends = [line.point_at(line.start_px), line.point_at(line.end_px)]
    start, end = _on_floor(ends, inverse, centre, height_m, lever)
    return GroundLine(
        rho - tan_shift + lever_rho,
        theta,
        mid_forward + float(lever[0]),
        mid_right + float(lever[1]),
        math.hypot(math.sqrt(max(variance_px, 1e-4)) * metres_per_px, height_m * view.sigma_tilt_rad),
        math.hypot(line.sigma_theta_rad, view.sigma_tilt_rad * 0.5),
        line.width_px * metres_per_px,
        (start, end),
    )


def heights_by_width(lines: Sequence[Line], view: FloorView, width_m: float) -> list[float]:
    """The height of the body, metres, that each line tells by how wide it is seen, were it `width_m` wide;
    without lines that the view cannot place or whose width was not seen.  Always the exact form; the
    view's own height does not matter."""
    roll, pitch = view.attitude.roll_rad, view.attitude.pitch_rad
    if abs(roll) > _MAX_TILT_RAD or abs(pitch) > _MAX_TILT_RAD:
        return []
    _, inverse, lever = _camera(view.lens, view.mount, roll, pitch)
    lever_m = float(lever[2])
    area = 1.0 / (view.lens.fx_px * view.lens.fy_px)
    centre = view.lens.centre_px
    heights_m = []
    for line in lines:
        x, y = line.point_at((line.start_px + line.end_px) / 2)
        mid_x, mid_y, depth = (inverse @ np.array([x + centre[0], y + centre[1], 1.0])).tolist()
        if depth < 0.2 or not line.width_px > 0:  # the horizon, or nearly
            continue
        direction = np.array([-math.sin(line.theta_rad), math.cos(line.theta_rad), 0.0])
        to_x, to_y, deeper = (inverse @ direction).tolist()
        # A projective map makes an area 1/depth^3 times as large; what it is stretched along the line, it is
        # not stretched across.
        stretched = float(np.hypot(to_x * depth - mid_x * deeper, to_y * depth - mid_y * deeper)) / depth**2
        heights_m.append(width_m * stretched * depth**3 / (area * line.width_px) + lever_m)
    return heights_m


def tilt_effects(
    line: GroundLine, height_m: float
) -> tuple[tuple[tuple[float, float], tuple[float, float]], tuple[float, float]]:
    """What a radian more of roll, and of pitch, would make of a line that was placed from `height_m`: shifts
    of its middle (forward, right), and turns of its direction; first order in the tilt."""
    f, r, h = line.forward_m, line.right_m, height_m
    cos, sin = math.cos(line.theta_rad), math.sin(line.theta_rad)
    sheared = (cos * r + f * sin) / h
    turn_by_roll = sin * sheared - cos * 2.0 * r * sin / h
    turn_by_pitch = -sin * 2.0 * f * cos / h + cos * sheared
    return point_tilt_effects(f, r, h), (turn_by_roll, turn_by_pitch)


def point_tilt_effects(f: float, r: float, h: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """What a radian more of roll, and of pitch, would shift (forward, right) a point that was placed at
    (`f`, `r`) from the height `h`."""
    return (-f * r / h, -(h + r * r / h)), (h + f * f / h, f * r / h)


def floor_points(points_px: Sequence[tuple[float, float]], view: FloorView) -> list[tuple[float, float]]:
    """(forward, right) on the floor, in the level frame of the body, of points of the picture (centred
    image coordinates), by the exact homography; [] when the view cannot place them."""
    roll, pitch = view.attitude.roll_rad, view.attitude.pitch_rad
    if abs(roll) > _MAX_TILT_RAD or abs(pitch) > _MAX_TILT_RAD:
        return []
    _, inverse, lever = _camera(view.lens, view.mount, roll, pitch)
    height_m = view.height_m - float(lever[2])
    if not height_m > 0.02:
        return []
    return _on_floor(points_px, inverse, view.lens.centre_px, height_m, lever)


def _on_floor(
    points_px: Sequence[tuple[float, float]],
    inverse: Matrix,
    centre: tuple[float, float],
    height_m: float,
    lever: Matrix,
) -> list[tuple[float, float]]:
    """(forward, right) of a picture's points below a camera `height_m` up; far away near the horizon."""
    (xx, xy, x1), (yx, yy, y1), (wx, wy, w1) = inverse.tolist()
    (centre_x, centre_y), forward_m, right_m = centre, float(lever[0]), float(lever[1])
    points = []
    for x_px, y_px in points_px:
        x, y = x_px + centre_x, y_px + centre_y
        scale = height_m / max(wx * x + wy * y + w1, 0.1)
        points.append(((xx * x + xy * y + x1) * scale + forward_m, (yx * x + yy * y + y1) * scale + right_m))
    return points
