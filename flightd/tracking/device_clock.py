"""From a device's own time stamps to ours, by the least delay ever seen."""

from __future__ import annotations

_DRIFT = 300e-6
"""No two crystals drift apart by more than this, the encoder's of a cheap camera included.  If less were
allowed, frames would grow older without end; ten seconds of a congested path cost 3 ms."""
_ANEW = 3
"""So many messages in a row, in order among themselves, are no stragglers: the device counts anew."""
_ANEW_NS = 500_000_000
"""And nothing came in order for so long before: a device takes that long to start."""


class DeviceClock:
    """Maps stamps of a foreign clock into ours.

    The messages of a stream arrive late by a constant least delay plus jitter that is never negative.
    The smallest (arrival - stamp) is therefore the clocks' offset plus that delay, `latency_ns`, which
    has to be known; it may creep up again by the clocks' drift.
    """

    def __init__(self, latency_ns: int) -> None:
        self._latency_ns = latency_ns
        self._offset_ns: int | None = None
        self._newest_ns = self._in_order_ns = 0
        self._anew_ns = 0
        self._anew = 0

    def to_ours(self, device_ns: int, arrival_ns: int) -> int | None:
        """Our time of `device_ns`, heard of at `arrival_ns`.

        None for a message that is not newer than the one before: it comes out of order, and who flies by it
        flies by the past.  Where that goes on, the device counts anew, and so does this.
        """
        offset = arrival_ns - device_ns
        if self._offset_ns is None or (
            device_ns <= self._newest_ns and self._counts_anew(device_ns, arrival_ns)
        ):
            self._offset_ns = offset
        elif device_ns <= self._newest_ns:
            return None
        else:
            crept = self._offset_ns + round((device_ns - self._newest_ns) * _DRIFT)
            self._offset_ns = min(crept, offset)
        self._newest_ns, self._in_order_ns, self._anew = device_ns, arrival_ns, 0
        return device_ns + self._offset_ns - self._latency_ns

    @property
    def offset_ns(self) -> int | None:
        """Our time less the device's, the path's least delay included; None before the first message."""
        return self._offset_ns

    def _counts_anew(self, device_ns: int, arrival_ns: int) -> bool:
        self._anew = self._anew + 1 if self._anew and device_ns > self._anew_ns else 1
        self._anew_ns = device_ns
        return self._anew >= _ANEW and arrival_ns - self._in_order_ns >= _ANEW_NS
