"""When each frame of a live source was exposed: never the time at which somebody came to read it.  Pure."""

from __future__ import annotations

import enum
import statistics
from collections import deque
from itertools import pairwise

from flightd.tracking.device_clock import DeviceClock

_TRIED = 3
"""Frames by which a source shows whether its times go on."""
_SETTLED = 10
_FALL_NS = 5_000_000
"""A source that was just opened gives first what waited.  So many frames in a row that shorten the least
delay by no more than this are live."""
_GAPS = 15
_SOON, _LATE = 0.5, 1.5
"""Parts of the usual interval: a frame that comes sooner waited somewhere, one that comes later may have."""


class TimeSource(enum.StrEnum):
    """What tells when a frame was exposed."""

    DEVICE = "device"
    """The driver's time of the buffer, or the stream's time stamp: right to its jitter."""
    ARRIVAL = "arrival"
    """Nothing but the frame's arrival: late by up to one interval of frames."""


class ExposureTimes:
    """Call `of` with each frame in the order read.  `latency_ns` is the least delay from mid-exposure to
    arrival, `interval_ns` the usual one between frames.

    Device times are mapped to the machine's clock by the least delay seen, whatever clock they are of.  A
    source without them is believed as long as its frames come one by one: after a gap, frames may have
    waited in a queue, and none has a time until they come at the usual interval again."""

    def __init__(self, latency_ns: int, interval_ns: int) -> None:
        self._latency_ns = latency_ns
        self._clock = DeviceClock(latency_ns)
        self._tried: list[int | None] = []
        self.source: TimeSource | None = None
        """None until it has shown."""
        self._settled = 0
        self._interval_ns = interval_ns
        self._gaps_ns = deque([interval_ns], maxlen=_GAPS)
        self._arrival_ns: int | None = None
        self._in_step = False

    def of(self, device_ns: int | None, arrival_ns: int) -> int | None:
        """Mid-exposure of a frame in the machine's clock; None for one that must not be used: its time is not
        known, or not newer than the one before."""
        in_step = self._comes_in_step(arrival_ns)
        if self.source is None:
            self._tried.append(device_ns)
            if len(self._tried) == _TRIED:
                self.source = TimeSource.DEVICE if _go_on(self._tried) else TimeSource.ARRIVAL
            return None
        if self.source is TimeSource.ARRIVAL:
            return arrival_ns - self._latency_ns if in_step else None
        return None if device_ns is None else self._by_device(device_ns, arrival_ns)

    def _by_device(self, device_ns: int, arrival_ns: int) -> int | None:
        before_ns, begun = self._clock.offset_ns, self._clock.begun
        stamp_ns = self._clock.to_ours(device_ns, arrival_ns)
        offset_ns = self._clock.offset_ns
        if self._clock.begun != begun:  # opened, or opened again
            self._settled = 0
            return None
        if stamp_ns is None or self._settled >= _SETTLED:
            return stamp_ns
        falls = before_ns is None or offset_ns is None or offset_ns < before_ns - _FALL_NS
        self._settled = 0 if falls else self._settled + 1
        return None

    def _comes_in_step(self, arrival_ns: int) -> bool:
        """Whether the frame came as live ones do.  After a gap one that comes at the usual interval behind
        another does: none waited before it."""
        if self._arrival_ns is not None:
            gap_ns = arrival_ns - self._arrival_ns
            # no camera is faster than it was set to, one in the dark is slower
            usual_ns = max(self._interval_ns, statistics.median(self._gaps_ns))
            self._gaps_ns.append(gap_ns)
            self._in_step = _SOON * usual_ns <= gap_ns <= _LATE * usual_ns
        self._arrival_ns = arrival_ns
        return self._in_step


def _go_on(times_ns: list[int | None]) -> bool:
    """Whether they are times, each later than the one before."""
    known = [time for time in times_ns if time is not None]
    return len(known) == len(times_ns) and all(a < b for a, b in pairwise(known))
