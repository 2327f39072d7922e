"""How far an order may lead a drone so that it still comes home: by what the drone itself estimates.

On the ground it is asked what a flight over the base would be.  In the air it plans nothing: there the metres
of the way and the shelves that are counted on it, at the pace of its own plan, are held against the time that
its battery has left.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass, replace

from flightd.adapters.ground_link.messages.answers import Planned
from flightd.adapters.ground_link.messages.counts import Counts, NodeCount
from flightd.adapters.ground_link.messages.published import StatusReport
from flightd.core.errors import InputError
from flightd.ground.drone_link import DroneLink
from flightd.ground.mqtt.linked_floor import WaysHome
from flightd.ground.mqtt.order_flight import WAITS, PlanNext, each_once

_ANSWER_OLD_S = 30.0
_BETWEEN_S = 0.3
"""A drone answers five such questions a second, of all who ask together."""


@dataclass(frozen=True, slots=True)
class Standing:
    """What a drone that waits for its start tells of itself: the node that it stands on, whether it counts,
    and its seconds for each metre of its own plan, with all that it does there.  Where it tells that apart,
    it needs `bare_pace_s` for each metre without its counts, and `shelf_s` for each level that it counts on
    a side of a node."""

    node: str
    counts: bool
    pace_s: float
    bare_pace_s: float | None = None
    shelf_s: float = 0.0

    @classmethod
    def of(cls, planned: Planned) -> Standing:
        """From what it says of the plan that it is configured to fly."""
        return cls(planned.way[0], planned.places > 0, _pace_s(planned))

    def apart(self, own: Planned, bare: Planned, shelves: int) -> Standing:
        """The same, by its `own` plan with so many shelves, and what that is without counting them."""
        counts_s = max(own.seconds - bare.seconds, 0.0)
        return replace(self, bare_pace_s=_pace_s(bare), shelf_s=counts_s / shelves)

    def needed_s(self, way_m: float, shelves: int) -> float:
        """Its time for a way with so many shelves to count."""
        pace_s = self.pace_s if self.bare_pace_s is None else self.bare_pace_s
        return way_m * pace_s + shelves * self.shelf_s


def _pace_s(planned: Planned) -> float:
    return planned.seconds / max(planned.way_m, 1.0)


async def ask_standing(link: DroneLink, ways: WaysHome, before: Standing | None) -> Standing:
    """What a drone tells that waits for its start; after it came down on a pad of others its own plan leads
    home alone: what it told `before` of itself holds.  As `DroneLink.plan_flight` raises."""
    own = await link.plan_flight((), (), dry=True, waits=True, by_person=False)
    if before is not None and not own.nodes:
        return replace(before, node=own.way[0])
    standing = Standing.of(own)
    shelves = ways.shelves(NodeCount(node, levels=own.levels) for node in own.nodes)
    if not standing.counts or not shelves:
        return standing
    await asyncio.sleep(_BETWEEN_S)
    try:
        bare = await link.plan_flight(own.nodes, (), dry=True, waits=True, by_person=False, counts=())
    except InputError:  # its own plan may be longer than one that is handed over
        return standing
    return standing.apart(own, bare, shelves)


class SafeReturn:
    """Answers at once by what is known; `ask` gets to know what is missing."""

    def __init__(self) -> None:
        self._answers: dict[PlanNext, tuple[int, float]] = {}
        self._wanted = PlanNext(())

    def reach(
        self,
        nodes: Sequence[str],
        last: str,
        status: StatusReport,
        ways: WaysHome,
        standing: Standing | None,
        counts: Counts = None,
    ) -> int | None:
        """How many of the nodes, at which this is counted; None while the drone has not answered."""
        if status.phase in WAITS:
            self._wanted = PlanNext(each_once(nodes), counts)
            known = self._answers.get(self._wanted)
            full = known is not None and known[0] == len(self._wanted.nodes)
            return len(nodes) if full else None if known is None else known[0]
        left_s = status.battery_left_s
        if left_s is None or standing is None:
            return len(nodes)  # it tells no charge: its own rules bring it home
        at = status.position
        metres = ways.there_and_home_m(last, nodes, None if at is None else (at.x_m, at.y_m))
        here: dict[str, list[NodeCount]] = {}
        for one in counts or ():
            here.setdefault(one.node, []).append(one)
        fits = shelves = 0
        for node, all_m in zip(nodes, metres, strict=True):
            shelves += ways.shelves(here.pop(node, ()))  # counted once, however often it is visited
            fits += standing.needed_s(all_m, shelves) <= left_s
        return fits

    def is_due(self, now_s: float) -> bool:
        """Whether the drone is to be asked."""
        known = self._answers.get(self._wanted)
        return bool(self._wanted.nodes) and (known is None or now_s - known[1] > _ANSWER_OLD_S)

    async def ask(self, link: DroneLink, now_s: float) -> None:
        """Ask the drone about the nodes that were wanted last.  As `DroneLink.plan_flight` raises where it
        does not answer."""
        wanted, nodes = self._wanted, self._wanted.nodes
        fits, beyond = 0, len(nodes) + 1
        probe = len(nodes)
        while probe > fits:
            if await _comes_home(link, nodes[:probe], wanted.counts):
                fits = probe
            else:
                beyond = probe
            probe = (fits + beyond) // 2
            if probe > fits:
                await asyncio.sleep(_BETWEEN_S)
        self._answers = {wanted: (fits, now_s)}


async def _comes_home(link: DroneLink, nodes: Sequence[str], counts: Counts) -> bool:
    """Whether the drone flies over the nodes and home on the battery that is in it."""
    try:
        planned = await link.plan_flight(nodes, (), dry=True, waits=True, by_person=False, counts=counts)
    except InputError:
        return False
    return planned.batteries <= 1
