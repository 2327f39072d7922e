"""The autopilot's clock against ours, by TIMESYNC round trips."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

_WINDOW = 16
_PLAUSIBLE_ROUND_TRIP_NS = 500_000_000
_JUMP_NS = 500_000_000


@dataclass(frozen=True, slots=True)
class _Sample:
    offset_ns: int
    round_trip_ns: int


class ClockSync:
    """Offset of the autopilot's clock (its time minus ours).

    Of the last round trips the fastest one counts: its asymmetry is at most half its length.  At one
    trip a second the window is short enough for crystals that drift by 50 ppm (0.8 ms).
    """

    def __init__(self) -> None:
        self._samples: deque[_Sample] = deque(maxlen=_WINDOW)
        self._asked: deque[int] = deque(maxlen=_WINDOW)
        self._offset_ns: int | None = None

    @property
    def offset_ns(self) -> int | None:
        """None until a first answer came."""
        return self._offset_ns

    @property
    def is_settled(self) -> bool:
        return len(self._samples) >= _WINDOW // 2

    def reset(self) -> None:
        """The other clock started anew."""
        self._samples.clear()
        self._asked.clear()
        self._offset_ns = None

    def ask(self, now_ns: int) -> int:
        """The time stamp of a new question."""
        self._asked.append(now_ns)
        return now_ns

    def answered(self, ts1_ns: int, tc1_ns: int, now_ns: int) -> bool:
        """Take an answer; False when we did not ask (another client's answer, a late or forged one)."""
        round_trip_ns = now_ns - ts1_ns
        if ts1_ns not in self._asked or not 0 <= round_trip_ns <= _PLAUSIBLE_ROUND_TRIP_NS:
            return False
        self._asked.remove(ts1_ns)
        sample = _Sample(tc1_ns - ts1_ns - round_trip_ns // 2, round_trip_ns)
        known = self._offset_ns
        if known is not None and abs(sample.offset_ns - known) > _JUMP_NS:
            self._samples.clear()
        self._samples.append(sample)
        self._offset_ns = min(self._samples, key=lambda kept: kept.round_trip_ns).offset_ns
        return True

    def to_ours(self, theirs_ns: int) -> int | None:
        """Our time of a stamp of theirs; None while the offset is unknown."""
        return None if self._offset_ns is None else theirs_ns - self._offset_ns
