"""Places that were to be counted and have no answer: told, and looked at again where no picture came."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection

from flightd.core.types import Event, EventLevel
from flightd.mission.scan.node_scan import NoAnswer, ScanTask
from flightd.mission.scan.pending_findings import PendingFindings


class Unanswered:
    """Call `note` when a view of a node is over, `tell` when the flight is."""

    def __init__(self, pending: PendingFindings) -> None:
        self._pending = pending
        self._node_of: dict[str, str] = {}

    def begin(self) -> None:
        """Another flight looks at all of them anew."""
        self._node_of.clear()

    def note(self, task: ScanTask, now_ns: int, *, blind: bool) -> list[Event]:
        """What has no answer at a node when its last view is over; it is due again where that is for want of
        pictures, unless nothing is seen at any node any more (`blind`)."""
        if task.view is not None:
            return []
        open_now = task.drain_unanswered()
        self._node_of |= dict.fromkeys(open_now, task.node)
        whys = Counter(open_now.values())
        if whys[NoAnswer.NO_PICTURE] and not blind:
            self._pending.again(task.node)
        return [
            Event(
                now_ns,
                EventLevel.WARNING,
                "unanswered",
                f"{count} places at {task.node} have no answer: {why.value}",
            )
            for why, count in whys.items()
            if why is not NoAnswer.NOT_REACHED  # told already
        ]

    def tell(self, done: Collection[str], now_ns: int) -> list[Event]:
        """What has no answer at the end."""
        left = {place: node for place, node in self._node_of.items() if place not in done}
        if not left:
            return []
        nodes = ", ".join(dict.fromkeys(left.values()))
        text = f"{len(left)} places that were to be counted have no answer, at {nodes}"
        return [Event(now_ns, EventLevel.WARNING, "unanswered", text)]
