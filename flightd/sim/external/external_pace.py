"""Whether another simulator's clock runs as fast as ours."""

from __future__ import annotations

_WINDOW_NS = 5_000_000_000
_TOLERANCE = 0.15


class PaceMonitor:
    """Compares the time stamps of a simulator with their arrival, five seconds at a time."""

    def __init__(self) -> None:
        self._since: tuple[int, int] | None = None
        self._before = 1.0

    def observe(self, boot_ms: int, now_ns: int) -> float | None:
        """The simulator's seconds for each of ours at the end of the second window in a row in which they
        differ by more than 15 % to the same side (what a pause of ours holds up, the next window gets);
        else None."""
        if self._since is None or boot_ms < self._since[0]:
            self._since, self._before = (boot_ms, now_ns), 1.0
            return None
        elapsed_ns = now_ns - self._since[1]
        if elapsed_ns < _WINDOW_NS:
            return None
        pace = (boot_ms - self._since[0]) * 1e6 / elapsed_ns
        before, self._before = self._before, pace
        self._since = boot_ms, now_ns
        off = min(pace, before) > 1.0 + _TOLERANCE or max(pace, before) < 1.0 - _TOLERANCE
        return pace if off else None
