"""Exposure, gain and anti-flicker of a V4L2 camera: set and read back through its controls.

Control ids, menus and units are those of `linux/v4l2-controls.h`; an exposure is counted in 100 microseconds.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import struct
from collections.abc import Callable, Iterator
from typing import TypeAlias

from flightd.core.exposure import STEP_S, ExposureOrder, ExposureState

Ioctl: TypeAlias = Callable[[int, int, bytearray], object]
"""`fcntl.ioctl`: file, request, structure; OSError where the driver refuses."""

_CONTROL = struct.Struct("<Ii")
_GET, _SET = 0xC008561B, 0xC008561C
"""VIDIOC_G_CTRL, VIDIOC_S_CTRL."""

AUTO_EXPOSURE, EXPOSURE, VARIES_RATE = 0x009A0901, 0x009A0902, 0x009A0903
"""V4L2_CID_EXPOSURE_AUTO, _EXPOSURE_ABSOLUTE, _EXPOSURE_AUTO_PRIORITY."""
AUTO_GAIN, GAIN, MAINS = 0x00980912, 0x00980913, 0x00980918
"""V4L2_CID_AUTOGAIN, _GAIN, _POWER_LINE_FREQUENCY."""
_MANUAL = 1
_TIME_BY_HAND = {1, 2}
"""Menu entries of automatic exposure with the time set by hand: manual, shutter priority."""
_MAINS_HZ = {0: 0, 1: 50, 2: 60}


class V4l2Controls:
    """The controls behind an open device's descriptor.  What the driver refuses is not raised: reading back
    shows it."""

    def __init__(self, descriptor: int, ioctl: Ioctl = fcntl.ioctl) -> None:
        self._descriptor = descriptor
        self._ioctl = ioctl
        self._before: list[tuple[int, int]] = []

    def set(self, order: ExposureOrder) -> None:
        """Set what is ordered; what stood there before is remembered once."""
        wanted: list[tuple[int, int]] = []
        if order.exposure_s is not None:
            steps = max(round(order.exposure_s / STEP_S), 1)
            wanted += [(VARIES_RATE, 0), (AUTO_EXPOSURE, _MANUAL), (EXPOSURE, steps)]
        if order.gain is not None:
            wanted += [(AUTO_GAIN, 0), (GAIN, round(order.gain))]
        wanted += [(MAINS, entry) for entry, hz in _MAINS_HZ.items() if hz and hz == order.anti_flicker_hz]
        if not self._before:
            stood = [(control, self._get(control)) for control, _ in wanted]
            self._before = [(control, value) for control, value in stood if value is not None]
        for control, value in wanted:
            self._put(control, value)

    def read(self) -> ExposureState:
        """As the driver tells it now."""
        mode, steps, gain, mains = (self._get(one) for one in (AUTO_EXPOSURE, EXPOSURE, GAIN, MAINS))
        return ExposureState(
            is_manual=None if mode is None else mode in _TIME_BY_HAND,
            exposure_s=None if steps is None else steps * STEP_S,
            gain=gain,
            anti_flicker_hz=None if mains is None else _MAINS_HZ.get(mains),
        )

    def give_back(self) -> None:
        """As it was found: values first, then whether they are automatic."""
        for control, value in reversed(self._before):
            self._put(control, value)
        self._before = []

    def _get(self, control: int) -> int | None:
        asked = bytearray(_CONTROL.pack(control, 0))
        try:
            self._ioctl(self._descriptor, _GET, asked)
        except OSError:
            return None
        return int(_CONTROL.unpack(asked)[1])

    def _put(self, control: int, value: int) -> None:
        with contextlib.suppress(OSError):
            self._ioctl(self._descriptor, _SET, bytearray(_CONTROL.pack(control, value)))


@contextlib.contextmanager
def controls_of(device: str) -> Iterator[V4l2Controls | None]:
    """Those of a device by its path, opened beside whoever reads its frames; None where that fails."""
    try:
        descriptor = os.open(device, os.O_RDWR | os.O_CLOEXEC | os.O_NONBLOCK)
    except OSError:
        yield None
        return
    try:
        yield V4l2Controls(descriptor)
    finally:
        os.close(descriptor)
