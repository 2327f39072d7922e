"""How an order is flown over the ground link: what is asked of the drone next, by its newest status.  Pure.

A plan is handed over on the ground and started.  In the air the link extends no plan: the drone is sent on
from node to node by `goto`.  Every plan and goto of an order ends by holding there (`waits`), so that a drone
which is done with its base before more of it comes waits for that, however late it comes and whatever became
of the station.

A daemon before that kind of end flies home with nothing ahead: it is given, before it is done with each node,
either the next one of the base or the same one again, and there it is paused.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flightd.adapters.ground_link.messages.counts import Counts, NodeCount
from flightd.adapters.ground_link.messages.published import StatusReport
from flightd.core.types import CommandKind, Phase
from flightd.mission.machine import FLYING

AT_NODE = frozenset({Phase.HOVER, Phase.CLIMB, Phase.SCAN})
"""The drone is at its goal, or looks at the shelf beside it."""

WAITS = frozenset({Phase.PREFLIGHT, Phase.ARMING})
"""It is on the ground, before a flight."""


@dataclass(frozen=True, slots=True)
class Wish:
    """What an order wants by now: the nodes to be flown along, none to stay; the node that the drone is at or
    left last; whether something goes on there that a pause would interrupt; whether it is to be in the air,
    if only over its pad's node; whether it may come down there, and if on that node's pad rather than at
    home.  `counts` is all that is to be counted at these nodes (None: that is not told to the drone), `given`
    what it was told by now."""

    ahead: tuple[str, ...]
    last: str
    works: bool = False
    flies: bool = False
    lands: bool = False
    docks: bool = False
    counts: Counts = None
    given: tuple[NodeCount, ...] = ()

    def counts_at(self, *nodes: str) -> Counts:
        """What is to be counted at some of the nodes."""
        among = frozenset(nodes)
        return None if self.counts is None else tuple(one for one in self.counts if one.node in among)

    def is_told(self, node: str) -> bool:
        """Whether the drone counts at a node ahead what is to be counted there."""
        wanted = self.counts_at(node)
        return wanted is None or {*wanted} == {one for one in self.given if one.node == node}


@dataclass(frozen=True, slots=True)
class PlanNext:
    """Hand these nodes over for the next flight, and what is counted at them."""

    nodes: tuple[str, ...]
    counts: Counts = None


@dataclass(frozen=True, slots=True)
class CommandNext:
    """Give a command; `node` only with goto, and so is whether the drone `waits` there, or `lands`, and what
    it counts there."""

    kind: CommandKind
    node: str = ""
    waits: bool = False
    lands: bool = False
    counts: Counts = None


@dataclass(frozen=True, slots=True)
class Stuck:
    """The drone is on its way to a node that is not of the order, and cannot be turned round."""

    towards: str


Next = PlanNext | CommandNext | Stuck | None


def reached(status: StatusReport, wish: Wish) -> str | None:
    """The node ahead at which the drone has arrived."""
    there = status.phase in AT_NODE or _is_at_end(status)
    return status.goal if there and status.goal != wish.last and status.goal in wish.ahead else None


def next_act(status: StatusReport, wish: Wish, planned: tuple[str, PlanNext] | None) -> Next:
    """What is asked next; `planned` is the plan that was handed over last, with its id."""
    if status.phase in WAITS:
        return _on_ground(status, wish, planned)
    if status.phase in FLYING and CommandKind.GOTO in status.possible and status.way:
        return _in_air(status, wish)
    return None


def _on_ground(status: StatusReport, wish: Wish, planned: tuple[str, PlanNext] | None) -> Next:
    target = each_once(wish.ahead or ((wish.last,) if wish.works or wish.flies else ()))
    if not target:
        ours = planned is not None and status.plan == planned[0]
        return CommandNext(CommandKind.PAUSE) if ours and CommandKind.PAUSE in status.possible else None
    if CommandKind.PLAN not in status.possible:
        return None  # it starts already, or is not ready
    plan = PlanNext(target, wish.counts_at(*target))
    if planned is None or status.plan != planned[0] or plan != planned[1]:
        return plan
    return CommandNext(CommandKind.START) if CommandKind.START in status.possible else None


def _in_air(status: StatusReport, wish: Wish) -> Next:
    at_end = _is_at_end(status)
    goal, following = status.way[0], "" if at_end else _following(status)
    comes_down = goal == wish.last if wish.docks else {*status.way} == {wish.last}
    if wish.lands and not wish.ahead and comes_down:
        return _down(status, wish)
    if goal == wish.last:
        wanted = wish.ahead[0] if wish.ahead else goal
    elif goal in wish.ahead:
        wanted = (*wish.ahead, goal)[wish.ahead.index(goal) + 1]
    else:
        return _off_way(status, wish, goal)
    ends = goal == wanted == status.waits_at
    waits = at_end and status.phase is Phase.HOLD
    anew = bool(wish.ahead) and not wish.is_told(wanted)
    if (following != wanted and not ends) or (waits and wish.works) or anew:  # works: visited once more
        is_led, counts = status.waits_at is not None, wish.counts_at(wanted)
        return CommandNext(CommandKind.GOTO, wanted, waits=is_led, counts=counts)
    if wish.ahead or wish.works:
        return CommandNext(CommandKind.RESUME) if status.phase is Phase.HOLD and not waits else None
    return CommandNext(CommandKind.PAUSE) if status.phase in AT_NODE and not ends else None


def _down(status: StatusReport, wish: Wish) -> Next:
    """Onto the pad of the node that it is at: home from there, where that is its own."""
    if status.waits_at or (wish.docks and status.lands_at != wish.last):
        return CommandNext(CommandKind.GOTO, wish.last, lands=wish.docks, counts=wish.counts_at(wish.last))
    return CommandNext(CommandKind.RESUME) if status.phase is Phase.HOLD else None


def _following(status: StatusReport) -> str:
    """The node after its goal; empty where only its pad is left."""
    return status.way[1] if len(status.way) > 2 else ""


def _is_at_end(status: StatusReport) -> bool:
    """Whether the drone has visited the last node of its way: it holds there, or is about to."""
    return bool(status.way) and status.way[0] == status.waits_at != _following(status)


def _off_way(status: StatusReport, wish: Wish, goal: str) -> Next:
    """The drone makes for a node that the order does not have: it was paused on its way there and the order
    ended, or it has lost its place and comes back to its way."""
    if status.phase is Phase.HOLD:
        return Stuck(goal) if wish.ahead else None
    comes_back = status.phase is Phase.RELOCATE or bool(wish.ahead and wish.ahead[0] in status.way)
    return None if comes_back else CommandNext(CommandKind.PAUSE)


def each_once(nodes: Sequence[str]) -> tuple[str, ...]:
    """As far as no node comes again: a plan visits each once."""
    for i, node in enumerate(nodes):
        if node in nodes[:i]:
            return tuple(nodes[:i])
    return tuple(nodes)
