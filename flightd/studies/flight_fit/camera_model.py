"""Where a painted line is seen in the picture, and how far the ends of a line seen lie off it.

All of it is arrays of N: a line on the floor and the camera's centre span a plane, and the picture shows the
line where that plane cuts it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flightd.core.geometry import Lens, Matrix, Mount


@dataclass(frozen=True, slots=True)
class SeenFrom:
    """N views of N lines, (N,) each or one for all: place and attitude of the body in the map frame; by how
    much mount (radians), focal length (logarithm) and lens (share at one focal length from the middle) differ
    from what is configured; a point of the line and its direction, clockwise from x."""

    x_m: Matrix
    y_m: Matrix
    height_m: Matrix
    roll_rad: Matrix
    pitch_rad: Matrix
    yaw_rad: Matrix
    mount_roll_rad: Matrix
    mount_pitch_rad: Matrix
    mount_yaw_rad: Matrix
    log_focal: Matrix
    bend: Matrix
    line_x_m: Matrix
    line_y_m: Matrix
    direction_rad: Matrix


def ends_off(ends_px: Matrix, lens: Lens, mount: Mount, seen: SeenFrom) -> Matrix:
    """(N, 2) pixels by which both ends (N, 2, 2) lie off the line as it should be seen, along its normal."""
    body = _heading(seen.yaw_rad) @ _tilt(seen.roll_rad, seen.pitch_rad)
    lever = body @ np.array(mount.offset_m)
    turned = _tilt(mount.roll_rad + seen.mount_roll_rad, mount.pitch_rad + seen.mount_pitch_rad)
    image = body @ turned @ _heading(mount.yaw_rad + seen.mount_yaw_rad) @ _IMAGE_TO_BODY
    to_line = np.stack(
        [
            seen.line_x_m - seen.x_m - lever[..., 0],
            seen.line_y_m - seen.y_m - lever[..., 1],
            seen.height_m - lever[..., 2],
        ],
        axis=-1,
    )
    zero = np.zeros_like(seen.direction_rad)
    along = np.stack([np.cos(seen.direction_rad), np.sin(seen.direction_rad), zero], axis=-1)
    normal = np.einsum("nji,nj->ni", image, np.cross(along, to_line))
    focal = np.stack([lens.fx_px * np.exp(seen.log_focal), lens.fy_px * np.exp(seen.log_focal)], axis=-1)[
        :, None
    ]
    flat = (ends_px - (lens.cx_px, lens.cy_px)) / focal
    radius2 = (flat**2).sum(axis=-1, keepdims=True)
    flat = flat * (1.0 + seen.bend[:, None, None] * radius2)
    apart = np.einsum("nei,ni->ne", flat, normal[:, :2]) + normal[:, 2:]
    steep = np.hypot(normal[:, 0] / focal[:, 0, 0], normal[:, 1] / focal[:, 0, 1])
    result: Matrix = apart / steep[:, None]
    return result


_IMAGE_TO_BODY = Mount().body_from_image()


def _heading(yaw_rad: Matrix) -> Matrix:
    c, s, zero = np.cos(yaw_rad), np.sin(yaw_rad), np.zeros_like(yaw_rad)
    return _rotation([[c, -s, zero], [s, c, zero], [zero, zero, zero + 1.0]])


def _tilt(roll_rad: Matrix, pitch_rad: Matrix) -> Matrix:
    cr, sr, cp, sp = np.cos(roll_rad), np.sin(roll_rad), np.cos(pitch_rad), np.sin(pitch_rad)
    zero = np.zeros_like(cr)
    return _rotation([[cp, sp * sr, sp * cr], [zero, cr, -sr], [-sp, cp * sr, cp * cr]])


def _rotation(rows: list[list[Matrix]]) -> Matrix:
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
