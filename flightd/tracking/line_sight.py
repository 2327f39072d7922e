"""A line of one frame as the filter of motion and sensors takes it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from flightd.config.control import TiltCompensation
from flightd.core.types import FloorFeature
from flightd.tracking.tilt_compensation import (
    FloorView,
    GroundLine,
    floor_points,
    point_tilt_effects,
    tilt_effects,
)

_PARALLEL_RAD = math.radians(20.0)
"""A line further than this from both grid axes is none of the grid."""
_LEAST_SIGMA_RAD = math.radians(0.2)
_FARTHEST = 3.0
"""A feature further off than so many heights is told by hardly anything."""
_LEVEL = (0.0, 0.0)
_GATE_RAD, _GATE_SIGMAS = math.radians(4.0), 4.0


class LineSight(NamedTuple):
    """One line of a frame, across the grid axis `axis`: where it was seen from the drone along that axis,
    what its direction says of the heading, its width and its visible part, with the standard deviations of
    offset and direction; what a radian more of yaw would change of the offset, in the attitude and in the
    mount, and one of roll, and of pitch, of both."""

    axis: int
    offset_m: float
    turn_rad: float
    sigma_m: float
    sigma_theta_rad: float
    width_m: float
    from_m: float
    to_m: float
    offset_per_yaw: float
    offset_per_tilt: tuple[float, float]
    turn_per_tilt: tuple[float, float]
    offset_per_mount: tuple[float, float]
    turn_per_mount: tuple[float, float]
    feature: int | None = None
    offset_per_mount_yaw: float = 0.0
    tilted_m: float = 0.0
    """What the tilt of the frame makes of the offset."""
    bent_m: float = 0.0
    """What it makes of it beyond the height times the tilt."""
    turned_rad: float = 0.0
    """What it makes of the direction."""
    axis_m: float = 0.0
    """How far beyond the point below the drone the camera looks, along that axis: a shorter focal length
    moves all that is seen away from there."""


class FeatureSight(NamedTuple):
    """A point of the floor as two sights, one across each grid axis; they have its number as `feature`."""

    id: int
    across: tuple[LineSight, LineSight]


class Rates(NamedTuple):
    """How fast the told attitude changed at an exposure."""

    roll_radps: float
    pitch_radps: float
    yaw_radps: float


def turn_of(line: GroundLine, yaw_rad: float) -> float:
    """By how much the line contradicts the heading, -45 to 45 degrees: the heading held less the one told."""
    return (line.theta_rad + yaw_rad + math.pi / 4) % (math.pi / 2) - math.pi / 4


def agrees(turn_rad: float, sigma_theta_rad: float, sigma_yaw_rad: float) -> bool:
    """Whether a line that contradicts the heading by so much may still be a line of the grid."""
    sigma = math.hypot(sigma_yaw_rad, max(sigma_theta_rad, _LEAST_SIGMA_RAD))
    return abs(turn_rad) < max(_GATE_RAD, _GATE_SIGMAS * sigma)


def line_sight(
    line: GroundLine,
    yaw_rad: float,
    sigma_yaw_rad: float,
    tilt_rad: tuple[float, float],
    height_m: float,
    least_sigma_m: float,
    mount_tilt_rad: tuple[float, float] = _LEVEL,
) -> LineSight | None:
    """The line seen by a drone that heads `yaw_rad` on the grid, rolled and pitched by `tilt_rad`; None for
    one that runs along no axis of the grid."""
    direction = line.theta_rad + yaw_rad
    across_x = abs(math.cos(direction)) < math.sin(_PARALLEL_RAD)
    if not across_x and abs(math.sin(direction)) >= math.sin(_PARALLEL_RAD):
        return None
    cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
    to_x, to_y = (cos, -sin), (sin, cos)
    across, along = (to_x, to_y) if across_x else (to_y, to_x)

    def on(axis: tuple[float, float], point: tuple[float, float]) -> float:
        return axis[0] * point[0] + axis[1] * point[1]

    middle = line.forward_m, line.right_m
    by_yaw = -on(along, middle) if across_x else on(along, middle)
    turned = _untilted(middle, tilt_rad, mount_tilt_rad, height_m)
    by_mount_yaw = -on(along, turned) if across_x else on(along, turned)
    shifts, (turn_by_roll, turn_by_pitch) = tilt_effects(line, height_m)
    by_roll, by_pitch = (on(across, shift) for shift in shifts)
    tilted_m = by_roll * tilt_rad[0] + by_pitch * tilt_rad[1]
    bent_m = tilted_m - height_m * (across[0] * tilt_rad[1] - across[1] * tilt_rad[0])
    turned_rad = turn_by_roll * tilt_rad[0] + turn_by_pitch * tilt_rad[1]
    # who rolls while pitched, or is mounted pitched and rolls, turns a little, too
    turned_by_roll, turned_by_mount = -math.sin(tilt_rad[1]), math.sin(tilt_rad[0])
    by_roll, turn_by_roll = by_roll + by_yaw * turned_by_roll, turn_by_roll + turned_by_roll
    turn_rad = turn_of(line, yaw_rad)
    from_m, to_m = sorted(on(along, end) for end in line.ends_m)
    return LineSight(
        axis=0 if across_x else 1,
        offset_m=on(across, middle),
        turn_rad=turn_rad if agrees(turn_rad, line.sigma_theta_rad, sigma_yaw_rad) else math.nan,
        sigma_m=max(line.sigma_m, least_sigma_m),
        sigma_theta_rad=max(line.sigma_theta_rad, _LEAST_SIGMA_RAD),
        width_m=line.width_m,
        from_m=from_m,
        to_m=to_m,
        offset_per_yaw=by_yaw,
        offset_per_tilt=(by_roll, by_pitch),
        turn_per_tilt=(turn_by_roll, turn_by_pitch),
        offset_per_mount=(by_roll, by_pitch + by_yaw * turned_by_mount),
        turn_per_mount=(turn_by_roll, turn_by_pitch + turned_by_mount),
        offset_per_mount_yaw=by_mount_yaw,
        tilted_m=tilted_m,
        axis_m=on(across, middle) - on(across, turned),
        bent_m=bent_m,
        turned_rad=turned_rad,
    )


def feature_sights(
    features: Sequence[FloorFeature], view: FloorView, yaw_rad: float, sigma_rad: float
) -> list[FeatureSight]:
    """The features of one frame, each known to `sigma_rad` as it is seen; `yaw_rad` is that on the grid."""
    if not features:
        return []
    tilt, height_m = (view.attitude.roll_rad, view.attitude.pitch_rad), view.height_m
    sigma_m = height_m * math.hypot(sigma_rad, view.sigma_tilt_rad)
    leans = view.mount.roll_rad, view.mount.pitch_rad
    points = floor_points([(seen.x_px, seen.y_px) for seen in features], view)
    return [
        feature_sight(seen.id, point, yaw_rad, tilt, height_m, sigma_m, leans)
        for seen, point in zip(features, points, strict=bool(points))
        if math.hypot(*point) < _FARTHEST * height_m
    ]


def feature_sight(
    id_: int,
    point: tuple[float, float],
    yaw_rad: float,
    tilt_rad: tuple[float, float],
    height_m: float,
    sigma_m: float,
    mount_tilt_rad: tuple[float, float] = _LEVEL,
) -> FeatureSight:
    """The point of the floor seen at `point` (forward, right)."""
    forward, right = point
    cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
    to_axis = (cos, -sin), (sin, cos)
    x_m, y_m = (axis[0] * forward + axis[1] * right for axis in to_axis)
    shifts = point_tilt_effects(forward, right, height_m)
    turned_by_roll, turned_by_mount = -math.sin(tilt_rad[1]), math.sin(tilt_rad[0])

    turned = _untilted(point, tilt_rad, mount_tilt_rad, height_m)
    turned_x_m, turned_y_m = (axis[0] * turned[0] + axis[1] * turned[1] for axis in to_axis)

    def across(axis: int, offset_m: float, turned_m: float, by_yaw: float, by_mount_yaw: float) -> LineSight:
        by_roll, by_pitch = (to_axis[axis][0] * shift[0] + to_axis[axis][1] * shift[1] for shift in shifts)
        by_roll += by_yaw * turned_by_roll
        return LineSight(
            axis=axis,
            offset_m=offset_m,
            turn_rad=math.nan,
            sigma_m=sigma_m,
            sigma_theta_rad=math.nan,
            width_m=0.0,
            from_m=0.0,
            to_m=0.0,
            offset_per_yaw=by_yaw,
            offset_per_tilt=(by_roll, by_pitch),
            turn_per_tilt=_LEVEL,
            offset_per_mount=(by_roll, by_pitch + by_yaw * turned_by_mount),
            turn_per_mount=_LEVEL,
            offset_per_mount_yaw=by_mount_yaw,
            axis_m=offset_m - turned_m,
            feature=id_,
        )

    by_x, by_y = across(0, x_m, turned_x_m, -y_m, -turned_y_m), across(1, y_m, turned_y_m, x_m, turned_x_m)
    return FeatureSight(id_, (by_x, by_y))


def _untilted(
    point: tuple[float, float],
    tilt_rad: tuple[float, float],
    mount_tilt_rad: tuple[float, float],
    height_m: float,
) -> tuple[float, float]:
    """A point of the floor (forward, right) from where the camera looks: a camera that is turned in its mount
    turns about there, not about the point below the drone."""
    roll, pitch = tilt_rad[0] + mount_tilt_rad[0], tilt_rad[1] + mount_tilt_rad[1]
    return point[0] - height_m * pitch, point[1] + height_m * roll


def as_compensated(sight: LineSight, compensation: TiltCompensation) -> LineSight:
    """The same line as a compensation that is not exact leaves it, less sure by what that leaves in it: the
    paper's, of the first order, turns no line and forgets how tilt widens the picture away from its middle;
    without one no tilt is told by where the lines are."""
    match compensation:
        case TiltCompensation.EXACT:
            return sight
        case TiltCompensation.FIRST_ORDER:
            left_m = sight.bent_m
        case TiltCompensation.NONE:
            left_m = sight.tilted_m
            sight = sight._replace(offset_per_tilt=_LEVEL, axis_m=0.0)
    return sight._replace(
        sigma_m=math.hypot(sight.sigma_m, left_m),
        sigma_theta_rad=math.hypot(sight.sigma_theta_rad, sight.turned_rad),
        turn_per_tilt=_LEVEL,
        offset_per_mount=_LEVEL,
        turn_per_mount=_LEVEL,
    )
