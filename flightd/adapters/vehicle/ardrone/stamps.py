"""The drone's clocks, seen through a radio whose delay varies."""

from __future__ import annotations

_DRIFT_PPM = 200
_RESTART_NS = 1_000_000_000


class RemoteClock:
    """Turns stamps of a counter that runs elsewhere and wraps into our monotonic nanoseconds.

    The least delay seen is taken for the link's constant one, and let grow by the drift two crystals may
    have; a counter that leaps by more than a second has been restarted.  Stamps never lie in the future
    of their arrival.
    """

    def __init__(self, wrap_ns: int) -> None:
        self._wrap_ns = wrap_ns
        self._last_ns: int | None = None
        self._turns = 0
        self._offset_ns = 0
        self._arrival_ns = 0

    def stamp_ns(self, remote_ns: int, arrival_ns: int) -> int:
        """When what the counter stamped `remote_ns` and arrived now was true, less the constant delay."""
        if self._last_ns is not None and remote_ns < self._last_ns - self._wrap_ns // 2:
            self._turns += 1
        unwrapped_ns = remote_ns + self._turns * self._wrap_ns
        offset_ns = arrival_ns - unwrapped_ns
        if self._last_ns is None or abs(offset_ns - self._offset_ns) > _RESTART_NS:
            self._turns = 0
            unwrapped_ns = remote_ns
            self._offset_ns = arrival_ns - remote_ns
        else:
            drift_ns = (arrival_ns - self._arrival_ns) * _DRIFT_PPM // 1_000_000
            self._offset_ns = min(offset_ns, self._offset_ns + drift_ns)
        self._last_ns, self._arrival_ns = remote_ns, arrival_ns
        return unwrapped_ns + self._offset_ns
