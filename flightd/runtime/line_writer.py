"""Lines for a stream that may not take them now: nobody waits for it but a thread."""

from __future__ import annotations

import contextlib
import queue
import threading
from typing import TextIO

_MOST_LINES = 1000
_CLOSE_S = 1.0


class LineWriter:
    """`write` takes a piece of text at once; what does not fit before a stream that stands still is lost, and
    counted.

    Where a stream is a pipe or a socket (systemd's journal), its reader decides when it takes more: the
    control loop must not wait for that.
    """

    def __init__(self, out: TextIO, most: int = _MOST_LINES) -> None:
        self._out = out
        self._waiting: queue.Queue[str | None] = queue.Queue(most)
        self._thread = threading.Thread(target=self._run, name="lines", daemon=True)
        self._thread.start()
        self.lost = 0

    def write(self, text: str) -> int:
        """Hand over; the length, as streams do."""
        try:
            self._waiting.put_nowait(text)
        except queue.Full:
            self.lost += 1
        return len(text)

    def flush(self) -> None:
        """As streams have it: each piece is flushed as it is written."""

    def close(self) -> None:
        """Give the stream a second to take what waits."""
        with contextlib.suppress(queue.Full):
            self._waiting.put_nowait(None)
        self._thread.join(_CLOSE_S)

    def _run(self) -> None:
        while (text := self._waiting.get()) is not None:
            with contextlib.suppress(OSError, ValueError):  # nobody reads any more, or it is closed
                self._out.write(text)
                self._out.flush()
