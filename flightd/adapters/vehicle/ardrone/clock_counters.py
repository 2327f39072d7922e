"""The drone's clocks: counters that wrap."""

from __future__ import annotations


class WrappingCounter:
    """Turns a counter that wraps at `wrap` into one that goes on; a smaller leap back is a restart."""

    def __init__(self, wrap: int) -> None:
        self._wrap = wrap
        self._last = 0
        self._turns = 0

    def unwrap(self, value: int) -> int:
        """`value` counted on through all wraps so far."""
        if value < self._last:
            self._turns = self._turns + 1 if self._last - value > self._wrap // 2 else 0
        self._last = value
        return value + self._turns * self._wrap
