"""The exposure of a camera that V4L2 drives: its own, or for a while a part of that."""

from __future__ import annotations

from typing import Protocol

import cv2

_MANUAL = 1.0
"""V4L2_EXPOSURE_MANUAL."""
_LATE_FRAMES = 3
"""Frames that may still come with the exposure before, once another one is set."""
_NEAR = 0.25
"""How far from what was asked for a driver's step may be, as a part of it."""


class Device(Protocol):
    """What `cv2.VideoCapture` offers of a device's settings."""

    def get(self, prop: int, /) -> float: ...

    def set(self, prop: int, value: float, /) -> bool: ...


class DeviceExposure:
    """Sets a device's exposure and says which part of its usual one a frame has.  The usual one is what the
    device had when it was opened, automatic or not; where it cannot be changed, frames go on having it."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._mode = device.get(cv2.CAP_PROP_AUTO_EXPOSURE)
        self._usual = device.get(cv2.CAP_PROP_EXPOSURE)
        self._part = self._coming = 1.0
        self._late = 0

    def ask(self, part: float) -> None:
        """Take frames with this part of the usual exposure from now on; 1.0 gives the usual one back."""
        if not self._usual > 0.0:
            return
        if part == 1.0:
            self._device.set(cv2.CAP_PROP_EXPOSURE, self._usual)
            self._device.set(cv2.CAP_PROP_AUTO_EXPOSURE, self._mode)
            self._coming, self._late = 1.0, _LATE_FRAMES
            return
        self._device.set(cv2.CAP_PROP_AUTO_EXPOSURE, _MANUAL)
        self._device.set(cv2.CAP_PROP_EXPOSURE, part * self._usual)
        found = self._device.get(cv2.CAP_PROP_EXPOSURE) / self._usual
        if abs(found - part) <= _NEAR * part:
            self._coming, self._late = part, _LATE_FRAMES
        else:
            self.ask(1.0)

    def give_back(self) -> None:
        """Leave the device as it was found: it keeps its settings for whoever opens it next."""
        if self._coming != 1.0:
            self.ask(1.0)

    @property
    def is_usual(self) -> bool:
        """Whether the device is set to its usual exposure, and the frames that come have it."""
        return self._coming == 1.0 and not self._late

    def of_next_frame(self) -> float:
        """The part of the usual exposure that the frame read next has."""
        if self._late:
            self._late -= 1
        else:
            self._part = self._coming
        return self._part
