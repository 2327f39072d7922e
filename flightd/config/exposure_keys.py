"""The keys by which a camera is told how to expose: taken only where the camera can be told."""

from __future__ import annotations

from typing import Annotated, Any, TypeAlias, TypeVar

from pydantic import AfterValidator, Field, ValidationInfo

from flightd.config.section import unit

_T = TypeVar("_T")

TOLD = ("device:", "picamera:")
"""Addresses of cameras that flightd sets itself."""
_CANNOT = {
    "udp": "a camera process sets its camera itself: set it there",
    "stream": "a stream carries no such setting: set it in the camera that sends it",
    "file": "a recording is exposed already",
    "folder": "a recording is exposed already",
    "ardrone": "the AR.Drone exposes by itself",
}


def can_be_told(url: str) -> bool:
    """Whether the camera at this address takes exposure, gain and anti-flicker from flightd."""
    return url.startswith(TOLD)


def cannot_be_told(url: str) -> str:
    """Why the camera at this address is not set by flightd, and what to do."""
    return _CANNOT.get(url.partition(":")[0], "there is no such camera")


def _settable(value: _T, info: ValidationInfo) -> _T:
    if value:
        _demand_told(info)
    return value


def _beside_exposure(value: float | None, info: ValidationInfo) -> float | None:
    if value is None:
        return None
    _demand_told(info)
    if not info.data.get("manual_exposure", info.data.get("exposure_s", True)):
        needed = "manual_exposure = true" if "manual_exposure" in info.data else "exposure_s"
        raise ValueError(f"the camera's automatic would change it again: give {needed} too, or leave it out")
    return value


def _demand_told(info: ValidationInfo) -> None:
    url = str(info.data.get("url", TOLD[0]))  # an address that is wrong itself is complained of already
    if not can_be_told(url):
        why = f"{cannot_be_told(url)}, and leave the key out"
        raise ValueError(f"{why} ({' and '.join(TOLD)} cameras take it)")


def _mains(value: int) -> int:
    if value not in {0, 50, 60}:
        raise ValueError(f"{value} is none of 0, 50, 60 Hz")
    return value


_MAINS: dict[str, Any] = {**unit("Hz"), "values": ["0", "50", "60"]}

ExposureTime: TypeAlias = Annotated[
    float,
    Field(
        ge=0,
        le=0.1,
        description="exposure time that the camera is set to and holds, 0.005 at most to fly by; 0: as the "
        "camera does by itself",
    ),
    AfterValidator(_settable),
]
ByHand: TypeAlias = Annotated[
    bool,
    Field(
        description="true: the camera is set to exposure_s and holds it; false: that is only what it is said "
        "to have"
    ),
    AfterValidator(_settable),
]
Gain: TypeAlias = Annotated[
    float | None,
    Field(
        ge=0,
        le=10_000,
        description="gain that the camera is set to: device: the driver's own number (v4l2-ctl "
        "--list-ctrls), picamera: a factor from 1; left out: as the camera has it",
        json_schema_extra=unit("1"),
    ),
    AfterValidator(_beside_exposure),
]
MainsHz: TypeAlias = Annotated[
    int,
    Field(
        description="mains whose flicker the camera's automatic avoids, for exposures of 8 ms and longer; 0: "
        "as the camera has it",
        json_schema_extra=_MAINS,
    ),
    AfterValidator(_mains),
    AfterValidator(_settable),
]
