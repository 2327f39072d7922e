"""Pictures of the front camera: the racks before it through its lens, from where the airframe is.

An ideal camera's picture is drawn panel by panel (in `core.view`'s geometry), bent by the lens, and then
blurred, lit and made noisy as a sensor does.
"""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from flightd.core.camera_view import CameraView, Viewpoint
from flightd.core.distortion import undistorted
from flightd.core.geometry import Lens
from flightd.core.types import Image
from flightd.sim.appearance import Appearance
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.racks.appearance import RackAppearance
from flightd.sim.racks.face_light import USUAL_LIGHT, FaceLight
from flightd.sim.racks.front_camera import FrontCamera
from flightd.sim.racks.panels import Pane
from flightd.sim.racks.rack_layout import faces
from flightd.sim.racks.scene import Racks, Sightline
from flightd.sim.racks.stock import stock
from flightd.sim.sensors.camera_effects import Sensor, blur_kernel
from flightd.sim.sensors.optics import USUALLY, Taking, picture_for
from flightd.site.site import Site

_COARSE = 2
"""The depths of the racks are drawn at a fraction of the resolution."""
_SKY_CELL_PX = 16
_FLOOR_TONE, _HALL_TONE = (112.0, 116.0, 116.0), (86.0, 88.0, 90.0)
_OPEN_FLOOR_M = 3.0
"""What is blurred as if it were so far where no rack is before the camera."""


