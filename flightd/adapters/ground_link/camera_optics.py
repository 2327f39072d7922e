"""The cameras' lenses and mounts as the ground link tells them."""

from __future__ import annotations

from collections.abc import Iterator

from flightd.adapters.ground_link.messages.floor import CameraOptics
from flightd.config.schema import Config
from flightd.core.camera_view import AnyMount
from flightd.core.geometry import Lens, quaternion_of
from flightd.core.preview import CameraName


def camera_optics(config: Config) -> tuple[CameraOptics, ...]:
    """Those of the cameras that are fitted."""
    return tuple(_fitted(config))


def _fitted(config: Config) -> Iterator[CameraOptics]:
    yield _optics(CameraName.DOWN, config.camera.lens(), config.camera.mount())
    if config.front_camera.is_fitted:
        yield _optics(CameraName.FRONT, config.front_camera.lens(), config.front_camera.mount())


def _optics(camera: CameraName, lens: Lens, mount: AnyMount) -> CameraOptics:
    return CameraOptics(
        camera=camera,
        width_px=lens.width_px,
        height_px=lens.height_px,
        fx_px=lens.fx_px,
        fy_px=lens.fy_px,
        cx_px=lens.cx_px,
        cy_px=lens.cy_px,
        distortion=lens.distortion,
        offset_m=mount.offset_m,
        turn=quaternion_of(mount.body_from_image()),
    )
