"""Which of the commands that a drone tells of were given for its manager: all others are a person's."""

from __future__ import annotations

from collections import deque
from typing import Final

from flightd.adapters.ground_link.messages.published import EventReport

_TAKES_NS: Final = 10_000_000_000
"""By the drone's own clock: a command that did not take effect by then never reached it."""
_MOST: Final = 32


class SentCommands:
    """`note` each as it is given; `take` says of one that the drone tells of whether it was one of them."""

    def __init__(self) -> None:
        self._sent: deque[tuple[str, int]] = deque(maxlen=_MOST)

    def note(self, text: str, stamp_ns: int) -> None:
        """It is given, by a status of this time."""
        self._sent.append((text, stamp_ns))

    def refused(self, text: str) -> None:
        """The newest one of these has no effect."""
        found = next((one for one in reversed(self._sent) if one[0] == text), None)
        if found is not None:
            self._sent.remove(found)

    def take(self, event: EventReport) -> bool:
        """Whether a command is one of those: each is told of once."""
        for one in self._sent:
            if one[0] == event.text and event.stamp_ns - one[1] <= _TAKES_NS:
                self._sent.remove(one)
                return True
        return False

    def clear(self) -> None:
        """The drone was started anew."""
        self._sent.clear()
