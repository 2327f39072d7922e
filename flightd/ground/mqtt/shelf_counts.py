"""The counts that an order asks for (scanShelf): the drone counts at each node what it was told to there."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

from flightd.adapters.ground_link.messages.counts import Counts, NodeCount
from flightd.adapters.ground_link.messages.published import EventReport, StatusReport
from flightd.core.errors import FlightdError, InputError
from flightd.core.told_codes import codes_of
from flightd.fleet.vda5050.order import Order
from flightd.fleet.vda5050.parts import Action
from flightd.fleet.vda5050.state import ActionStatus
from flightd.fleet.vehicle.abilities import ScanShelf, scan_shelf_of, shelf_of
from flightd.fleet.vehicle.signals import Progress
from flightd.ground.drone_link import DroneLink
from flightd.ground.mqtt.order_flight import WAITS
from flightd.ground.mqtt.safe_return import Standing

_MOST_VISITS = 32
_AGAIN_S = 2.0
_MOST_ASKED = 10
"""A drone that has not told by then what it counted does not tell."""


@dataclass(slots=True)
class _Count:
    """One that goes on at the node where the drone is, since this time of the drone's clock (None: the drone
    was not told to count it by then)."""

    action: Action
    scan: ScanShelf
    node: str
    since_ns: int | None
    held: bool = False
    seen: bool = False
    """The visit is over; what was counted is asked for."""


class ShelfCounts:
    """Those that go on.  A count is over when its node was visited."""

    def __init__(self) -> None:
        self._counts: dict[str, _Count] = {}
        self._asked_at_s = -math.inf
        self._asked_in_vain = 0
        self._visits: deque[EventReport] = deque(maxlen=_MOST_VISITS)
        self.wanted: Counts = None
        """What the order wants counted, by the last step; None for a drone that is not told so."""
        self.given: tuple[NodeCount, ...] = ()
        """What the drone was told to count on this flight."""
        self.levels: tuple[int, ...] = ()
        """Those that one of before, which is not told so, counts on this flight; none: all."""

    @property
    def go_on(self) -> bool:
        """One goes on that a pause would interrupt."""
        return any(not count.held and not count.seen for count in self._counts.values())

    def begin(
        self, action: Action, node: str, status: StatusReport, standing: Standing | None, *, tells: bool
    ) -> Progress | None:
        """Begin one at `node`; what is to be told where it cannot be done.  Not `tells`: the drone counts
        all on the levels of its flight, and is told nothing."""
        scan = scan_shelf_of(action)
        if standing is not None and not standing.counts:
            return Progress(action.action_id, ActionStatus.FAILED, "this drone counts no shelves")
        is_flown = self.levels and not tells and status.phase not in WAITS
        if is_flown and not (scan.levels and {*scan.levels} <= {*self.levels}):
            levels = ", ".join(map(str, self.levels))
            what = f"this flight began with level {levels} and counts no other"
            return Progress(action.action_id, ActionStatus.FAILED, what)
        is_told = not tells or count_of(node, scan) in self.given
        since_ns = status.stamp_ns if is_told else None
        self._counts[action.action_id] = _Count(action, scan, node, since_ns)
        return None

    def tell(self, counts: Counts, nodes: Collection[str] | None, stamp_ns: int) -> None:
        """The drone took this, all that it is to count at `nodes` (None: on its whole flight), by then."""
        kept = () if nodes is None else (one for one in self.given if one.node not in nodes)
        self.given = (*kept, *(counts or ()))
        for count in self._counts.values():
            if count.since_ns is None and count_of(count.node, count.scan) in self.given:
                count.since_ns = stamp_ns

    def forget(self, node: str) -> None:
        """The drone refused what it had taken of this node."""
        self.given = tuple(one for one in self.given if one.node != node)
        for count in self._counts.values():
            count.since_ns = None if count.node == node else count.since_ns

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

    def over(self, now_s: float) -> list[str]:
        """The ids of those that are over and of which the drone is to be asked now."""
        for count in self._counts.values():
            since_ns = math.inf if count.since_ns is None else count.since_ns
            visits = (one for one in self._visits if one.text == count.node)
            count.seen |= any(one.stamp_ns > since_ns for one in visits)
        if self._asked_in_vain and now_s - self._asked_at_s < _AGAIN_S:
            return []
        return [action_id for action_id, count in self._counts.items() if count.seen]

    async def results(self, over: Iterable[str], link: DroneLink, now_s: float) -> list[Progress]:
        """What was counted; nothing where the drone is to be asked again."""
        self._asked_at_s = now_s
        rows: tuple[dict[str, str], ...] = ()
        failure = ""
        self._asked_in_vain += 1
        try:
            rows = await link.inventory()
        except InputError:
            pass  # it keeps no inventory
        except FlightdError as err:
            if self._asked_in_vain < _MOST_ASKED:
                return []
            failure = f"the drone does not tell what it counted: {err}"
        self._asked_in_vain = 0
        told = []
        for action_id in over:
            count = self._counts.pop(action_id, None)
            if count is None:
                continue  # it was left off meanwhile
            if failure:
                told.append(Progress(action_id, ActionStatus.FAILED, failure))
            else:
                result = counted_in_words(rows, count.node, count.scan)
                told.append(Progress(action_id, ActionStatus.FINISHED, result))
        return told


def counts_of(actions: Mapping[str, Iterable[Action]]) -> tuple[NodeCount, ...]:
    """All that the actions at these nodes ask to be counted."""
    found = [count_of(node, shelf_of(action)) for node, here in actions.items() for action in here]
    return tuple(dict.fromkeys(found))


def levels_of(order: Order | None, nodes: Iterable[str]) -> tuple[int, ...]:
    """The levels that all counts of an order ask for, where one of them is at these nodes; none: all.  For a
    drone that is told no more."""
    told = order.nodes if order else ()
    counts = counts_of({node.node_id: node.actions for node in told})
    levels = {one.levels for one in counts}
    return next(iter(levels)) if len(levels) == 1 and {one.node for one in counts} & {*nodes} else ()


def count_of(node: str, scan: ScanShelf) -> NodeCount:
    """What is to be counted at a node, as the drone is told."""
    return NodeCount(node, "" if scan.side is None else scan.side.value, tuple(sorted(scan.levels)))


def counted_in_words(rows: Iterable[dict[str, str]], node: str, scan: ScanShelf) -> str | None:
    """What was counted at a node of what is asked for, for a scanShelf's result; None where the drone tells
    nothing."""
    here = [row for row in rows if row.get("node") == node and _is_asked(row, scan)]
    if not here:
        return None
    read = [codes for row in here if (codes := codes_of(row))]
    told = f"{len(read)} of {len(here)} places with codes"
    missing = [code for code in scan.expected or () if not any(code in codes for codes in read)]
    return f"{told}; not read: {', '.join(missing)}" if missing else told


def _is_asked(row: dict[str, str], scan: ScanShelf) -> bool:
    """Whether a row is of the scan's places; a daemon of before tells no side and no level."""
    side, level = row.get("side"), row.get("level")
    on_side = scan.side is None or side is None or side == scan.side
    return on_side and (not scan.levels or level is None or level in map(str, scan.levels))
