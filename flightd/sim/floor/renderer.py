"""Pictures of the down camera: the painted floor through the lens, from where the airframe is.

One picture is a look-up of floor tiles along the pixels' rays, then the smear of the exposure, then
light that depends on the picture (vignetting, mirrored lamps, the drone's own shadow) and noise.
`core.geometry` defines where each floor point must appear.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.core.camera_view import Viewpoint
from flightd.core.types import Image
from flightd.sim.appearance import DEFAULT, Appearance
from flightd.sim.floor.floor import Floor
from flightd.sim.floor.lighting import Lighting
from flightd.sim.floor.paint_damage import UNDAMAGED, PaintDamage
from flightd.sim.floor.tiles import Ahead, TiledFloor
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.sensors.camera_effects import Sensor, blur_kernel, blur_vibrating
from flightd.sim.sensors.optics import (
    USUALLY,
    Floats,
    RayTable,
    SimCamera,
    Taking,
    floor_viewpoint,
    moved,
    picture_for,
    smear_px,
    vibration_px,
)
from flightd.site.site import Site

__all__ = ["Appearance", "Renderer", "SimCamera"]

_AHEAD_S = 0.8
"""How far ahead of the view the floor is painted: long enough for a row of tiles, one to a picture."""
_STRIPS = 9
"""Of a picture, each blurred by its own way: one is read out in less time than it is usually exposed."""
_SHADOW_HALF_M = 0.18
_SHADOW_FADES_M = 0.9
"""Height at which the airframe's shadow below itself has lost most of its depth."""


class Renderer:
    """Renders what one camera sees in one warehouse.

    A picture depends on the site, the camera, the appearance, the seed, the pose and `seq` alone, not
    on what was rendered before.  Not for use from several threads at once."""

    def __init__(
        self,
        site: Site,
        camera: SimCamera,
        appearance: Appearance = DEFAULT,
        seed: int = 0,
        damage: PaintDamage = UNDAMAGED,
    ) -> None:
        self._camera = camera
        self._look = appearance
        self._rays = RayTable(camera.lens)
        self._lighting = Lighting(site, appearance, seed)
        self._tiles = TiledFloor(Floor(site, appearance, self._lighting, seed, damage))
        self._sensor = Sensor(camera.lens, appearance, seed)

    def render(
        self, kinematics: Kinematics, seq: int, out: Image | None = None, how: Taking = USUALLY
    ) -> Image:
        """(H, W, 3) BGR picture of the exposure whose middle is `kinematics`; `seq` draws the noise.  No lamp
        lights the floor.

        With `out` (same shape, uint8, contiguous) the picture is written there and `out` returned."""
        picture = picture_for(self._camera.lens, out)
        view = floor_viewpoint(kinematics, self._camera.mount)
        x_m, y_m = self._looks_at(kinematics, view, how.exposure)
        foot, footprint_m = (view.x_m, view.y_m), self._rays.footprint_m(view)
        canvas, cells = self._tiles.look(x_m, y_m, foot, footprint_m)
        floor_map = self._rays.to_pixels(cells)
        # whole texels and 32nds: a quarter faster than the look-up by floats, equal to one grey level
        texels, parts = cv2.convertMaps(floor_map, None, cv2.CV_16SC2)  # type: ignore[call-overload]
        cv2.remap(canvas, texels, parts, cv2.INTER_LINEAR, dst=picture, borderMode=cv2.BORDER_REPLICATE)
        self._smear(picture, kinematics, how.exposure)
        self._shine(picture, view, x_m, y_m)
        self._shade(picture, kinematics, view, x_m, y_m)
        self._sensor.expose(picture, kinematics.stamp_ns, seq, how.exposure, how.gain)
        self._tiles.prepare(x_m, y_m, foot, footprint_m, _ahead(kinematics, view))
        return picture

    def _looks_at(self, kinematics: Kinematics, view: Viewpoint, exposure: float) -> tuple[Floats, Floats]:
        """The floor points of all cells, relative to the camera's foot."""
        camera, rays = self._camera, None
        if camera.vibration.rms_rad:
            late_s = (self._rays.late - 0.5) * camera.readout_s
            over_s = exposure * camera.exposure_s
            rays = self._rays.turned(camera.turned_rad(kinematics.stamp_ns, late_s, over_s))
        if not camera.readout_s:
            return self._rays.floor(view, rays)
        first, last = (
            floor_viewpoint(moved(kinematics, sign * camera.readout_s / 2), camera.mount)
            for sign in (-1.0, 1.0)
        )
        return self._rays.rolled(view, first, last, rays)

    def _smear(self, picture: Image, kinematics: Kinematics, exposure: float) -> None:
        camera, moves = self._camera, self._look.motion_blur
        across, down = smear_px(camera, kinematics) if moves else (0.0, 0.0)
        smear = across * exposure, down * exposure
        if moves and camera.vibration.rms_rad:
            swept = vibration_px(camera, kinematics.stamp_ns, exposure, _STRIPS if camera.readout_s else 1)
            blur_vibrating(picture, smear, swept, self._look.soft_px)
            return
        kernel = blur_kernel(smear, self._look.soft_px)
        if kernel is not None:
            cv2.filter2D(picture, -1, kernel, dst=picture, borderType=cv2.BORDER_REPLICATE)

    def _shine(self, picture: Image, view: Viewpoint, x_m: Floats, y_m: Floats) -> None:
        shine = self._lighting.glare(x_m, y_m, (view.x_m, view.y_m), view.height_m)
        if shine is not None and float(shine.max()) >= 1.0:
            cv2.add(picture, self._rays.to_pixels(_grey(shine)), dst=picture)

    def _shade(
        self, picture: Image, kinematics: Kinematics, view: Viewpoint, x_m: Floats, y_m: Floats
    ) -> None:
        """The soft shadow that lamps above throw below the airframe, deep only near the floor."""
        depth = self._look.drone_shadow * math.exp(-view.height_m / _SHADOW_FADES_M * 2.0)
        if depth < 0.02:
            return
        dx, dy = x_m + np.float32(view.x_m - kinematics.x_m), y_m + np.float32(view.y_m - kinematics.y_m)
        reach = np.float32(_SHADOW_HALF_M + 0.25 * view.height_m)
        near = 1.0 - np.float32(depth) / (1.0 + ((dx * dx + dy * dy) / (reach * reach)) ** 2)
        cv2.multiply(picture, self._rays.to_pixels(_grey(near * 255.0)), dst=picture, scale=1 / 255)


def _ahead(kinematics: Kinematics, view: Viewpoint) -> Ahead:
    rise_m = max(kinematics.climb_mps * _AHEAD_S, -0.5 * view.height_m)
    return Ahead(kinematics.vx_mps * _AHEAD_S, kinematics.vy_mps * _AHEAD_S, 1.0 + rise_m / view.height_m)


def _grey(level: NDArray[np.floating[Any]]) -> Image:
    """(rows, columns, 3) grey picture of levels 0..255."""
    return np.repeat(np.clip(np.round(level), 0.0, 255.0).astype(np.uint8)[..., None], 3, axis=2)


def still(kinematics: Kinematics) -> Kinematics:
    """The same pose at rest."""
    return replace(
        kinematics,
        vx_mps=0.0,
        vy_mps=0.0,
        climb_mps=0.0,
        roll_rate_radps=0.0,
        pitch_rate_radps=0.0,
        yaw_rate_radps=0.0,
    )
