"""Exposure, gain and anti-flicker: set, held, read back, and what a camera does not do of it said."""

from __future__ import annotations

import contextlib
import errno
import importlib
import socket
import struct
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from flightd.adapters.camera import capture_process
from flightd.adapters.camera.capture import CaptureCamera
from flightd.adapters.camera.capture_process import CaptureOver, frames_of
from flightd.adapters.camera.held_exposure import HeldExposure
from flightd.adapters.camera.picamera import controls_for, frames_of_picamera, open_picamera
from flightd.adapters.camera.source import Source, SourceKind, parse_source
from flightd.adapters.camera.v4l2_controls import (
    AUTO_EXPOSURE,
    AUTO_GAIN,
    EXPOSURE,
    GAIN,
    MAINS,
    VARIES_RATE,
    V4l2Controls,
    controls_of,
)
from flightd.config.schema import parse_config
from flightd.core.errors import InputError, UnavailableError
from flightd.core.exposure import STEP_S, ExposureOrder, ExposureState
from flightd.runtime.clock import LoopClock
from flightd.runtime.frame_ring import FrameRing
from flightd.runtime.message_channel import ChildEnd
from tests.unit.camera.test_exposure import Device

ORDER = ExposureOrder(exposure_s=0.004, gain=30.0, anti_flicker_hz=50)
AUTOMATIC = {AUTO_EXPOSURE: 3, EXPOSURE: 157, VARIES_RATE: 1, AUTO_GAIN: 1, GAIN: 64, MAINS: 2}
"""Aperture priority, 15.7 ms, 60 Hz."""
BY_ITSELF = "exposure_s was set to 0.004, the camera goes on exposing by itself"


class Driver:
    """What VIDIOC_G_CTRL and VIDIOC_S_CTRL reach: the controls it has, their highest values; those of `deaf`
    are taken and not done."""

    def __init__(self, values: Mapping[int, int], most: Mapping[int, int] = {}, deaf: int = 0) -> None:
        self.values = dict(values)
        self._most = most
        self._deaf = deaf

    def __call__(self, descriptor: int, request: int, given: bytearray) -> int:
        assert descriptor == 7
        control, value = struct.unpack("<Ii", given)
        if control not in self.values:
            raise OSError(errno.EINVAL, "no such control")
        if request == 0xC008561C:  # set
            if control != self._deaf:
                self.values[control] = min(value, self._most.get(control, value))
        else:
            assert request == 0xC008561B
            given[:] = struct.pack("<Ii", control, self.values[control])
        return 0


def test_a_device_is_set_by_hand_read_back_and_left_as_it_was_found() -> None:
    driver = Driver(AUTOMATIC)
    controls = V4l2Controls(7, driver)
    assert controls.read() == ExposureState(False, 157 * STEP_S, 64, 60)
    controls.set(ORDER)
    assert driver.values == {
        AUTO_EXPOSURE: 1, EXPOSURE: 40, VARIES_RATE: 0, AUTO_GAIN: 0, GAIN: 30, MAINS: 1
    }  # fmt: skip
    assert controls.read().mismatches(ORDER) == ()
    controls.set(ORDER)
    controls.give_back()
    assert driver.values == AUTOMATIC


def test_what_is_not_ordered_is_left_alone() -> None:
    driver = Driver(AUTOMATIC)
    V4l2Controls(7, driver).set(ExposureOrder(anti_flicker_hz=50))
    assert driver.values == {**AUTOMATIC, MAINS: 1}


