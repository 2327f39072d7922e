"""From a device's own time stamps to ours, by the least delay ever seen."""

from __future__ import annotations

_DRIFT = 50e-6
"""Two cheap crystals drift apart by less than this."""


class DeviceClock:
    """Maps stamps of a foreign clock into ours.

    The messages of a stream arrive late by a constant least delay plus jitter that is never negative.
    The smallest (arrival - stamp) is therefore the clocks' offset plus that delay, `latency_ns`, which
    has to be known; it may creep up again by the clocks' drift.
    """

    def __init__(self, latency_ns: int) -> None:
        self._latency_ns = latency_ns
        self._offset_ns: int | None = None
        self._last_ns = 0

    def to_ours(self, device_ns: int, arrival_ns: int) -> int:
        """Our time of `device_ns`, heard of at `arrival_ns`; a clock that jumped back starts anew."""
        offset = arrival_ns - device_ns
        if self._offset_ns is None or device_ns < self._last_ns:
            self._offset_ns = offset
        else:
            crept = self._offset_ns + round((device_ns - self._last_ns) * _DRIFT)
            self._offset_ns = min(crept, offset)
        self._last_ns = device_ns
        return device_ns + self._offset_ns - self._latency_ns
