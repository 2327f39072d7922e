"""A device's exposure: a part of its usual one when asked for, and what pictures are said to have."""

from __future__ import annotations

import socket
from collections.abc import Callable
from contextlib import closing

import cv2
import numpy as np
import pytest

from flightd.adapters.camera import capture_process
from flightd.adapters.camera.capture_process import CaptureOver, frames_of
from flightd.adapters.camera.exposure import DeviceExposure
from flightd.adapters.camera.exposure_times import TimeSource
from flightd.adapters.camera.source import Source, SourceKind
from flightd.runtime.frame_ring import FrameRing
from flightd.runtime.message_channel import ChildEnd

AUTOMATIC = 3.0


class Device:
    """A V4L2 device with exposures in whole steps; a `stubborn` one takes no exposure by hand."""

    def __init__(self, usual: float, stubborn: bool = False) -> None:
        self.values = {cv2.CAP_PROP_AUTO_EXPOSURE: AUTOMATIC, cv2.CAP_PROP_EXPOSURE: usual}
        self._stubborn = stubborn
        self.position_ms = 0.0
        self.is_open = True

    def isOpened(self) -> bool:  # noqa: N802 - as OpenCV has it
        return self.is_open

    def get(self, prop: int, /) -> float:
        return self.position_ms if prop == cv2.CAP_PROP_POS_MSEC else self.values[prop]

    def set(self, prop: int, value: float, /) -> bool:
        if self._stubborn:
            return False
        self.values[prop] = round(value)
        return True

    def grab(self) -> bool:
        return self.is_open

    def retrieve(self) -> tuple[bool, np.ndarray]:
        return True, np.zeros((36, 64, 3), np.uint8)


def told(exposure: DeviceExposure, count: int) -> list[float]:
    return [exposure.of_next_frame() for _ in range(count)]


def test_a_part_is_set_by_hand_and_told_only_when_it_has_come_through() -> None:
    device = Device(200.0)
    exposure = DeviceExposure(device)
    assert told(exposure, 2) == [1.0, 1.0]
    exposure.ask(0.4)
    assert device.values == {cv2.CAP_PROP_AUTO_EXPOSURE: 1.0, cv2.CAP_PROP_EXPOSURE: 80.0}
    assert told(exposure, 6) == [1.0, 1.0, 1.0, 0.4, 0.4, 0.4]


def test_the_usual_exposure_comes_back_with_its_automatic() -> None:
    device = Device(200.0)
    exposure = DeviceExposure(device)
    before = dict(device.values)
    exposure.ask(2.5)
    exposure.ask(1.0)
    assert device.values == before
    assert told(exposure, 9)[-1] == 1.0


@pytest.mark.parametrize("device", [Device(200.0, stubborn=True), Device(0.0), Device(-1.0), Device(1.0)])
def test_pictures_of_a_device_that_cannot_are_said_to_have_the_usual_exposure(device: Device) -> None:
    exposure = DeviceExposure(device)
    before = dict(device.values)
    exposure.ask(0.4)
    assert set(told(exposure, 9)) == {1.0}
    assert device.values == before


@pytest.mark.parametrize("end", [lambda ours, frames: frames.close(), lambda ours, frames: ours.close()])
def test_a_device_is_left_with_the_exposure_that_it_was_found_with(
    monkeypatch: pytest.MonkeyPatch, end: Callable[..., None]
) -> None:
    device = Device(200.0)
    monkeypatch.setattr(cv2, "VideoCapture", lambda *_: device)
    ours, theirs = socket.socketpair()
    source = Source(SourceKind.DEVICE, "/dev/video0", 64, 36, 30.0)
    with ours, theirs, closing(frames_of(source, ChildEnd(theirs))) as frames:
        next(frames)
        before = dict(device.values)
        ChildEnd(ours).send((0.4, 1.0))
        assert [next(frames).exposure for _ in range(9)][-1] == 0.4
        assert device.values != before
        end(ours, frames)
        with pytest.raises((StopIteration, EOFError)):
            next(frames)
    assert device.values == before


def test_a_frame_of_a_device_has_the_time_of_its_buffer(monkeypatch: pytest.MonkeyPatch) -> None:
    """V4L2's, which OpenCV tells as the position in milliseconds; 0 from a driver without one."""
    device = Device(200.0)
    monkeypatch.setattr(cv2, "VideoCapture", lambda *_: device)
    ours, theirs = socket.socketpair()
    source = Source(SourceKind.DEVICE, "/dev/video0", 64, 36, 30.0)
    with ours, theirs, closing(frames_of(source, ChildEnd(theirs))) as frames:
        device.position_ms = 123_456.789
        assert next(frames).device_ns == 123_456_789_000
        device.position_ms = -1.0
        assert next(frames).device_ns is None


class InventedTimes:
    """A stream whose frames come every 25 ms and are said to be 40 ms apart, and the clock that shows it."""

    def __init__(self) -> None:
        self.now_ns = 0

    def monotonic_ns(self) -> int:
        return self.now_ns

    def get(self, _prop: int, /) -> float:
        return self.now_ns * 1e-6 * 40 / 25

    def grab(self) -> bool:
        self.now_ns += 25_000_000
        return True

    def retrieve(self) -> tuple[bool, np.ndarray]:
        return True, np.zeros((36, 64, 3), np.uint8)


def test_a_stream_whose_times_are_invented_is_not_flown_by(monkeypatch: pytest.MonkeyPatch) -> None:
    video = InventedTimes()
    monkeypatch.setattr(cv2, "VideoCapture", lambda *_: video)
    monkeypatch.setattr(capture_process, "time", video)
    ring = FrameRing.create(capture_process.SLOTS, 64, 36)
    ours, theirs = socket.socketpair()
    with ours, theirs:
        source = Source(SourceKind.STREAM, "rtsp://camera", 64, 36, 40.0)
        capture_process.capture(ChildEnd(theirs), source, ring.name, 0)
        daemon = ChildEnd(ours)
        assert daemon.receive() is TimeSource.DEVICE
        over = daemon.receive()
    ring.close()
    assert isinstance(over, CaptureOver)
    assert "none of a time that can be believed" in over.reason
    assert video.now_ns < 10e9
