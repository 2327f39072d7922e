"""How often the autopilot's HEARTBEAT comes: so late, at worst, a take-over by the pilot is seen.

PX4 denies any other rate than 1 Hz, but sends one whenever it is asked for one (REQUEST_MESSAGE).
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

BEATS_HZ = 20.0
"""What is asked for; an autopilot may deny it and go on at 1 Hz."""
BEATS_MIN_HZ = 10.0
"""At this rate a take-over is seen within 100 ms."""

_TOLERANCE = 0.9
_POLL_NS, _POLL_SELDOM_NS = 60_000_000, 250_000_000
"""A heartbeat is asked for when the last is so old; of an autopilot that is silent less often."""
_POLL_SILENT_NS = 2_000_000_000
_POLL_REFUSED_NS = 30_000_000_000


class Beats:
    """Counts heartbeats by their arrival over a window."""

    def __init__(self, window_s: float) -> None:
        self._window_ns = round(window_s * 1e9)
        self._since_ns: int | None = None
        self._arrivals_ns: deque[int] = deque()

    @property
    def newest_ns(self) -> int:
        """When the newest came that was counted; 0 before one was."""
        return self._arrivals_ns[-1] if self._arrivals_ns else 0

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


class BeatPoll:
    """Asks for the next heartbeat where it does not come by itself."""

    LOOK_S = 0.01

    def __init__(self) -> None:
        self._asked_ns = 0
        self._refused_ns: int | None = None

    def is_due(self, now_ns: int, heartbeat_ns: int) -> bool:
        """Whether to ask now, the newest heartbeat having come at `heartbeat_ns`; then it has been."""
        silent_ns = now_ns - heartbeat_ns
        if self._refused_ns is not None and now_ns - self._refused_ns < _POLL_REFUSED_NS:
            return False
        pause_ns = _POLL_NS if silent_ns < _POLL_SILENT_NS else _POLL_SELDOM_NS
        if silent_ns < _POLL_NS or now_ns - self._asked_ns < pause_ns:
            return False
        self._asked_ns = now_ns
        return True

    def refused(self, now_ns: int) -> None:
        """The autopilot does not know how to send one on request: no more for a while."""
        self._refused_ns = now_ns


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
