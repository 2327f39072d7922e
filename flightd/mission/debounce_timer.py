"""For how long a condition has held.  Pure."""

from __future__ import annotations


class DebounceTimer:
    """For how long something has held without a break."""

    def __init__(self) -> None:
        self._since_ns: int | None = None

    def step(self, condition: bool, now_ns: int) -> float:
        """Seconds for which `condition` has held; 0 while it does not."""
        if not condition:
            self._since_ns = None
            return 0.0
        if self._since_ns is None:
            self._since_ns = now_ns
        return (now_ns - self._since_ns) * 1e-9
