"""Between the station's loop and the thread that serves Foxglove: one slot for each topic, newest wins."""

from __future__ import annotations

import threading
from collections.abc import Hashable
from typing import Any

from flightd.ground.latest_slots import LatestSlots


class Mailbox:
    """Any thread puts and never waits; one takes.  What is replaced before it was taken is counted."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._slots: LatestSlots[Hashable, Any] = LatestSlots()
        self._changed = threading.Event()
        self._closed = False

    def put(self, slot: Hashable, value: Any) -> None:
        """Make this the newest value."""
        with self._lock:
            self._slots.put(slot, value)
        self._changed.set()

    def take(self) -> tuple[Hashable, Any] | None:
        """What waits longest, waiting for it; None once it is closed."""
        while True:
            with self._lock:
                if self._closed:
                    return None
                taken = self._slots.take()
                if taken is not None:
                    return taken
                self._changed.clear()
            self._changed.wait()

    def holds(self, slot: Hashable) -> bool:
        """A value waits in this slot."""
        with self._lock:
            return slot in self._slots

    def close(self) -> None:
        """Nothing is taken any more."""
        with self._lock:
            self._closed = True
        self._changed.set()

    @property
    def dropped(self) -> int:
        """Values that were replaced before they were taken."""
        return self._slots.dropped
