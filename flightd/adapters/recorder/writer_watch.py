"""How the process that writes the flight log does, by what is heard of it and when."""

from __future__ import annotations

HUNG_S = 6.0
"""It tells once a second what it has written: silent for so long it hangs, or its disk does."""
_BEGINS_S = 60.0
"""A new one looks through the whole log before it tells anything."""
_DIES_S = 2.0
"""One that has been killed for so long waits for a disk that does not answer."""
_NEWS_S = 3.0
"""So long after a message that found no room the log counts as not written."""


class WriterWatch:
    """Call `begin`, `hear`, `kill` and `refuse` as it happens; all times are of one clock, s."""

    def __init__(self, hung_s: float = HUNG_S) -> None:
        self._hung_s = hung_s
        self._silent_until_s = float("inf")
        self._killed_s: float | None = None
        self._refused_s: float | None = None

    def begin(self, now_s: float) -> None:
        """A writing process was started."""
        self._silent_until_s, self._killed_s = now_s + max(_BEGINS_S, self._hung_s), None

    def hear(self, now_s: float) -> None:
        """It told what it has written."""
        self._silent_until_s = now_s + self._hung_s

    def kill(self, now_s: float) -> None:
        """It was killed."""
        self._silent_until_s, self._killed_s = float("inf"), now_s

    def refuse(self, now_s: float) -> None:
        """A message found no room in the queue."""
        self._refused_s = now_s

    def hangs(self, now_s: float) -> bool:
        """It has to be killed."""
        return now_s > self._silent_until_s

    @property
    def was_killed(self) -> bool:
        """It was killed, and no other one has been started since."""
        return self._killed_s is not None

    def trouble(self, now_s: float) -> str:
        """Why the log is not written, "" while it is."""
        if self._killed_s is not None and now_s - self._killed_s > _DIES_S:
            return "the disk does not answer"
        if self._refused_s is not None and now_s - self._refused_s < _NEWS_S:
            return "the disk takes less than is recorded"
        return ""
