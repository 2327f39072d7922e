"""The simulated down camera: where each pixel looks on the floor, and how far the picture smears."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TypeAlias, TypeVar, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.camera_view import AnyMount, Viewpoint
from flightd.core.distortion import undistorted
from flightd.core.geometry import Lens, Matrix, Mount
from flightd.core.types import Image
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.sensors.vibration import STILL, Vibration

Floats: TypeAlias = NDArray[np.float32]
Cells = TypeVar("Cells", NDArray[np.float32], NDArray[np.uint8])

CELL_PX = 8
"""The pixel-to-floor map is exact at the middle of each cell and interpolated between: at 45° of tilt
the error stays below 0.05 px."""
MIN_HEIGHT_M = 0.02
"""A camera standing on the floor still looks from somewhere."""
MIN_SLOPE = 0.08
"""Rays that hardly go down are bent to this (down per unit of ray), so that the horizon stays finite."""

_MOMENTS = 24
"""Of an exposure as it is configured, of a longer one more: what vibration sweeps is left without gaps."""


def wide_lens(width_px: int = 640, height_px: int = 360, hfov_rad: float = math.radians(80.0)) -> Lens:
    """A cheap 80° lens with mild barrel distortion, principal point in the middle."""
    focal_px = width_px / 2 / math.tan(hfov_rad / 2)
    centre = ((width_px - 1) / 2, (height_px - 1) / 2)
    return Lens(width_px, height_px, focal_px, focal_px, *centre, (-0.05, 0.01, 0.0, 0.0, 0.0))


@dataclass(frozen=True, slots=True)
class SimCamera:
    """A down camera: its optics and its timing.  A frame reaches the daemon `capture_delay_s` after
    mid-exposure of the middle row, and up to `jitter_s` later, drawn evenly; the rows are exposed one after
    the other within `readout_s`.  The motors shake it on its mount by the `vibration`."""

    lens: Lens = field(default_factory=wide_lens)
    mount: Mount = field(default_factory=Mount)
    fps: float = 30.0
    exposure_s: float = 0.004
    capture_delay_s: float = 0.060
    jitter_s: float = 0.003
    readout_s: float = 0.0
    vibration: Vibration = STILL

    def __post_init__(self) -> None:
        if not 0.0 < self.exposure_s <= 1.0 / self.fps:
            raise ValueError(f"exposure {self.exposure_s} s does not fit {self.fps} frames a second")

    def turned_rad(self, stamp_ns: int, after_s: Matrix, over_s: float = 0.0) -> Matrix:
        """By what vibration turns it about its own axes (right, down, optical), (3, ...), so long (...) after
        `stamp_ns`, on average over an exposure of `over_s`."""
        roll_rad, pitch_rad = self.vibration.angles_rad(stamp_ns * 1e-9 + after_s, over_s)
        body_rad = np.stack([roll_rad, pitch_rad, np.zeros_like(roll_rad)])
        turned: Matrix = np.tensordot(self.mount.body_from_image().T, body_rad, axes=1)
        return turned


def floor_viewpoint(kinematics: Kinematics, mount: Mount) -> Viewpoint:
    """The down camera's pose for a pose of the airframe, never below `MIN_HEIGHT_M`."""
    view = viewpoint(kinematics, mount)
    return replace(view, height_m=max(view.height_m, MIN_HEIGHT_M))


def viewpoint(kinematics: Kinematics, mount: AnyMount) -> Viewpoint:
    """A camera's pose for a pose of the airframe."""
    k = kinematics
    return Viewpoint.at(k.x_m, k.y_m, k.height_m, k.roll_rad, k.pitch_rad, k.yaw_rad, mount)


