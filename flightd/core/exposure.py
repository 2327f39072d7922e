"""How a camera exposes: what is wanted of it, what it is read back to do, and where the two differ."""

from __future__ import annotations

import math
from dataclasses import dataclass

MOST_EXPOSURE_S = 0.005
"""The longest exposure that is flown with: beyond it lines and labels smear."""
_CLOSE = 0.02
"""Part of a value by which reading back may differ: cameras count in steps."""
STEP_S = 1e-4
"""V4L2 counts exposures in steps of 100 microseconds, and so do the cameras behind it."""
_GAIN_STEP = 0.05


@dataclass(frozen=True, slots=True)
class ExposureOrder:
    """What is to be set; None (of anti-flicker: 0) leaves it as the camera has it.  `gain` is the camera's
    own number."""

    exposure_s: float | None = None
    gain: float | None = None
    anti_flicker_hz: int = 0

    @property
    def is_empty(self) -> bool:
        """Whether nothing is to be set."""
        return self == AS_IT_IS


AS_IT_IS = ExposureOrder()
"""Nothing is to be set."""


@dataclass(frozen=True, slots=True)
class ExposureMismatch:
    """A key that the camera does not do as it was set: what it does, in words."""

    key: str
    wanted: str
    found: str

    def __str__(self) -> str:
        return f"{self.key} was set to {self.wanted}, the camera {self.found}"


@dataclass(frozen=True, slots=True)
class ExposureState:
    """As the camera is read back; None where it does not tell.  `anti_flicker_hz` is 0 where it is off."""

    is_manual: bool | None = None
    exposure_s: float | None = None
    gain: float | None = None
    anti_flicker_hz: int | None = None

    def mismatches(self, order: ExposureOrder) -> tuple[ExposureMismatch, ...]:
        """Where it differs from what was ordered by more than a step."""
        found = []
        if order.exposure_s is not None and (wrong := self._exposure_wrong(order.exposure_s)):
            found.append(ExposureMismatch("exposure_s", f"{order.exposure_s:g}", wrong))
        if order.gain is not None and (wrong := _wrong(self.gain, order.gain, _GAIN_STEP)):
            found.append(ExposureMismatch("gain", f"{order.gain:g}", wrong))
        if order.anti_flicker_hz and self.anti_flicker_hz != order.anti_flicker_hz:
            told = self.anti_flicker_hz
            wrong = "has no such setting" if told is None else f"tells {told}"
            found.append(ExposureMismatch("anti_flicker_hz", f"{order.anti_flicker_hz}", wrong))
        return tuple(found)

    def _exposure_wrong(self, wanted_s: float) -> str:
        if self.is_manual is False:
            return "goes on exposing by itself"
        return _wrong(self.exposure_s, wanted_s, STEP_S / 2)


def _wrong(found: float | None, wanted: float, step: float) -> str:
    if found is None:
        return "has no such setting"
    return "" if abs(found - wanted) <= max(_CLOSE * wanted, step) else f"tells {found:g}"


def motion_blur_px(exposure_s: float, speed_mps: float, height_m: float, focal_px: float) -> float:
    """How far the floor moves across the picture while it is exposed."""
    return exposure_s * speed_mps / height_m * focal_px


def beat_passed(exposure_s: float, mains_hz: int) -> float:
    """The share of a lamp's beat that is left in an exposure: it averages over its own length, and nothing is
    left of whole half periods of the mains."""
    turns = 2.0 * mains_hz * exposure_s
    return abs(math.sin(math.pi * turns) / (math.pi * turns)) if turns else 1.0
