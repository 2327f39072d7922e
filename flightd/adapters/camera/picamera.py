"""A camera on a Raspberry Pi's ribbon cable, through libcamera by its Python library Picamera2.

Written by the library's documented interface, and tested against a stand-in for it: not tried on a Pi yet.
"""

from __future__ import annotations

import importlib
import time
from collections.abc import Iterator, Mapping
from typing import Any, Protocol

import numpy as np

from flightd.adapters.camera.grabbed import Grabbed
from flightd.adapters.camera.source import Source
from flightd.core.errors import UnavailableError
from flightd.core.exposure import ExposureOrder, ExposureState
from flightd.runtime.message_channel import ChildEnd

_INSTALL = "sudo apt install python3-picamera2, and make flightd's environment with --system-site-packages"
_FRAME_S = 2.0
"""A camera that gives no frame for so long has ended."""
_NEAR = 0.25
"""How far from the asked part of the usual exposure a frame may be and still count as having it."""
_TELLS = 0.1
"""A part by which an exposure has to change to be told again."""
_LATE_FRAMES = 6
"""Frames that may still come with the exposure before, once another one is set."""
_FLICKER_MANUAL = 1
_BY_HAND = {"AeEnable", "ExposureTime", "AnalogueGain"}
_US = 1e-6


class PicameraRequest(Protocol):
    """A frame with all that belongs to it."""

    def make_array(self, name: str) -> Any: ...

    def get_metadata(self) -> Mapping[str, Any]: ...

    def release(self) -> None: ...


class Picamera(Protocol):
    """What is used of `picamera2.Picamera2`."""

    @property
    def camera_controls(self) -> Mapping[str, Any]: ...

    def create_video_configuration(self, main: Mapping[str, Any], controls: Mapping[str, Any]) -> Any: ...

    def configure(self, configuration: Any) -> None: ...

    def set_controls(self, controls: Mapping[str, Any]) -> None: ...

    def start(self) -> None: ...

    def capture_request(self, wait: float) -> PicameraRequest: ...

    def close(self) -> None: ...


def open_picamera(number: int) -> Picamera:
    """UnavailableError without the library, or without such a camera."""
    try:
        library = importlib.import_module("picamera2")
    except ImportError as err:
        raise UnavailableError("picamera: needs Picamera2", remedy=_INSTALL) from err
    try:
        camera: Picamera = library.Picamera2(number)
    except (IndexError, RuntimeError) as err:
        raise UnavailableError(f"picamera:{number}: {err}", remedy="rpicam-hello --list-cameras") from err
    return camera


def controls_for(order: ExposureOrder, offered: Mapping[str, Any]) -> dict[str, Any]:
    """The order in libcamera's terms; what the camera does not offer is left out, reading back shows it."""
    wanted: dict[str, Any] = {}
    if order.exposure_s is not None:
        wanted |= {"AeEnable": False, "ExposureTime": round(order.exposure_s / _US)}
    if order.gain is not None:
        wanted["AnalogueGain"] = float(order.gain)
    if order.anti_flicker_hz:
        wanted |= {"AeFlickerMode": _FLICKER_MANUAL, "AeFlickerPeriod": round(0.5e6 / order.anti_flicker_hz)}
    return {name: value for name, value in wanted.items() if name in offered}


def frames_of_picamera(source: Source, camera: Picamera, parent: ChildEnd) -> Iterator[Grabbed]:
    """The camera's frames, exposed as ordered, or for a while as `parent` asks for; tells `parent` how they
    were exposed, by what libcamera says of each frame, whenever that changes."""
    interval_us = round(1e6 / source.fps)
    held = controls_for(source.order, camera.camera_controls)
    settings = held | {"FrameDurationLimits": (interval_us, interval_us)}
    size = {"size": (source.width_px, source.height_px), "format": "RGB888"}  # bytes in the order B, G, R
    exposure = PicameraExposure(camera, held)
    try:
        camera.configure(camera.create_video_configuration(size, controls=settings))
        camera.start()
        while True:
            try:
                request = camera.capture_request(wait=_FRAME_S)
            except TimeoutError:
                return
            arrival_ns = time.monotonic_ns()
            try:
                bgr, told = np.asarray(request.make_array("main"), np.uint8), request.get_metadata()
            finally:
                request.release()
            part, gain, state = exposure.of(told)
            if state is not None:
                parent.send(state)
            yield Grabbed(bgr, arrival_ns, told.get("SensorTimestamp"), part, gain)
            while parent.has_news():
                exposure.ask(*parent.receive())
    finally:
        camera.close()


class PicameraExposure:
    """Asks for parts of the usual exposure and gain, and says by a frame's metadata which it has."""

    def __init__(self, camera: Picamera, held: Mapping[str, Any]) -> None:
        self._camera = camera
        self._held = held
        self._usual_s: float | None = None
        self._gain: float | None = None
        self._part = self._gain_part = 1.0
        self._is_usual = True
        self._mixed = _LATE_FRAMES
        self._told: ExposureState | None = None

    def ask(self, part: float, gain_part: float) -> None:
        """Take frames with these parts of the usual exposure and gain from now on; 1.0 of both gives the
        usual ones back."""
        if self._usual_s is None:
            return
        self._mixed = _LATE_FRAMES
        if (part, gain_part) != (1.0, 1.0):
            self._part, self._gain_part = part, gain_part
            asked = {"AeEnable": False, "ExposureTime": round(part * self._usual_s / _US)}
            gain = {} if self._gain is None else {"AnalogueGain": gain_part * self._gain}
            self._camera.set_controls(asked | gain)
            self._is_usual = False
            return
        self._is_usual = True
        by_hand = {name: value for name, value in self._held.items() if name in _BY_HAND}
        self._camera.set_controls(by_hand or {"AeEnable": True})

    def of(self, metadata: Mapping[str, Any]) -> tuple[float, float, ExposureState | None]:
        """The parts of the usual exposure and gain that a frame has; the state, where it is another than was
        told."""
        microseconds, gain = metadata.get("ExposureTime"), metadata.get("AnalogueGain")
        exposure_s = None if microseconds is None else microseconds * _US
        if self._mixed:
            self._mixed -= 1
        if self._mixed or not self._is_usual:
            part = _nearly(exposure_s, self._usual_s, self._part)
            return part, _nearly(gain, self._gain, self._gain_part), None
        self._usual_s, self._gain, self._part, self._gain_part = exposure_s, gain, 1.0, 1.0
        mains_us = self._held.get("AeFlickerPeriod")
        state = ExposureState(
            is_manual="ExposureTime" in self._held,
            exposure_s=exposure_s,
            gain=None if gain is None else round(float(gain), 3),
            anti_flicker_hz=0 if mains_us is None else round(0.5e6 / mains_us),
        )
        if self._told is not None and not _differs(state, self._told):
            return 1.0, 1.0, None
        self._told = state
        return 1.0, 1.0, state


def _nearly(value: float | None, usual: float | None, asked: float) -> float:
    """The asked part of the usual value, where the frame has about that."""
    if value is None or usual is None or not usual > 0.0:
        return 1.0
    return asked if abs(value / usual - asked) <= _NEAR * asked else 1.0


def _differs(one: ExposureState, other: ExposureState) -> bool:
    """Whether it is another exposure, and not only a line of the sensor more or less."""
    times = one.exposure_s, other.exposure_s
    if times[0] is None or times[1] is None:
        return times[0] is not times[1]
    return one.is_manual is not other.is_manual or abs(times[0] - times[1]) > _TELLS * times[1]
