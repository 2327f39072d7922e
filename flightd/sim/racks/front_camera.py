"""The simulated front camera: its optics, its timing, and how sharp its picture is."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from flightd.core.camera_view import CameraView, ForwardMount, Viewpoint
from flightd.core.geometry import Lens
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.sensors.optics import moved, viewpoint


def front_lens(width_px: int = 1280, height_px: int = 800, focal_px: float = 1000.0) -> Lens:
    """A lens without distortion, principal point in the middle: 65° across by default, which at 1.2 m is
    1.54 m of a shelf at 0.83 pixels to the millimetre."""
    return Lens(width_px, height_px, focal_px, focal_px, (width_px - 1) / 2, (height_px - 1) / 2)


@dataclass(frozen=True, slots=True)
class FrontCamera:
    """A forward camera.  A frame reaches the daemon `capture_delay_s` after mid-exposure, and up to
    `jitter_s` later.  `focus_m` is in focus; `aperture_m` is the lens's opening, which blurs the rest."""

    lens: Lens = field(default_factory=front_lens)
    mount: ForwardMount = field(default_factory=ForwardMount)
    fps: float = 4.0
    exposure_s: float = 0.002
    capture_delay_s: float = 0.080
    jitter_s: float = 0.005
    focus_m: float = 1.2
    aperture_m: float = 0.0015

    def __post_init__(self) -> None:
        if not 0.0 < self.exposure_s <= 1.0 / self.fps:
            raise ValueError(f"exposure {self.exposure_s} s does not fit {self.fps} frames a second")

    def view(self, kinematics: Kinematics) -> CameraView:
        return CameraView(self.lens, viewpoint(kinematics, self.mount))

    def smear_px(self, kinematics: Kinematics, distance_m: float) -> tuple[float, float]:
        """How far (right, down) what is `distance_m` ahead in the picture's middle moves during the
        exposure."""
        half_s = self.exposure_s / 2
        start, end = (self.view(moved(kinematics, sign * half_s)) for sign in (-1.0, 1.0))
        ahead = _ahead(start.viewpoint, distance_m)[None, :]
        ((u0, v0),), ((u1, v1),) = start.project_ideal(ahead), end.project_ideal(ahead)
        shift = float(u1 - u0), float(v1 - v0)
        return shift if all(map(math.isfinite, shift)) else (0.0, 0.0)

    def defocus_px(self, distance_m: float) -> float:
        """Sigma of the blur at a distance: half the circle of confusion of a thin lens."""
        return self.lens.fx_px * self.aperture_m * abs(1.0 / distance_m - 1.0 / self.focus_m) / 2


def _ahead(view: Viewpoint, distance_m: float) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """The map point that far along the optical axis."""
    x, y, down = view.map_from_image[:, 2] * distance_m
    return np.array([view.x_m + x, view.y_m + y, view.height_m - down])