@pytest.mark.parametrize(
    ("driver", "said"),
    [
        (Driver(AUTOMATIC, {EXPOSURE: 20}), ["exposure_s was set to 0.004, the camera tells 0.002"]),
        (Driver(AUTOMATIC, {GAIN: 16}), ["gain was set to 30, the camera tells 16"]),
        (Driver(AUTOMATIC, deaf=AUTO_EXPOSURE), [BY_ITSELF]),
        (Driver(AUTOMATIC, deaf=MAINS), ["anti_flicker_hz was set to 50, the camera tells 60"]),
        (
            Driver({AUTO_EXPOSURE: 3, EXPOSURE: 157}),
            [
                "gain was set to 30, the camera has no such setting",
                "anti_flicker_hz was set to 50, the camera has no such setting",
            ],
        ),
        (Driver({}), None),
    ],
)  # fmt: skip
def test_what_a_camera_does_not_do_is_named(driver: Driver, said: list[str] | None) -> None:
    controls = V4l2Controls(7, driver)
    controls.set(ORDER)
    found = controls.read().mismatches(ORDER)
    assert len(found) == 3 if said is None else [str(one) for one in found] == said


def test_a_step_of_the_camera_is_no_difference() -> None:
    order = ExposureOrder(0.00333, 4.0)
    assert ExposureState(True, 0.0033, 4.02).mismatches(order) == ()
    assert len(ExposureState(True, 0.0035, 4.5).mismatches(order)) == 2


def test_a_camera_that_resets_itself_as_it_begins_is_set_again_and_then_watched() -> None:
    driver, told = Driver(AUTOMATIC), list[ExposureState]()
    held = HeldExposure(V4l2Controls(7, driver), ORDER, told.append)
    driver.values = dict(AUTOMATIC)  # as its stream began
    for _ in range(6):
        held.look(usual=True)
    assert [state.exposure_s for state in told] == [0.004]
    for frame in range(300):
        if frame == 150:
            driver.values[AUTO_EXPOSURE] = 3
        held.look(usual=frame < 200)
    assert [state.is_manual for state in told] == [True, False]
    held.give_back()
    assert driver.values == AUTOMATIC


def test_a_device_without_a_driver_says_that_nothing_can_be_set(tmp_path: Path) -> None:
    told = list[ExposureState]()
    with controls_of(str(tmp_path / "video0")) as controls:
        assert controls is None
        held = HeldExposure(controls, ORDER, told.append)
        for _ in range(6):
            held.look(usual=True)
        held.give_back()
    assert len(told[0].mismatches(ORDER)) == 3


def test_the_process_that_reads_a_device_tells_how_it_exposes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside the frames, by the same channel; the device's own setting comes back at the end."""
    driver = Driver(AUTOMATIC)
    (reads, writes) = socket.socketpair()  # any descriptor
    monkeypatch.setattr(cv2, "VideoCapture", lambda *_: Device(40.0))
    monkeypatch.setattr(capture_process, "controls_of", lambda _: closing_nothing(V4l2Controls(7, driver)))
    source = Source(SourceKind.DEVICE, "/dev/video0", 64, 36, 30.0, ORDER)
    with reads, writes, closing(frames_of(source, ChildEnd(writes))) as frames:
        for _ in range(8):
            next(frames)
        assert ChildEnd(reads).receive() == ExposureState(True, 40 * STEP_S, 30, 50)
        assert driver.values[EXPOSURE] == 40
    assert driver.values == AUTOMATIC


def test_a_device_that_another_process_has_is_not_set(monkeypatch: pytest.MonkeyPatch) -> None:
    """What it set would be taken for the device's own setting, and given back at the end."""
    device, driver, asked = Device(40.0), Driver(AUTOMATIC), list[str]()
    device.is_open = False

    def controls(place: str) -> closing_nothing:
        asked.append(place)
        return closing_nothing(V4l2Controls(7, driver))

    monkeypatch.setattr(cv2, "VideoCapture", lambda *_: device)
    monkeypatch.setattr(capture_process, "controls_of", controls)
    (reads, writes) = socket.socketpair()
    source = Source(SourceKind.DEVICE, "/dev/video0", 64, 36, 30.0, ORDER)
    with reads, writes, closing(frames_of(source, ChildEnd(writes))) as frames:
        assert list(frames) == []
    assert asked == []


class closing_nothing:  # noqa: N801 - used as a function
    """Hands the controls over, as `controls_of` does."""

    def __init__(self, controls: V4l2Controls) -> None:
        self._controls = controls

    def __enter__(self) -> V4l2Controls:
        return self._controls

    def __exit__(self, *_: object) -> None: ...