class FrontRenderer:
    """Renders what the front camera sees in one warehouse.

    A picture depends on the site, the camera, the look, the seed, the pose and `seq` alone, not on what
    was rendered before.  Not for use from several threads at once."""

    def __init__(
        self,
        site: Site,
        camera: FrontCamera,
        look: RackAppearance,
        seed: int = 0,
        make_racks: Callable[..., Racks] = Racks,
    ) -> None:
        """`make_racks` makes what is drawn, as `Racks`."""
        self._camera = camera
        focal_px = camera.lens.fx_px
        stock_seed = seed if look.seed is None else look.seed
        places = stock(site, look.shares, focal_px, stock_seed, look.in_part, look.cartons)

        def density(code: str) -> float | None:
            location = site.locations[code]
            distance_m = abs(location.y_m - site.nodes[location.node].y_m)
            return focal_px / max(distance_m, 0.1) if look.location_labels else None

        self._racks = make_racks(faces(site), places, density, stock_seed)
        self._look = look
        self._light = FaceLight(look.light, camera.lens)
        self._sensor = Sensor(camera.lens, _sensor_look(look), seed + 1)
        self._ideal, self._bend = _ideal_lens(camera.lens)
        self._drawn = np.empty((self._ideal.height_px, self._ideal.width_px, 4), np.uint8)
        self._coarse_lens = self._ideal.scaled(
            self._ideal.width_px // _COARSE, self._ideal.height_px // _COARSE
        )

    def render(
        self, kinematics: Kinematics, seq: int, out: Image | None = None, how: Taking = USUALLY
    ) -> Image:
        """(H, W, 3) BGR picture of the exposure whose middle is `kinematics`; `seq` draws the noise.

        With `out` (same shape, uint8, contiguous) the picture is written there and `out` returned."""
        picture = picture_for(self._camera.lens, out)
        view = self._camera.view(kinematics).viewpoint
        seen = self._racks.sights(CameraView(self._ideal, view))
        coarse = self._background(view)
        self._racks.draw_depths(Pane(CameraView(self._coarse_lens, view), coarse), seen)
        drawn = self._drawn
        cv2.resize(coarse, (drawn.shape[1], drawn.shape[0]), dst=drawn, interpolation=cv2.INTER_LINEAR)
        self._racks.draw_fronts(Pane(CameraView(self._ideal, view), drawn), seen)
        if self._bend is not None:
            drawn = np.asarray(cv2.remap(drawn, *self._bend, cv2.INTER_LINEAR), np.uint8)
        cv2.cvtColor(drawn, cv2.COLOR_BGRA2BGR, dst=picture)
        self._blur(picture, kinematics, _distance_m(view, seen), how.exposure)
        light = self._light.draw(view, seen, how.lamp)
        self._sensor.expose(picture, kinematics.stamp_ns, seq, how.exposure, how.gain, light, USUAL_LIGHT)
        return picture

    def _background(self, view: Viewpoint) -> Image:
        """The floor below the horizon and the hall above it, (H, W, 4), coarse."""
        lens = self._coarse_lens
        shape = -(-lens.height_px // _SKY_CELL_PX) + 1, -(-lens.width_px // _SKY_CELL_PX) + 1
        right = (np.arange(shape[1]) * _SKY_CELL_PX - lens.cx_px) / lens.fx_px
        down = (np.arange(shape[0]) * _SKY_CELL_PX - lens.cy_px) / lens.fy_px
        slope = view.map_from_image[2]
        falls = slope[0] * right[None, :] + slope[1] * down[:, None] + slope[2]
        share = np.clip(falls / 0.1 + 0.5, 0.0, 1.0)[..., None]
        tone = np.array((*_HALL_TONE, 0.0)) * (1.0 - share) + np.array((*_FLOOR_TONE, 0.0)) * share
        size = shape[1] * _SKY_CELL_PX, shape[0] * _SKY_CELL_PX
        whole = cv2.resize(tone.astype(np.uint8), size, interpolation=cv2.INTER_LINEAR)
        return np.ascontiguousarray(whole[: lens.height_px, : lens.width_px], np.uint8)

    def _blur(self, picture: Image, kinematics: Kinematics, distance_m: float, exposure: float) -> None:
        across, down = self._camera.smear_px(kinematics, distance_m) if self._look.motion_blur else (0.0, 0.0)
        smear = across * exposure, down * exposure
        soft_px = float(np.hypot(self._look.soft_px, self._camera.defocus_px(distance_m)))
        kernel = blur_kernel(smear, soft_px)
        if kernel is not None:
            cv2.filter2D(picture, -1, kernel, dst=picture, borderType=cv2.BORDER_REPLICATE)


def _distance_m(view: Viewpoint, seen: tuple[Sightline, ...]) -> float:
    """How far ahead along the optical axis the first face is."""
    across = float(view.map_from_image[1, 2])
    reaches = [
        (sight.face.y_m - view.y_m) / across
        for sight in seen
        if abs(across) > 0.2 and sight.face.inward * across > 0.0
    ]
    return min(reaches, default=_OPEN_FLOOR_M)


def _ideal_lens(lens: Lens) -> tuple[Lens, tuple[Image, Image] | None]:
    """A lens without distortion that sees all that `lens` does, and OpenCV's maps from its picture to the
    real one's; the same lens and None where nothing is bent."""
    if not lens.is_distorted:
        return lens, None
    columns, rows = np.meshgrid(np.arange(lens.width_px), np.arange(lens.height_px))
    seen = np.stack([(columns - lens.cx_px) / lens.fx_px, (rows - lens.cy_px) / lens.fy_px])
    right, down = undistorted(seen, lens)
    u, v = right * lens.fx_px, down * lens.fy_px
    left, top = np.floor(u.min()) - 1.0, np.floor(v.min()) - 1.0
    width, height = int(np.ceil(u.max()) - left) + 2, int(np.ceil(v.max()) - top) + 2
    ideal = Lens(width, height, lens.fx_px, lens.fy_px, -left, -top)
    maps = np.dstack([u - left, v - top]).astype(np.float32)
    texels, parts = cv2.convertMaps(maps, None, cv2.CV_16SC2)  # type: ignore[call-overload]
    return ideal, (texels, parts)


def _sensor_look(look: RackAppearance) -> Appearance:
    return Appearance(
        vignetting=look.vignetting, noise=look.noise, flicker=look.flicker, exposure=look.exposure
    )
