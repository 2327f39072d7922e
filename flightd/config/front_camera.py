"""The front camera's section of the configuration: the camera that looks at the shelves."""

from __future__ import annotations

import math

from pydantic import Field, field_validator

from flightd.config.camera import FocalX, FocalY, Height, OpticsSection, Width
from flightd.config.exposure_keys import ByHand, Gain, MainsHz
from flightd.config.lamp import lamp_switch
from flightd.core.camera_view import ForwardMount
from flightd.core.exposure import ExposureOrder


class FrontCameraConfig(OpticsSection):
    """Where its pictures come from, its lens and how it is mounted.

    The lens of the default sees 1.54 m of a shelf 1.2 m away, at 0.83 pixels to the millimetre."""

    url: str = Field(
        "",
        description="as camera.url: udp://HOST:PORT, device:/dev/videoN, picamera:N, stream:URL, "
        "file:PATH or folder:PATH; empty: there is none, nothing is scanned",
    )
    width_px: Width = 1280
    height_px: Height = 800
    fps: float = Field(4.0, gt=0, le=120, description="frame rate that the camera is set to")
    fx_px: FocalX = 1000.0
    fy_px: FocalY = 1000.0
    mount_yaw_deg: float = Field(
        0.0,
        ge=-180,
        le=180,
        description="direction of the view: 0 along the nose, + clockwise, 90 to the right",
    )
    mount_pitch_deg: float = Field(0.0, ge=-80, le=80, description="elevation of the view: + looks up")
    exposure_s: float = Field(
        0.002,
        gt=0,
        le=0.1,
        description="exposure time; the speed while looking keeps the blur within 0.75 module",
    )
    latency_s: float = Field(
        0.080, ge=0, le=1, description="from mid-exposure to arrival, least delay of the path"
    )
    manual_exposure: ByHand = False
    gain: Gain = None
    anti_flicker_hz: MainsHz = 0
    lamp: str = Field(
        "",
        description="what lights the shelf while it is looked at: led:NAME of /sys/class/leds, relay:N of an "
        "ArduPilot (0 to 15), actuator:N of a PX4 (1 to 6); empty: nothing",
    )

    @field_validator("lamp")
    @classmethod
    def _is_lamp(cls, value: str) -> str:
        lamp_switch(value)  # knows what there is
        return value

    @property
    def is_fitted(self) -> bool:
        """Whether there is such a camera."""
        return bool(self.url)

    def exposure_order(self) -> ExposureOrder:
        """What the camera is to be set to."""
        return ExposureOrder(
            self.exposure_s if self.manual_exposure else None, self.gain, self.anti_flicker_hz
        )

    def mount(self) -> ForwardMount:
        return ForwardMount(
            math.radians(self.mount_yaw_deg), math.radians(self.mount_pitch_deg), self.mount_offset_m
        )
