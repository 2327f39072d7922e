"""How often the autopilot's HEARTBEAT comes: so late, at worst, a take-over by the pilot is seen."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

BEATS_HZ = 20.0
"""What is asked for; an autopilot may deny it and go on at 1 Hz."""
BEATS_MIN_HZ = 10.0
"""At this rate a take-over is seen within 100 ms."""

_TOLERANCE = 0.9


class Beats:
    """Counts heartbeats by their arrival over a window."""

    def __init__(self, window_s: float) -> None:
        self._window_ns = round(window_s * 1e9)
        self._since_ns: int | None = None
        self._arrivals_ns: deque[int] = deque()

    def start(self, now_ns: int) -> None:
        """Count from now on."""
        self._since_ns = now_ns
        self._arrivals_ns.clear()

    def heard(self, now_ns: int) -> None:
        """One heartbeat arrived."""
        self._arrivals_ns.append(now_ns)
        while now_ns - self._arrivals_ns[0] > self._window_ns:
            self._arrivals_ns.popleft()

    def rate_hz(self, now_ns: int) -> float:
        """Heartbeats a second over the last window, NaN before it has passed."""
        if self._since_ns is None or now_ns - self._since_ns < self._window_ns:
            return math.nan
        return sum(now_ns - at_ns <= self._window_ns for at_ns in self._arrivals_ns) / self._window_ns * 1e9


@dataclass(frozen=True, slots=True)
class SlowHeartbeat:
    """What a rate means to the pilot: his take-over is seen by a heartbeat alone."""

    rate_hz: float

    @property
    def seen_after_s(self) -> float:
        """How late a take-over may be seen; infinite where no heartbeat comes."""
        return math.inf if self.rate_hz == 0.0 else 1.0 / self.rate_hz

    def __str__(self) -> str:
        late = f"up to {self.seen_after_s:.1f} s late" if math.isfinite(self.seen_after_s) else "not at all"
        told = f"{self.rate_hz:.1f} heartbeats a second instead of {BEATS_HZ:g}"
        return f"{told}: a take-over by the pilot is seen {late}"


def too_slow(rate_hz: float) -> SlowHeartbeat | None:
    """A measured rate that is not as it should be; None where it is, or is not known yet (NaN)."""
    return SlowHeartbeat(rate_hz) if rate_hz < _TOLERANCE * BEATS_MIN_HZ else None