class RayTable:
    """Ideal ray of each cell of the picture, the lens's distortion taken out once and for all."""

    def __init__(self, lens: Lens) -> None:
        self._lens = lens
        columns, rows = -(-lens.width_px // CELL_PX) + 2, -(-lens.height_px // CELL_PX) + 2
        # cv2.resize puts cell i over the pixels around CELL_PX * i + (CELL_PX - 1) / 2; one cell of margin
        u = (np.arange(columns) - 1) * CELL_PX + (CELL_PX - 1) / 2
        v = (np.arange(rows) - 1) * CELL_PX + (CELL_PX - 1) / 2
        grid = np.stack(np.meshgrid((u - lens.cx_px) / lens.fx_px, (v - lens.cy_px) / lens.fy_px))
        self._rays: Floats = undistorted(grid, lens).astype(np.float32)
        self.late: Matrix = np.clip((np.arange(rows) - 0.5) * CELL_PX / lens.height_px, 0.0, 1.0)
        """(rows,) which part of the read-out has passed at each row of cells."""
        self._padded = np.empty((rows * CELL_PX, columns * CELL_PX, 2), np.float32)

    def turned(self, by_rad: Matrix) -> Floats:
        """(2, rows, columns) the rays where the camera is turned by (3, rows) small angles about its axes,
        each row of cells by its own."""
        right, down = self._rays
        about_right, about_down, about_optical = by_rad.astype(np.float32)[..., None]
        depth = 1.0 + about_right * down - about_down * right
        turned: Floats = np.stack(
            [
                (right + about_down - about_optical * down) / depth,
                (down + about_optical * right - about_right) / depth,
            ]
        )
        return turned

    def floor(self, view: Viewpoint, rays: Floats | None = None) -> tuple[Floats, Floats]:
        """Floor points (x_m, y_m relative to the camera's foot) under the cells, each (rows, columns); `rays`
        are those that `turned` has, None: the camera sits still."""
        a = view.map_from_image.astype(np.float32)
        right, down = self._rays if rays is None else rays
        depth = a[2, 0] * right + a[2, 1] * down + a[2, 2]
        scale = np.float32(view.height_m) / np.maximum(depth, np.float32(MIN_SLOPE))
        x = (a[0, 0] * right + a[0, 1] * down + a[0, 2]) * scale
        y = (a[1, 0] * right + a[1, 1] * down + a[1, 2]) * scale
        return x, y

    def rolled(
        self, view: Viewpoint, first: Viewpoint, last: Viewpoint, rays: Floats | None = None
    ) -> tuple[Floats, Floats]:
        """As `floor`, relative to the foot of `view`, where each row has its own time: the uppermost
        looks from `first`, the lowest from `last`."""
        late = self.late.astype(np.float32)[:, None]
        (x0, y0), (x1, y1) = self.floor(first, rays), self.floor(last, rays)
        x0, x1 = x0 + np.float32(first.x_m - view.x_m), x1 + np.float32(last.x_m - view.x_m)
        y0, y1 = y0 + np.float32(first.y_m - view.y_m), y1 + np.float32(last.y_m - view.y_m)
        return x0 + late * (x1 - x0), y0 + late * (y1 - y0)

    def to_pixels(self, cells: Cells) -> Cells:
        """Cells interpolated to all pixels, (H, W, channels); of two channels it is a view that the next
        such call overwrites."""
        size = (self._padded.shape[1], self._padded.shape[0])
        target = self._padded if cells.shape[2:] == (2,) else None
        full = cv2.resize(cells, size, dst=target, interpolation=cv2.INTER_LINEAR)
        stop = (CELL_PX + self._lens.height_px, CELL_PX + self._lens.width_px)
        return cast("Cells", full[CELL_PX : stop[0], CELL_PX : stop[1]])

    def footprint_m(self, view: Viewpoint) -> float:
        """Metres of floor that the pixel in the middle covers, the smaller way."""
        depth = max(float(view.map_from_image[2, 2]), MIN_SLOPE)
        return view.height_m / depth / max(self._lens.fx_px, self._lens.fy_px)


def smear_px(camera: SimCamera, kinematics: Kinematics) -> tuple[float, float]:
    """How far (right, down) the picture's middle moves during the exposure, in pixels."""
    half_s = camera.exposure_s / 2
    before, after = (moved(kinematics, sign * half_s) for sign in (-1.0, 1.0))
    start, end = floor_viewpoint(before, camera.mount), floor_viewpoint(after, camera.mount)
    axis = start.map_from_image[:, 2]
    reach = start.height_m / max(float(axis[2]), MIN_SLOPE)
    point = np.array([start.x_m - end.x_m, start.y_m - end.y_m, end.height_m - start.height_m]) + axis * reach
    right, down, depth = end.map_from_image.T @ point
    return camera.lens.fx_px * float(right / depth), camera.lens.fy_px * float(down / depth)


def vibration_px(camera: SimCamera, stamp_ns: int, exposure: float, strips: int) -> Matrix:
    """(strips, moments, 2) how far (right, down) vibration moves what each of as many equal strips of rows
    shows in the picture's middle, from its place on average and in the course of its exposure; `exposure` as
    in `Taking`."""
    count = math.ceil(_MOMENTS * max(exposure, 1.0))
    moments = ((np.arange(count) + 0.5) / count - 0.5) * exposure * camera.exposure_s
    rows = ((np.arange(strips) + 0.5) / strips - 0.5) * camera.readout_s
    about_right, about_down, _ = camera.turned_rad(stamp_ns, rows[:, None] + moments)
    moved_px = np.stack([-camera.lens.fx_px * about_down, camera.lens.fy_px * about_right], axis=-1)
    swept: Matrix = moved_px - moved_px.mean(axis=1, keepdims=True)
    return swept


def moved(k: Kinematics, dt_s: float) -> Kinematics:
    """The pose `dt_s` later at constant rates (small angles: body rates stand for angle rates)."""
    return replace(
        k,
        x_m=k.x_m + k.vx_mps * dt_s,
        y_m=k.y_m + k.vy_mps * dt_s,
        height_m=k.height_m + k.climb_mps * dt_s,
        roll_rad=k.roll_rad + k.roll_rate_radps * dt_s,
        pitch_rad=k.pitch_rad + k.pitch_rate_radps * dt_s,
        yaw_rad=k.yaw_rad + k.yaw_rate_radps * dt_s,
    )


@dataclass(frozen=True, slots=True)
class Taking:
    """How a picture is taken: with which parts of the camera's usual exposure and gain, and the light of the
    lamp beside it, 1 m away, as a part of the usual one."""

    exposure: float = 1.0
    gain: float = 1.0
    lamp: float = 0.0


USUALLY = Taking()


def picture_for(lens: Lens, out: Image | None = None) -> Image:
    """Where a camera with this lens draws its picture: `out`, or a new one.  ValueError where `out` does
    not fit."""
    picture = np.empty((lens.height_px, lens.width_px, 3), np.uint8) if out is None else out
    if picture.shape != (lens.height_px, lens.width_px, 3) or picture.dtype != np.uint8:
        raise ValueError(
            f"out is {picture.shape} {picture.dtype}, the camera makes {lens.width_px}x{lens.height_px}"
        )
    return picture