def test_a_camera_that_is_read_back_otherwise_than_set_is_an_event_once() -> None:
    said = list[str]()
    source = parse_source("device:/dev/video0", 64, 36, 30.0, ORDER)
    camera = CaptureCamera(source, 0.05, LoopClock.__new__(LoopClock), lambda _: None, said.append)
    assert camera.exposure_state is None
    for state in [ExposureState(True, 0.004, 30, 50)] + 2 * [ExposureState(False, 0.02, 30, 50)]:
        camera._take_state(state)  # noqa: SLF001 - what its process says
        assert camera.exposure_state == state
    assert said == [f"camera device:/dev/video0: {BY_ITSELF}"]


@pytest.mark.parametrize(
    ("url", "keys", "said"),
    [
        ("stream:rtsp://eye/down", {"exposure_s": 0.004}, "exposure_s: a stream carries no such setting"),
        ("udp://127.0.0.1:5600", {"exposure_s": 0.004}, "exposure_s: a camera process sets its camera"),
        ("ardrone:", {"anti_flicker_hz": 50}, "anti_flicker_hz: the AR.Drone exposes by itself"),
        ("file:a.mp4", {"gain": 0}, "gain: a recording is exposed already"),
        ("device:/dev/video0", {"gain": 5}, "gain: the camera's automatic would change it again"),
        ("device:/dev/video0", {"anti_flicker_hz": 55}, "anti_flicker_hz: 55 is none of 0, 50, 60 Hz"),
        ("device:/dev/video0", {"exposure_s": 4}, "exposure_s: 4 is outside 0 to 0.1 s"),
    ],
)  # fmt: skip
def test_a_key_that_the_camera_cannot_follow_is_refused_by_its_name(
    url: str, keys: dict[str, Any], said: str
) -> None:
    table = {"mission": {"site": "site.toml"}, "camera": {"url": url, **keys}}
    with pytest.raises(InputError) as caught:
        parse_config(table, Path("flightd.toml"))
    assert f"config flightd.toml: camera.{said}" in str(caught.value)


def test_the_front_camera_is_set_only_where_that_is_asked_for() -> None:
    front = {"url": "device:/dev/video2", "exposure_s": 0.003}
    table: dict[str, Any] = {"mission": {"site": "site.toml"}, "front_camera": front}
    assert parse_config(table, Path("a.toml")).front_camera.exposure_order().is_empty
    front |= {"manual_exposure": True, "gain": 2}
    assert parse_config(table, Path("a.toml")).front_camera.exposure_order() == ExposureOrder(0.003, 2.0)
    for wrong in ({"url": "udp://127.0.0.1:1"}, {"manual_exposure": False}):
        with pytest.raises(InputError, match="front_camera"):
            parse_config({**table, "front_camera": {**front, **wrong}}, Path("a.toml"))


OFFERED = {"AeEnable": 0, "ExposureTime": 0, "AnalogueGain": 0, "AeFlickerMode": 0, "AeFlickerPeriod": 0}


class Pi:
    """A stand-in for `picamera2.Picamera2`, as far as its manual says it: what is set acts three frames
    later, an exposure in whole lines of 18 us; `ends` after so many frames."""

    def __init__(self, ends: int) -> None:
        self.camera_controls: Mapping[str, Any] = OFFERED
        self.set: list[Mapping[str, Any]] = []
        self.controls: Mapping[str, Any] = {}
        self.closed = False
        self._ends = ends
        self._exposures, self._gains = [20_000], [2.0]

    def create_video_configuration(self, main: Mapping[str, Any], controls: Mapping[str, Any]) -> Any:
        return main, controls

    def configure(self, configuration: Any) -> None:
        self.main, self.controls = configuration
        self._exposures = [self.controls.get("ExposureTime", 20_000)]

    def set_controls(self, controls: Mapping[str, Any]) -> None:
        self.set.append(controls)
        time_us = 20_000 if controls.get("AeEnable") else controls["ExposureTime"]
        self._exposures += [*[self._exposures[-1]] * 2, time_us]
        self._gains += [*[self._gains[-1]] * 2, controls.get("AnalogueGain", 2.0)]

    def start(self) -> None: ...

    def capture_request(self, wait: float) -> Pi:
        if not self._ends:
            raise TimeoutError
        self._ends -= 1
        if len(self._exposures) > 1:
            self._exposures.pop(0)
            self._gains.pop(0)
        return self

    def make_array(self, name: str) -> Any:
        return np.full((36, 64, 3), 80, np.uint8)

    def get_metadata(self) -> Mapping[str, Any]:
        lines_us = self._exposures[0] // 18 * 18
        return {"ExposureTime": lines_us, "AnalogueGain": self._gains[0], "SensorTimestamp": 5 + self._ends}

    def release(self) -> None: ...

    def close(self) -> None:
        self.closed = True


