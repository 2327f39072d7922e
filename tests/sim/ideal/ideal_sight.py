"""Perfect sight: the lines and junctions that a camera would see of the map, computed instead of rendered.

For tests and studies of everything behind the pixels: tracking, localisation, mission and control fly
by these lines a hundred times faster than by pictures.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass

import numpy as np

from flightd.core.geometry import Lens, Mount, heading_rotation, level_from_body, normalise_line
from flightd.core.types import Junction, JunctionKind, Line, LineSet, MarkerSight, PadSight
from flightd.sim.plant.kinematics import Kinematics
from flightd.site.painted_lines import ARM_DIRECTIONS, PaintMap
from flightd.site.site import Pad, PadSign, PaintedLine, Site

_SAMPLES = 120
_MIN_SPAN_PX = 30.0
_BORDER_PX = 5.0
_ARM_M = 0.1
_GRAZING = 0.05
_MARGIN_M = 0.01
_KINDS = {1: JunctionKind.END, 2: JunctionKind.CORNER, 3: JunctionKind.TEE, 4: JunctionKind.CROSS}


@dataclass(frozen=True, slots=True)
class EyeErrors:
    """Errors added to each line (standard deviations), and the share of lines that are overlooked."""

    rho_px: float = 0.15
    theta_rad: float = 0.0005
    missed: float = 0.0
    pad_px: float = 1.5


@dataclass(frozen=True, slots=True)
class EyeView:
    """Where the camera is in one picture: (3, 3) map axes to image axes, (3,) its place on the map, in m."""

    lens: Lens
    image_from_map: np.ndarray
    eye: np.ndarray

    def pixel(self, x_m: float, y_m: float) -> tuple[float, float] | None:
        """Centred image coordinates of a point of the floor, None near or beyond the border."""
        lens = self.lens
        a, b, c = (self.image_from_map @ (np.array([x_m, y_m, 0.0]) - self.eye)).tolist()
        if c < 0.05:
            return None
        (cu, cv) = lens.centre_px
        u, v = lens.fx_px * a / c + lens.cx_px - cu, lens.fy_px * b / c + lens.cy_px - cv
        return (u, v) if abs(u) < cu - _BORDER_PX and abs(v) < cv - _BORDER_PX else None

    def floor(self, across: float, down: float) -> tuple[float, float] | None:
        """The point of the floor (m on the map) seen at such shares of the picture, None at the horizon."""
        lens = self.lens
        u = (across * (lens.width_px - 1) - lens.cx_px) / lens.fx_px
        v = (down * (lens.height_px - 1) - lens.cy_px) / lens.fy_px
        ray = self.image_from_map.T @ np.array([u, v, 1.0])
        if ray[2] <= _GRAZING:
            return None
        x_m, y_m = (self.eye - self.eye[2] / ray[2] * ray)[:2].tolist()
        return x_m, y_m


class IdealEye:
    """Sees the painted lines of a site from a pose; the same seed makes the same errors."""

    def __init__(
        self, site: Site, lens: Lens, mount: Mount, errors: EyeErrors | None = None, seed: int = 0
    ) -> None:
        self._site = site
        self._lens = lens
        self._mount = mount
        self._errors = errors or EyeErrors()
        self._random = random.Random(f"eye {seed}")
        u = (np.array([0.0, 0.0, 1.0, 1.0]) * (lens.width_px - 1) - lens.cx_px) / lens.fx_px
        v = (np.array([0.0, 1.0, 0.0, 1.0]) * (lens.height_px - 1) - lens.cy_px) / lens.fy_px
        self._corners = np.stack([u, v, np.ones(4)])
        paint = PaintMap.of(site)
        self._floors = [_samples(painted) for painted in site.lines]
        self._features = [
            (float(x), float(y), int(arms))
            for features in (paint.crossings, paint.ends)
            for (x, y), arms in zip(features.at_m, features.arms, strict=True)
        ]

    def view(self, pose: Kinematics) -> EyeView:
        """Of the picture exposed at `pose`."""
        map_from_body = heading_rotation(pose.yaw_rad) @ level_from_body(pose.roll_rad, pose.pitch_rad)
        image_from_map = (map_from_body @ self._mount.body_from_image()).T
        eye = np.array([pose.x_m, pose.y_m, -pose.height_m]) + map_from_body @ np.array(self._mount.offset_m)
        return EyeView(self._lens, image_from_map, eye)

    def see(self, pose: Kinematics, seq: int, stamp_ns: int) -> LineSet:
        """The lines in the picture exposed at `pose`, in pixels of a distortion-free camera."""
        view = self.view(pose)
        image_from_map, eye = view.image_from_map, view.eye
        reach_m = self._reach_m(image_from_map, eye)
        near = (
            (painted, floor)
            for painted, floor in zip(self._site.lines, self._floors, strict=True)
            if _distance_m(painted, float(eye[0]), float(eye[1])) <= reach_m
        )
        seen = (self._line(painted, floor, image_from_map, eye) for painted, floor in near)
        lines = tuple(
            line for line in seen if line is not None and self._random.random() >= self._errors.missed
        )
        lens = self._lens
        junctions = self._junctions(view, reach_m)
        mats = [pad for pad in self._site.pads if pad.sign is PadSign.MAT]
        pads = tuple(pad for pad in (self._pad(pad, image_from_map, eye) for pad in mats) if pad)
        markers = tuple(
            MarkerSight(marker.id, *square)
            for marker in self._site.markers
            if (square := self._square(marker.x_m, marker.y_m, marker.size_m, image_from_map, eye))
        )
        return LineSet(
            seq,
            stamp_ns,
            lens.width_px,
            lens.height_px,
            lines,
            junctions,
            "ideal",
            pads=pads,
            markers=markers,
        )

    def _pad(self, pad: Pad, image_from_map: np.ndarray, eye: np.ndarray) -> PadSight | None:
        """The pad, if its whole square is in the picture."""
        seen = self._square(*self._site.pad_centre(pad), pad.size_m, image_from_map, eye)
        return PadSight(*seen, 1.0) if seen else None

    def _square(
        self, x_m: float, y_m: float, size_m: float, image_from_map: np.ndarray, eye: np.ndarray
    ) -> tuple[float, float, float] | None:
        """Centre and mean side of a square on the floor, in pixels, if it is wholly in the picture."""
        lens, half = self._lens, size_m / 2
        corners = np.array([[-1, 1, 1, -1, 0], [-1, -1, 1, 1, 0], [0, 0, 0, 0, 0]]) * half
        rays = image_from_map @ (corners + np.array([[x_m], [y_m], [0.0]]) - eye[:, None])
        if (rays[2] <= 0.05).any():
            return None
        u, v = lens.fx_px * rays[0] / rays[2] + lens.cx_px, lens.fy_px * rays[1] / rays[2] + lens.cy_px
        if u.min() < 0 or v.min() < 0 or u.max() > lens.width_px - 1 or v.max() > lens.height_px - 1:
            return None
        sides = np.hypot(np.diff(u[[0, 1, 2, 3, 0]]), np.diff(v[[0, 1, 2, 3, 0]]))
        blur = self._errors.pad_px
        x_px, y_px = u[4] - lens.centre_px[0], v[4] - lens.centre_px[1]
        return (
            float(x_px) + self._random.gauss(0.0, blur),
            float(y_px) + self._random.gauss(0.0, blur),
            float(sides.mean()),
        )

    def _reach_m(self, image_from_map: np.ndarray, eye: np.ndarray) -> float:
        """How far from the point below the camera the picture reaches at most; infinite if to the horizon."""
        corners = image_from_map.T @ self._corners
        if (corners[2] <= _GRAZING).any():
            return math.inf
        return float((-eye[2] * np.hypot(corners[0], corners[1]) / corners[2]).max()) + _MARGIN_M

    def _junctions(self, view: EyeView, reach_m: float) -> tuple[Junction, ...]:
        """The crossings and ends in the picture, a little away from its border."""
        found = []
        eye_x, eye_y = float(view.eye[0]), float(view.eye[1])
        for x, y, arms in self._features:
            if math.hypot(x - eye_x, y - eye_y) > reach_m:
                continue
            here = view.pixel(x, y)
            if here is None:
                continue
            tips = [
                view.pixel(x + _ARM_M * dx, y + _ARM_M * dy)
                for bit, (dx, dy) in enumerate(ARM_DIRECTIONS)
                if arms >> bit & 1
            ]
            angles = tuple(math.atan2(tip[1] - here[1], tip[0] - here[0]) for tip in tips if tip is not None)
            if len(angles) == len(tips):
                found.append(Junction(_KINDS[len(angles)], here[0], here[1], angles))
        return tuple(found)

    def _line(
        self, painted: PaintedLine, floor: np.ndarray, image_from_map: np.ndarray, eye: np.ndarray
    ) -> Line | None:
        lens = self._lens
        rays = image_from_map @ (floor - eye[:, None])
        with np.errstate(divide="ignore", invalid="ignore"):
            u = lens.fx_px * rays[0] / rays[2] + lens.cx_px
            v = lens.fy_px * rays[1] / rays[2] + lens.cy_px
        inside = (rays[2] > 0.05) & (u >= 0) & (v >= 0) & (u <= lens.width_px - 1) & (v <= lens.height_px - 1)
        found = np.flatnonzero(inside)
        if len(found) < 2:
            return None
        centre_u, centre_v = lens.centre_px
        a, b = found[0], found[-1]
        u0, v0 = float(u[a]) - centre_u, float(v[a]) - centre_v
        u1, v1 = float(u[b]) - centre_u, float(v[b]) - centre_v
        span = math.hypot(u1 - u0, v1 - v0)
        if span < _MIN_SPAN_PX:
            return None
        theta = math.atan2(u1 - u0, -(v1 - v0))
        errors = self._errors
        rho = u0 * math.cos(theta) + v0 * math.sin(theta) + self._random.gauss(0.0, errors.rho_px)
        rho, theta = normalise_line(rho, theta + self._random.gauss(0.0, errors.theta_rad))
        along = sorted(-math.sin(theta) * x + math.cos(theta) * y for x, y in ((u0, v0), (u1, v1)))
        width = painted.width_m * lens.fx_px / float(rays[2][(a + b) // 2])
        return Line(rho, theta, width, along[0], along[1], 1.0, errors.rho_px, errors.theta_rad)


def _samples(painted: PaintedLine) -> np.ndarray:
    """Points along a line's middle, (3, N) metres on the map."""
    share = np.linspace(0.0, 1.0, _SAMPLES)
    return np.stack(
        [
            painted.x0_m + share * (painted.x1_m - painted.x0_m),
            painted.y0_m + share * (painted.y1_m - painted.y0_m),
            np.zeros(_SAMPLES),
        ]
    )


def _distance_m(painted: PaintedLine, x_m: float, y_m: float) -> float:
    """From a point to the nearest of a line's middle."""
    dx, dy = painted.x1_m - painted.x0_m, painted.y1_m - painted.y0_m
    length2 = dx * dx + dy * dy
    share = ((x_m - painted.x0_m) * dx + (y_m - painted.y0_m) * dy) / length2 if length2 else 0.0
    share = min(max(share, 0.0), 1.0)
    return math.hypot(x_m - painted.x0_m - share * dx, y_m - painted.y0_m - share * dy)
