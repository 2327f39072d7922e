"""Frames of reference and the down camera.

Body: x forward, y right, z down.  Level: body with roll and pitch taken out, same heading, origin at
the body.  Image: x right, y down; an unrotated down camera has image up = body forward and image
right = body right.  Ground lines use the image's convention in metres: right * cos(theta) -
forward * sin(theta) = rho, so a level, unrotated camera's line keeps its theta and its rho only scales.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Matrix: TypeAlias = NDArray[np.float64]

GRAVITY_MPS2 = 9.80665
"""Standard gravity (ISO 80000-3)."""

_IMAGE_TO_BODY = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""Image axes (right, down, optical axis) to body axes (forward, right, down)."""


def wrap_pi(angle_rad: float) -> float:
    """The same angle in [-pi, pi)."""
    return (angle_rad + math.pi) % math.tau - math.pi


def wrap_half_pi(angle_rad: float) -> float:
    """The same undirected line angle in [-pi/2, pi/2)."""
    return (angle_rad + math.pi / 2) % math.pi - math.pi / 2


def normalise_line(rho: float, theta_rad: float) -> tuple[float, float]:
    """The same line with theta in [0, pi) and rho signed accordingly."""
    turns = math.floor(theta_rad / math.pi)
    theta = theta_rad - turns * math.pi
    if theta >= math.pi:  # rounding of a tiny negative angle
        theta, turns = 0.0, turns + 1
    return (-rho if turns % 2 else rho), theta


def level_from_body(roll_rad: float, pitch_rad: float) -> Matrix:
    """(3, 3) rotation that takes body vectors to the level frame (yaw stays)."""
    cr, sr = math.cos(roll_rad), math.sin(roll_rad)
    cp, sp = math.cos(pitch_rad), math.sin(pitch_rad)
    return np.array([[cp, sp * sr, sp * cr], [0.0, cr, -sr], [-sp, cp * sr, cp * cr]])


def heading_rotation(yaw_rad: float) -> Matrix:
    """(3, 3) rotation that takes level vectors to the map frame; yaw clockwise seen from above."""
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def angle_rates(
    roll_rad: float, pitch_rad: float, body_radps: tuple[float, float, float]
) -> tuple[float, float, float]:
    """Rates of yaw, roll and pitch (rad/s) from the body's rates about its x, y and z axes."""
    (about_x, about_y, about_z), sin, cos = body_radps, math.sin(roll_rad), math.cos(roll_rad)
    yaw = (about_y * sin + about_z * cos) / math.cos(pitch_rad)
    return yaw, about_x + yaw * math.sin(pitch_rad), about_y * cos - about_z * sin


def quaternion_of(rotation: Matrix) -> tuple[float, float, float, float]:
    """The unit quaternion x y z w of a (3, 3) rotation, w not negative (Shepperd, 1978: from the largest
    of the four, so that no division is by little)."""
    (m00, m01, m02), (m10, m11, m12), (m20, m21, m22) = rotation.tolist()
    rows = (
        (1.0 + m00 - m11 - m22, m10 + m01, m20 + m02, m21 - m12),
        (m10 + m01, 1.0 - m00 + m11 - m22, m21 + m12, m02 - m20),
        (m20 + m02, m21 + m12, 1.0 - m00 - m11 + m22, m10 - m01),
        (m21 - m12, m02 - m20, m10 - m01, 1.0 + m00 + m11 + m22),
    )
    largest = max(range(4), key=lambda i: rows[i][i])
    length = math.copysign(math.hypot(*rows[largest]), rows[largest][3])
    x, y, z, w = (value / length for value in rows[largest])
    return x, y, z, w


@dataclass(frozen=True, slots=True)
class Lens:
    """Pinhole with Brown-Conrady distortion (OpenCV's order k1 k2 p1 p2 k3); pixels, centres at integers."""

    width_px: int
    height_px: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)

    @property
    def centre_px(self) -> tuple[float, float]:
        """Origin of rho: the middle of the picture, not the principal point."""
        return (self.width_px - 1) / 2, (self.height_px - 1) / 2

    @property
    def is_distorted(self) -> bool:
        return any(self.distortion)

    def matrix(self) -> Matrix:
        return np.array([[self.fx_px, 0.0, self.cx_px], [0.0, self.fy_px, self.cy_px], [0.0, 0.0, 1.0]])

    def longer_by(self, factor: float) -> Lens:
        """The same lens with a focal length that is that many times as long."""
        return replace(self, fx_px=self.fx_px * factor, fy_px=self.fy_px * factor)

    def scaled(self, width_px: int, height_px: int) -> Lens:
        """The same lens read out at another resolution of the same field of view."""
        sx, sy = width_px / self.width_px, height_px / self.height_px
        return Lens(
            width_px,
            height_px,
            self.fx_px * sx,
            self.fy_px * sy,
            (self.cx_px + 0.5) * sx - 0.5,
            (self.cy_px + 0.5) * sy - 0.5,
            self.distortion,
        )


@dataclass(frozen=True, slots=True)
class Mount:
    """How the down camera sits in the body: turned by `yaw_rad` (clockwise from above), then rolled and
    pitched as the body is (right side down, nose up), its centre at `offset_m` (forward, right, down) from
    the point whose height the vehicle reports."""

    yaw_rad: float = 0.0
    offset_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    roll_rad: float = 0.0
    pitch_rad: float = 0.0

    def body_from_image(self) -> Matrix:
        """(3, 3) rotation from image axes (right, down, optical) to body axes."""
        tilt = level_from_body(self.roll_rad, self.pitch_rad)
        rotation: Matrix = tilt @ heading_rotation(self.yaw_rad) @ _IMAGE_TO_BODY
        return rotation


def ground_homography(lens: Lens, mount: Mount, roll_rad: float, pitch_rad: float) -> Matrix:
    """(3, 3) H with pixel ~ H (forward, right, 1): the floor at unit distance below the *camera*, axes
    of the level frame.  A homogeneous image line maps to the ground by l' = H.T @ l."""
    level_from_image = level_from_body(roll_rad, pitch_rad) @ mount.body_from_image()
    homography: Matrix = lens.matrix() @ level_from_image.T
    return homography
