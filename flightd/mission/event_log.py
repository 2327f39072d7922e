"""What a mission reports: its events.  Pure."""

from __future__ import annotations

from flightd.core.outlook import HazardSeen
from flightd.core.types import Event, EventLevel
from flightd.mission.triggers import Trigger

_AGAIN_S = 1.0
"""A hazard that was away for longer is reported anew."""


class EventLog:
    """Events in the order in which they happened, until they are drained."""

    def __init__(self) -> None:
        self._events: list[Event] = []
        self._hazards: dict[Trigger, int] = {}
        self._seen: dict[Trigger, HazardSeen] = {}

    def report(self, now_ns: int, level: EventLevel, name: str, text: str) -> None:
        self._events.append(Event(now_ns, level, name, text))

    def hazard(self, now_ns: int, trigger: Trigger, action: str) -> None:
        """Report once that a hazard was found, however long it lasts."""
        last_ns = self._hazards.get(trigger)
        self._hazards[trigger] = now_ns
        if last_ns is None or (now_ns - last_ns) * 1e-9 > _AGAIN_S:
            self.report(now_ns, EventLevel.WARNING, "hazard", f"{trigger.value}: {action}")
            self._seen[trigger] = HazardSeen(trigger.value, action, now_ns)

    def hazards(self, now_ns: int) -> tuple[HazardSeen, ...]:
        """The hazards that hold, or held within the last second, in the order of their beginning."""
        return tuple(
            seen
            for trigger, seen in self._seen.items()
            if (now_ns - self._hazards[trigger]) * 1e-9 <= _AGAIN_S
        )

    def drain(self) -> tuple[Event, ...]:
        """The events since the last call, oldest first."""
        events, self._events = tuple(self._events), []
        return events
