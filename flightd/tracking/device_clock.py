"""From a device's own time stamps to ours, by the least delay ever seen."""

from __future__ import annotations

_DRIFT = 300e-6
"""No two crystals drift apart by more than this, the encoder's of a cheap camera included.  If less were
allowed, frames would grow older without end; ten seconds of a congested path cost 3 ms."""
_LEAP_NS = 15_000_000
"""A message that comes sooner than any before by more than this came by a path that has grown faster, or has
a wrong stamp."""
_CONFIRMED, _LATELY = 3, 10
"""It is the path where so many of so many messages come so."""
_ANEW = 3
"""So many messages in a row, in order among themselves, are no stragglers: the device counts anew."""
_ANEW_NS = 500_000_000
"""And nothing came in order for so long before: a device takes that long to start."""


class DeviceClock:
    """Maps stamps of a foreign clock into ours.

    The messages of a stream arrive late by a constant least delay plus jitter that is never negative.
    The smallest (arrival - stamp) is therefore the clocks' offset plus that delay, `latency_ns`, which
    has to be known; it may creep up again by the clocks' drift.  A lone stamp that is ahead of its time
    moves nothing; each of the first messages is believed until others contradict it.
    """

    def __init__(self, latency_ns: int) -> None:
        self._latency_ns = latency_ns
        self._offset_ns: int | None = None
        self._newest_ns = self._in_order_ns = 0
        self._anew_ns = 0
        self._anew = 0
        self._count = self._begun = 0
        self._sooner: list[tuple[int, int, int]] = []
        """Messages that came sooner by a leap: number, stamp, offset."""
        self._others: list[int] | None = None
        """Offsets of what followed the first message, or the soonest of the first, as long as none agrees."""

    def to_ours(self, device_ns: int, arrival_ns: int) -> int | None:
        """Our time of `device_ns`, heard of at `arrival_ns`.

        None for a message that is not newer than the one before: it comes out of order, and who flies by it
        flies by the past.  Where that goes on, the device counts anew, and so does this.  None, too, for a
        stamp ahead of its time as long as no others confirm it.
        """
        offset = arrival_ns - device_ns
        self._count += 1
        if self._offset_ns is None or (
            device_ns <= self._newest_ns and self._counts_anew(device_ns, arrival_ns)
        ):
            self._offset_ns, self._sooner, self._others = offset, [], []
            self._begun = self._count
        elif device_ns <= self._newest_ns:
            return None
        else:
            crept = self._offset_ns + round((device_ns - self._newest_ns) * _DRIFT)
            if offset < crept - _LEAP_NS and self._count - self._begun < _LATELY:
                self._offset_ns, self._others = offset, []  # at first many come late
            elif offset < crept - _LEAP_NS:
                confirmed = self._confirmed(device_ns, offset)
                if confirmed is None:
                    return None
                self._offset_ns = confirmed
            else:
                self._offset_ns = self._first_doubted(crept, offset) or min(crept, offset)
        self._newest_ns, self._in_order_ns, self._anew = device_ns, arrival_ns, 0
        return min(device_ns + self._offset_ns, arrival_ns) - self._latency_ns

    @property
    def offset_ns(self) -> int | None:
        """Our time less the device's, the path's least delay included; None before the first message."""
        return self._offset_ns

    @property
    def begun(self) -> int:
        """The number of the message with which the device's count began, the last time that it did."""
        return self._begun

    def _confirmed(self, device_ns: int, offset: int) -> int | None:
        """The offset of a path that has grown faster; None as long as this may be a wrong stamp."""
        lately = [one for one in self._sooner if one[0] > self._count - _LATELY and one[1] < device_ns]
        lately = [*lately, (self._count, device_ns, offset)][-_CONFIRMED:]
        self._sooner = lately
        if len(lately) < _CONFIRMED:
            return None
        self._others = None
        return max(one[2] for one in lately)

    def _first_doubted(self, crept: int, offset: int) -> int | None:
        """The least offset of what followed the first message, once that plainly had a wrong stamp."""
        if self._others is None:
            return None
        if offset <= crept + _LEAP_NS:
            self._others = None
            return None
        self._others.append(offset)
        if len(self._others) < _LATELY:
            return None
        least, self._others = min(self._others), None
        return least

    def _counts_anew(self, device_ns: int, arrival_ns: int) -> bool:
        self._anew = self._anew + 1 if self._anew and device_ns > self._anew_ns else 1
        self._anew_ns = device_ns
        return self._anew >= _ANEW and arrival_ns - self._in_order_ns >= _ANEW_NS
