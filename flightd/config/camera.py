"""The down camera's section of the configuration, and what it has in common with the front camera's."""

from __future__ import annotations

import math
from typing import Annotated, Self, TypeAlias

from pydantic import Field, model_validator

from flightd.config.exposure_keys import ExposureTime, Gain, MainsHz
from flightd.config.section import Section, unit
from flightd.core.camera_view import FloorReach
from flightd.core.exposure import ExposureOrder
from flightd.core.geometry import Lens, Mount

Width: TypeAlias = Annotated[int, Field(ge=16, le=7680, description="width of the frame")]
Height: TypeAlias = Annotated[int, Field(ge=16, le=4320, description="height of the frame")]
FocalX: TypeAlias = Annotated[float, Field(gt=1, le=20000, description="focal length in x")]
FocalY: TypeAlias = Annotated[float, Field(gt=1, le=20000, description="focal length in y")]
_Bend = Annotated[float, Field(ge=-10, le=10, allow_inf_nan=False)]
_Offset = Annotated[float, Field(ge=-2, le=2, allow_inf_nan=False)]

_RAGGED = 0.03
"""Part of the picture's reach, per metre of height, in which lines are not found surely."""
_KEPT_SHARE = 0.5
"""Part of the picture's half that a drone beside its node keeps to; the rest is for drift and tilt."""


class OpticsSection(Section):
    """A camera's picture, lens and place on the drone; pixels, metres."""

    width_px: Width
    height_px: Height
    fx_px: FocalX
    fy_px: FocalY
    cx_px: float | None = Field(
        None, ge=-20000, le=20000, description="principal point x; the picture's middle when left out"
    )
    cy_px: float | None = Field(
        None, ge=-20000, le=20000, description="principal point y; the picture's middle when left out"
    )
    distortion: tuple[_Bend, _Bend, _Bend, _Bend, _Bend] = Field(
        (0.0, 0.0, 0.0, 0.0, 0.0),
        description="lens distortion k1 k2 p1 p2 k3, OpenCV's order, -10 to 10 each",
        json_schema_extra=unit("1"),
    )
    mount_offset_m: tuple[_Offset, _Offset, _Offset] = Field(
        (0.0, 0.0, 0.0),
        description="camera from the range finder's origin: forward, right, down, -2 to 2 each",
    )

    def lens(self) -> Lens:
        cx = (self.width_px - 1) / 2 if self.cx_px is None else self.cx_px
        cy = (self.height_px - 1) / 2 if self.cy_px is None else self.cy_px
        return Lens(self.width_px, self.height_px, self.fx_px, self.fy_px, cx, cy, self.distortion)


class CameraConfig(OpticsSection):
    """The down camera: where its pictures come from, its lens and how it is mounted."""

    url: str = Field(
        "udp://127.0.0.1:5600",
        description="udp://HOST:PORT (notices of pictures in shared memory), device:/dev/videoN, "
        "picamera:N (a Raspberry Pi's), stream:URL (rtsp, rtp, mpeg-ts…), file:PATH (a video), folder:PATH "
        "(pictures)",
    )
    width_px: Width = 640
    height_px: Height = 360
    fps: float = Field(30.0, gt=0, le=240, description="frame rate that the camera is set to")
    fx_px: FocalX = 381.4  # 80 deg across 640 px
    fy_px: FocalY = 381.4
    mount_yaw_deg: float = Field(0.0, ge=-180, le=180, description="turn of the camera, clockwise from above")
    mount_roll_deg: float = Field(0.0, ge=-20, le=20, description="the camera rolled, its right side down")
    mount_pitch_deg: float = Field(0.0, ge=-20, le=20, description="the camera pitched, its front up")
    latency_s: float = Field(
        0.060, ge=0, le=1, description="from mid-exposure to arrival, least delay of the path"
    )
    readout_s: float = Field(
        0.0,
        ge=0,
        le=0.1,
        description="rolling shutter: from the exposure of the first row to that of the last; 0: all at once",
    )
    exposure_s: ExposureTime = 0.0
    gain: Gain = None
    anti_flicker_hz: MainsHz = 0

    @model_validator(mode="after")
    def _reads_out_in_time(self) -> Self:
        if self.readout_s * self.fps > 1.0:
            raise ValueError(f"readout_s <= 1 / fps is required: rows of one frame at {self.fps:g} a second")
        return self

    def exposure_order(self) -> ExposureOrder:
        """What the camera is to be set to."""
        return ExposureOrder(self.exposure_s or None, self.gain, self.anti_flicker_hz)

    def mount(self) -> Mount:
        turned = (math.radians(one) for one in (self.mount_roll_deg, self.mount_pitch_deg))
        return Mount(math.radians(self.mount_yaw_deg), self.mount_offset_m, *turned)

    @property
    def _turned(self) -> bool:
        """The picture's x axis lies along the nose rather than across it."""
        return abs(math.sin(math.radians(self.mount_yaw_deg))) > math.sqrt(0.5)

    @property
    def long_side_ahead(self) -> bool:
        """Whether the picture's longer side lies along the nose."""
        return (self.width_px > self.height_px) == self._turned

    @property
    def aside_per_height(self) -> float:
        """How far from its node along the aisle a drone that faces the shelf still sees the node's lines,
        for each metre of height."""
        half = min(self.width_px / self.fx_px, self.height_px / self.fy_px) / 2
        return _KEPT_SHARE * half

    def floor_reach(self, max_tilt_rad: float) -> FloorReach:
        """What the picture surely shows of the floor, leaning by `max_tilt_rad` too."""
        tilted = math.tan(max_tilt_rad)
        x, y = (
            max(0.5 * pixels / focal - tilted - _RAGGED, 0.1)
            for pixels, focal in ((self.width_px, self.fx_px), (self.height_px, self.fy_px))
        )
        return FloorReach(ahead=x if self._turned else y, aside=y if self._turned else x)
