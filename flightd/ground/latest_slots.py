"""One slot per topic, newest wins: what goes to one browser, however slowly it takes it."""

from __future__ import annotations

from typing import Generic, TypeVar

K = TypeVar("K")
V = TypeVar("V")


class LatestSlots(Generic[K, V]):
    """Holds the newest value of each topic until it is taken.  Who puts never waits; a value that is
    replaced before it was taken counts as dropped.  It never holds more than one value per topic."""

    def __init__(self) -> None:
        self._values: dict[K, V] = {}
        self.dropped = 0

    def put(self, topic: K, value: V) -> None:
        """Make this the topic's value; the topic keeps its turn."""
        if topic in self._values:
            self.dropped += 1
        self._values[topic] = value

    def forget(self, topic: K) -> None:
        """Nobody wants what is in this slot any more."""
        self._values.pop(topic, None)

    def topics(self) -> tuple[K, ...]:
        """The topics with a value that waits, longest first."""
        return tuple(self._values)

    def take(self) -> tuple[K, V] | None:
        """The value of the topic that waits longest; None where nothing waits."""
        topic = next(iter(self._values), None)
        return None if topic is None else (topic, self._values.pop(topic))

    def __contains__(self, topic: K) -> bool:
        return topic in self._values

    def __len__(self) -> int:
        return len(self._values)
