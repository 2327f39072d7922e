"""The newest lines of the daemon's log and its events, kept in memory for who looks after it."""

from __future__ import annotations

import logging
from collections import deque
from datetime import UTC, datetime

from flightd.core.snapshot import Snapshot
from flightd.core.types import Event

_KEPT = 200
_LONGEST = 400


class RecentLog(logging.Handler):
    """`logging.Handler` and `ports.Monitor`; any thread may log."""

    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self._lines: deque[str] = deque(maxlen=_KEPT)

    @property
    def lines(self) -> tuple[str, ...]:
        """Oldest first: time in UTC, level, text."""
        return tuple(self._lines.copy())

    def emit(self, record: logging.LogRecord) -> None:
        try:
            text = record.getMessage()
        except (TypeError, ValueError):  # its arguments do not fit: the other handlers say so
            text = str(record.msg)
        self._keep(record.levelname.lower(), text)

    def tell(self, snapshot: Snapshot) -> None:
        """The status is not a line of the log."""

    def event(self, event: Event) -> None:
        self._keep(event.level.value, f"{event.name}: {event.text}")

    def over(self) -> None:
        """It goes on taking what is logged."""

    def _keep(self, level: str, text: str) -> None:
        line = f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ} {level} {' '.join(text.split())}"
        self._lines.append(line[:_LONGEST])
