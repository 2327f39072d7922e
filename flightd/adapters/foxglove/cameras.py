"""The drone's cameras as Foxglove has them: lens, and place on the drone."""

from __future__ import annotations

from collections.abc import Iterable

from flightd.adapters.foxglove.frames import Frames, time_of, transform, vector
from flightd.adapters.foxglove.schemas import JsonObject
from flightd.adapters.ground_link.messages.floor import CameraOptics
from flightd.core.geometry import Lens


def calibration(
    optics: CameraOptics, stamp_ns: int, frames: Frames, size_px: tuple[int, int] | None = None
) -> JsonObject:
    """`foxglove.CameraCalibration` for pictures of `size_px` (width, height); that of the camera's frames
    when left out."""
    lens = Lens(
        optics.width_px, optics.height_px, optics.fx_px, optics.fy_px, optics.cx_px, optics.cy_px,
        optics.distortion,
    )  # fmt: skip
    if size_px is not None:
        lens = lens.scaled(*size_px)
    fx, fy, cx, cy = (round(value, 6) for value in (lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px))
    return {
        "timestamp": time_of(stamp_ns),
        "frame_id": frames.camera(optics.camera),
        "width": lens.width_px,
        "height": lens.height_px,
        "distortion_model": "plumb_bob",
        "D": list(lens.distortion),
        "K": [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        "R": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        "P": [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    }


def cameras_on_drone(cameras: Iterable[CameraOptics], stamp_ns: int, frames: Frames) -> JsonObject:
    """`foxglove.FrameTransforms` of every camera: z of its frame is the optical axis, y is down in the
    picture."""
    return {"transforms": [_mounted(camera, stamp_ns, frames) for camera in cameras]}


def _mounted(optics: CameraOptics, stamp_ns: int, frames: Frames) -> JsonObject:
    forward_m, right_m, down_m = optics.offset_m
    # half a turn about x (forward) turns the drone's axes over: (1, 0, 0, 0) times the mount's quaternion
    x, y, z, w = optics.turn
    turned = {"x": w, "y": -z, "z": y, "w": -x}
    rotation = {axis: round(value, 7) for axis, value in turned.items()}
    return transform(
        stamp_ns, frames.drone, frames.camera(optics.camera), vector(forward_m, -right_m, -down_m), rotation
    )