@pytest.mark.parametrize("order", [ExposureOrder(0.004, 2.0, 50), ExposureOrder()])
def test_a_pis_camera_is_set_and_told_by_its_frames(order: ExposureOrder) -> None:
    camera = Pi(ends=40)
    source = Source(SourceKind.PICAMERA, "0", 64, 36, 30.0, order)
    ours, theirs = socket.socketpair()
    with ours, theirs:
        frames = frames_of_picamera(source, camera, ChildEnd(theirs))
        parts, gains = [], []
        for frame in frames:
            parts.append(frame.exposure)
            gains.append(frame.gain)
            if len(parts) in {12, 24}:
                ChildEnd(ours).send((0.4, 2.0) if len(parts) == 12 else (1.0, 1.0))
        theirs.close()
        daemon, states = ChildEnd(ours), list[ExposureState]()
        while daemon.has_news():
            with contextlib.suppress(EOFError):
                states.append(daemon.receive())
                continue
            break
    assert camera.main == {"size": (64, 36), "format": "RGB888"}
    assert camera.controls["FrameDurationLimits"] == (33333, 33333)
    assert camera.closed
    assert parts[:13] == [1.0] * 13
    assert parts[18:24] == [0.4] * 6
    assert parts[-8:] == [1.0] * 8
    assert (gains[:13], gains[18:24], gains[-8:]) == ([1.0] * 13, [2.0] * 6, [1.0] * 8)
    (state,) = states  # neither lines nor a part of the usual exposure are another exposure
    assert state.mismatches(order) == ()
    assert state.is_manual is not order.is_empty
    by_hand = {"AeEnable": False, "ExposureTime": 4000, "AnalogueGain": 2.0}
    assert camera.set[-1] == ({"AeEnable": True} if order.is_empty else by_hand)


def test_what_a_pis_camera_does_not_offer_is_read_back_as_not_set() -> None:
    assert controls_for(ORDER, OFFERED)["AeFlickerPeriod"] == 10_000
    assert "AeFlickerPeriod" not in controls_for(ORDER, {"AeEnable": 0, "ExposureTime": 0})


def test_without_picamera2_it_is_said_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> Any:
        raise ImportError(name)

    monkeypatch.setattr(importlib, "import_module", missing)
    with pytest.raises(UnavailableError, match="apt install python3-picamera2"):
        open_picamera(0)
    ring = FrameRing.create(capture_process.SLOTS, 64, 36)
    ours, theirs = socket.socketpair()
    with ours, theirs:
        source = Source(SourceKind.PICAMERA, "0", 64, 36, 30.0)
        capture_process.capture(ChildEnd(theirs), source, ring.name, 0)
        over = ChildEnd(ours).receive()
    ring.close()
    assert isinstance(over, CaptureOver)
    assert "needs Picamera2" in over.reason


@pytest.mark.parametrize("url", ["picamera:", "picamera:csi", "picamera:-1"])
def test_a_pis_camera_has_a_number(url: str) -> None:
    with pytest.raises(InputError, match=r"camera\.url"):
        parse_source(url, 64, 36, 30.0)
