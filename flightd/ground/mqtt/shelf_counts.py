"""The counts that an order asks for (scanShelf): the drone counts at the node where it stops, by its plan."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

from flightd.adapters.ground_link.messages.published import EventReport, StatusReport
from flightd.core.errors import FlightdError
from flightd.fleet.vda5050.order import Order
from flightd.fleet.vda5050.parts import Action
from flightd.fleet.vda5050.state import ActionStatus
from flightd.fleet.vehicle.abilities import ScanShelf, scan_shelf_of
from flightd.fleet.vehicle.signals import Progress
from flightd.ground.drone_link import DroneLink
from flightd.ground.mqtt.order_flight import WAITS
from flightd.ground.mqtt.safe_return import Standing

_MOST_VISITS = 32


@dataclass(slots=True)
class _Count:
    """One that goes on at the node where the drone is, since this time of the drone's clock."""

    action: Action
    scan: ScanShelf
    node: str
    since_ns: int
    held: bool = False
    seen: bool = False
    """The visit is over; what was counted is being asked for."""


class ShelfCounts:
    """Those that go on.  A count is over when its node was visited."""

    def __init__(self) -> None:
        self._counts: dict[str, _Count] = {}
        self._visits: deque[EventReport] = deque(maxlen=_MOST_VISITS)
        self.levels: tuple[int, ...] = ()
        """Those that are counted on this flight; none: all."""

    @property
    def go_on(self) -> bool:
        """One goes on that a pause would interrupt."""
        return any(not count.held and not count.seen for count in self._counts.values())

    def begin(
        self, action: Action, node: str, status: StatusReport, standing: Standing | None
    ) -> Progress | None:
        """Begin one at `node`; what is to be told where it cannot be done."""
        scan = scan_shelf_of(action)
        in_flight = status.phase not in WAITS
        if standing is not None and not standing.counts:
            return Progress(action.action_id, ActionStatus.FAILED, "this drone counts no shelves")
        if in_flight and self.levels and not {*scan.levels} <= {*self.levels}:
            levels = ", ".join(map(str, self.levels))
            what = f"this flight began with level {levels} and counts no other"
            return Progress(action.action_id, ActionStatus.FAILED, what)
        self._counts[action.action_id] = _Count(action, scan, node, status.stamp_ns)
        return None

    def abort(self, action_id: str) -> None:
        """It is left off: the drone counts on, nobody waits for it."""
        self._counts.pop(action_id, None)

    def hold(self, action_id: str, held: bool) -> None:
        """It is paused, or goes on."""
        if action_id in self._counts:
            self._counts[action_id].held = held

    def note_visit(self, event: EventReport) -> None:
        """A node was visited."""
        self._visits.append(event)

    def over(self) -> list[str]:
        """The ids of those that are over and were not asked for before."""
        found = []
        for action_id, count in self._counts.items():
            visits = (one for one in self._visits if one.text == count.node)
            if not count.seen and any(one.stamp_ns > count.since_ns for one in visits):
                count.seen = True
                found.append(action_id)
        return found

    async def results(self, over: Iterable[str], link: DroneLink) -> list[Progress]:
        """What was counted, as far as the drone tells it."""
        try:
            rows = await link.inventory()
        except FlightdError:
            rows = ()
        told = []
        for action_id in over:
            count = self._counts.pop(action_id, None)
            if count is not None:
                result = counted_in_words(rows, count.node, count.scan.expected)
                told.append(Progress(action_id, ActionStatus.FINISHED, result))
        return told


def levels_of(order: Order | None, nodes: Iterable[str]) -> tuple[int, ...]:
    """The levels that all counts of an order ask for, where one of them is at these nodes; none: all."""
    scans = {
        (node.node_id, tuple(sorted(scan_shelf_of(action).levels)))
        for node in (order.nodes if order else ())
        for action in node.actions
    }
    levels = {levels for _, levels in scans}
    return next(iter(levels)) if len(levels) == 1 and {node for node, _ in scans} & {*nodes} else ()


def counted_in_words(
    rows: Iterable[dict[str, str]], node: str, expected: tuple[str, ...] | None
) -> str | None:
    """What was counted at a node, for a scanShelf's result; None where the drone tells nothing."""
    here = [row for row in rows if row.get("node") == node]
    if not here:
        return None
    read = [row["texts"] for row in here if row.get("texts")]
    told = f"{len(read)} of {len(here)} places with codes"
    missing = [code for code in expected or () if not any(code in text.split(" ") for text in read)]
    return f"{told}; not read: {', '.join(missing)}" if missing else told
