"""A frame as it was read, before it lies in shared memory."""

from __future__ import annotations

from dataclasses import dataclass

from flightd.core.types import Image


@dataclass(frozen=True, slots=True)
class Grabbed:
    """One frame as it was read at `arrival_ns` of the machine's monotonic clock; `device_ns` is what driver
    or stream say of its time, by any clock, None if nothing; `exposure` and `gain` are its parts
    of the usual ones."""

    bgr: Image
    arrival_ns: int
    device_ns: int | None = None
    exposure: float = 1.0
    gain: float = 1.0
