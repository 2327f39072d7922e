"""The front camera's section of the configuration: the camera that looks at the shelves."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from flightd.core.geometry import Lens
from flightd.core.view import ForwardMount

_Bend = Annotated[float, Field(ge=-10, le=10, allow_inf_nan=False)]
_Offset = Annotated[float, Field(ge=-2, le=2, allow_inf_nan=False)]


class FrontCameraConfig(BaseModel):
    """Where its pictures come from, its lens and how it is mounted.

    The lens of the default sees 1.54 m of a shelf 1.2 m away, at 0.83 pixels to the millimetre."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    url: str = Field(
        "",
        description="as camera.url: udp://HOST:PORT, device:/dev/videoN, file:PATH or folder:PATH; "
        "empty: there is none, nothing is scanned",
    )
    width_px: int = Field(1280, ge=16, le=7680, description="picture width")
    height_px: int = Field(800, ge=16, le=4320, description="picture height")
    fps: float = Field(4.0, gt=0, le=120, description="frame rate asked for")
    fx_px: float = Field(1000.0, gt=1, le=20000, description="focal length in x")
    fy_px: float = Field(1000.0, gt=1, le=20000, description="focal length in y")
    cx_px: float | None = Field(
        None, allow_inf_nan=False, description="principal point x; the picture's middle when left out"
    )
    cy_px: float | None = Field(
        None, allow_inf_nan=False, description="principal point y; the picture's middle when left out"
    )
    distortion: tuple[_Bend, _Bend, _Bend, _Bend, _Bend] = Field(
        (0.0, 0.0, 0.0, 0.0, 0.0), description="k1 k2 p1 p2 k3, OpenCV's order"
    )
    mount_yaw_deg: float = Field(
        0.0, ge=-180, le=180, description="0 looks along the nose, + clockwise: 90 looks to the right"
    )
    mount_pitch_deg: float = Field(0.0, ge=-80, le=80, description="+ looks up")
    mount_offset_m: tuple[_Offset, _Offset, _Offset] = Field(
        (0.0, 0.0, 0.0), description="camera from the range finder's origin: forward, right, down"
    )
    exposure_s: float = Field(
        0.002, gt=0, le=0.1, description="limits the speed while looking: blur stays within 0.75 module"
    )
    latency_s: float = Field(
        0.080, ge=0, le=1, description="from mid-exposure to arrival, least delay of the path"
    )

    @property
    def is_fitted(self) -> bool:
        """Whether there is such a camera."""
        return bool(self.url)

    def lens(self) -> Lens:
        cx = (self.width_px - 1) / 2 if self.cx_px is None else self.cx_px
        cy = (self.height_px - 1) / 2 if self.cy_px is None else self.cy_px
        return Lens(self.width_px, self.height_px, self.fx_px, self.fy_px, cx, cy, self.distortion)

    def mount(self) -> ForwardMount:
        return ForwardMount(
            math.radians(self.mount_yaw_deg), math.radians(self.mount_pitch_deg), self.mount_offset_m
        )
