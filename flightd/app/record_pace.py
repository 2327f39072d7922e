"""How densely the log is written: all of a flight, little of a drone that stands and waits for hours."""

from __future__ import annotations

from types import MappingProxyType

from flightd.core.snapshot import Snapshot
from flightd.core.topics import Topic
from flightd.core.types import WAITING

_WHOLE_NS = 60_000_000_000
"""So long all of a wait is kept, anew after each command: most flights are replayed from their first tick."""

_PERIODS_NS = MappingProxyType(
    {Topic.TICK: 1_000_000_000, Topic.STATUS: 1_000_000_000, Topic.FRAME: 10_000_000_000}
)


class RecordPace:
    """`take` hears of every tick; `due` says whether what comes at its own rate goes into the log now.

    A drone that waits on the ground would fill the disk in a day, and its flights would be removed for that.
    From the tick on in which it is to arm, everything is kept."""

    def __init__(self) -> None:
        self._waits_since_ns: int | None = None
        self._idle = False
        self._kept_ns: dict[Topic, int] = {}
        self._sees = False

    def take(self, snapshot: Snapshot) -> None:
        """The newest tick, before it is recorded itself."""
        now_ns, vehicle = snapshot.stamp_ns, snapshot.vehicle
        armed = vehicle is not None and vehicle.armed
        if snapshot.phase not in WAITING or armed:
            self._waits_since_ns = None
        elif self._waits_since_ns is None or snapshot.tick.commands:
            self._waits_since_ns = now_ns
        self._sees = bool(snapshot.tick.lines)
        since_ns = self._waits_since_ns
        self._idle = since_ns is not None and now_ns - since_ns >= _WHOLE_NS

    def due(self, topic: Topic, stamp_ns: int) -> bool:
        """Whether a message of that topic is kept; it counts as kept then."""
        kept_ns, period_ns = self._kept_ns.get(topic), _PERIODS_NS[topic]
        if topic is Topic.TICK and not self._sees:  # one that sees first: a replay starts by how fresh it is
            period_ns *= 2
        if self._idle and kept_ns is not None and 0 <= stamp_ns - kept_ns < period_ns:
            return False
        self._kept_ns[topic] = stamp_ns
        return True
