"""A camera in the map frame: what it sees where, and which point of a shelf front a pixel shows.

Map points are (x, y, height): x along the aisles, y to the right of x seen from above, height above the
floor.  Pixels are picture coordinates, x right, y down, centres at integers, origin at the first pixel
(`CodeRead.corners_px` counts from the picture's middle: add `Lens.centre_px`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from flightd.core.distortion import distorted, undistorted
from flightd.core.geometry import Lens, Matrix, heading_rotation, level_from_body

_FORWARD_TO_BODY = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""Axes of a camera that looks along the nose (right, down, optical axis) to body axes."""
_LEAST_DEPTH_M = 0.01
"""Points nearer to the camera's plane than this, or behind it, are not seen."""
_LEAST_SLOPE = 1e-6
"""Rays that run so nearly along a shelf front (across per unit of ray) meet it nowhere of use."""


@dataclass(frozen=True, slots=True)
class FloorReach:
    """How far a down camera surely sees the floor along the drone's nose and across it, from straight
    below, for each metre of height."""

    ahead: float = 0.28
    aside: float = 0.28


class AnyMount(Protocol):
    """How a camera sits in the body."""

    @property
    def offset_m(self) -> tuple[float, float, float]: ...

    def body_from_image(self) -> Matrix: ...


@dataclass(frozen=True, slots=True)
class ForwardMount:
    """A camera that looks along the nose, turned by `yaw_rad` (clockwise from above: pi/2 looks to the
    right) and then raised by `pitch_rad` (+ up); its centre is at `offset_m` (forward, right, down) from
    the point whose height the vehicle reports."""

    yaw_rad: float = 0.0
    pitch_rad: float = 0.0
    offset_m: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def body_from_image(self) -> Matrix:
        """(3, 3) rotation from image axes (right, down, optical) to body axes."""
        rotation: Matrix = (
            heading_rotation(self.yaw_rad) @ level_from_body(0.0, self.pitch_rad) @ _FORWARD_TO_BODY
        )
        return rotation


@dataclass(frozen=True, slots=True)
class Viewpoint:
    """Where the camera's centre is in the map frame, and the rotation from image axes (right, down,
    optical) to map axes (x, y, down)."""

    x_m: float
    y_m: float
    height_m: float
    map_from_image: Matrix

    @classmethod
    def at(
        cls,
        x_m: float,
        y_m: float,
        height_m: float,
        roll_rad: float,
        pitch_rad: float,
        yaw_rad: float,
        mount: AnyMount,
    ) -> Viewpoint:
        """The camera's pose for a pose of the body; yaw clockwise from the map's x, signs as in
        `core.geometry`."""
        map_from_body = heading_rotation(yaw_rad) @ level_from_body(roll_rad, pitch_rad)
        dx, dy, down = map_from_body @ np.array(mount.offset_m)
        return cls(
            x_m + float(dx), y_m + float(dy), height_m - float(down), map_from_body @ mount.body_from_image()
        )


@dataclass(frozen=True, slots=True)
class CameraView:
    """One camera at one viewpoint."""

    lens: Lens
    viewpoint: Viewpoint

    def project(self, points_m: Matrix) -> Matrix:
        """(N, 2) pixels at which the real, distorting lens shows (N, 3) map points; NaN for points that
        it cannot see (behind, or beyond the lens's widest angle), outside the picture they go on."""
        lens = self.lens
        seen = distorted(self._normalised(points_m), lens)
        return _to_pixels(seen, lens)

    def project_ideal(self, points_m: Matrix) -> Matrix:
        """(N, 2) pixels of a distortion-free camera with the same focal length; NaN behind the camera."""
        return _to_pixels(self._normalised(points_m), self.lens)

    def rays(self, pixels: Matrix) -> Matrix:
        """(N, 3) directions (x, y, down) in which (N, 2) pixels of the real lens look, one unit along the
        optical axis each.  ValueError for pixels that the lens cannot show."""
        lens = self.lens
        seen = (pixels - (lens.cx_px, lens.cy_px)) / (lens.fx_px, lens.fy_px)
        ideal = undistorted(np.ascontiguousarray(seen.T, np.float64), lens)
        along = np.vstack([ideal, np.ones((1, ideal.shape[1]))])
        directions: Matrix = (self.viewpoint.map_from_image @ along).T
        return directions

    def onto_shelf(self, pixels: Matrix, y_m: float) -> Matrix:
        """(N, 2) points (x, height) of the vertical plane at `y_m` that (N, 2) pixels of the real lens
        show; NaN where the ray runs along the plane or away from it."""
        view = self.viewpoint
        x, y, down = self.rays(pixels).T
        reach = (y_m - view.y_m) / np.where(np.abs(y) > _LEAST_SLOPE, y, np.nan)
        reach = np.where(reach > 0.0, reach, np.nan)
        return np.stack([view.x_m + reach * x, view.height_m - reach * down], axis=-1)

    def _normalised(self, points_m: Matrix) -> Matrix:
        """(2, N) ideal image points at focal length 1."""
        view = self.viewpoint
        away = np.asarray(points_m, np.float64) - (view.x_m, view.y_m, view.height_m)
        right, down, depth = view.map_from_image.T @ (away * (1.0, 1.0, -1.0)).T
        depth = np.where(depth > _LEAST_DEPTH_M, depth, np.nan)
        return np.stack([right / depth, down / depth])


def _to_pixels(normalised: Matrix, lens: Lens) -> Matrix:
    return np.stack(
        [normalised[0] * lens.fx_px + lens.cx_px, normalised[1] * lens.fy_px + lens.cy_px], axis=-1
    )
