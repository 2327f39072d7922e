"""A drone as a vehicle of VDA 5050: orders, instant actions and what the drone tells go in with the time;
what it shall do and the messages about it come out.

The rules are those of the standard's chapters on orders, their update, cancellation and rejection (2.1: 6.6,
3.0: 6.1), of traversal and of the operating modes.  Without new orders it finishes its base and holds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any, Final, TypeVar

import msgspec

from flightd.fleet.vda5050.codec import Version
from flightd.fleet.vda5050.errors import ErrorType
from flightd.fleet.vda5050.factsheet import Factsheet
from flightd.fleet.vda5050.order import InstantActions, Node, Order
from flightd.fleet.vda5050.parts import Action, Header
from flightd.fleet.vda5050.state import (
    Connection,
    ConnectionState,
    OperatingMode,
    State,
    Visualization,
)
from flightd.fleet.vehicle.acceptance import FLIES, IGNORED, Acceptance, Holding
from flightd.fleet.vehicle.action_queue import ActionQueue, stops_at
from flightd.fleet.vehicle.error_book import ErrorBook
from flightd.fleet.vehicle.floor import Floor
from flightd.fleet.vehicle.instant_actions import InstantBook
from flightd.fleet.vehicle.refusals import Refusal
from flightd.fleet.vehicle.route import Route
from flightd.fleet.vehicle.signals import (
    Decided,
    Fly,
    Hold,
    Input,
    Malformed,
    Missed,
    Output,
    Progress,
    Reached,
    Situation,
    Stop,
)

_M = TypeVar("_M", bound=Header)
STATE_EVERY_S: Final = 30.0
"""A state is sent at least so often."""
_CLEARS: Final = frozenset(
    {OperatingMode.MANUAL, OperatingMode.STARTUP, OperatingMode.SERVICE, OperatingMode.TEACH_IN}
)
_LOSES_NODE: Final = _CLEARS - {OperatingMode.MANUAL}

BaseReach = Callable[[Sequence[Node]], int | None]
"""How many of the released nodes ahead may be flown to so that the drone still comes home; None: it is not
known yet, and none is flown to."""


@dataclass(frozen=True, slots=True)
class Identity:
    """Who the vehicle is, in its messages and topics."""

    manufacturer: str
    serial_number: str


class Vehicle:
    """`base_reach` keeps the base from going beyond the safe return: it is asked in every step, and what it
    does not give is held back and told.  A cancelled order ends at the next node.  `in_reach_m`: this near a
    node the drone counts as standing on it."""

    def __init__(
        self,
        identity: Identity,
        version: Version,
        floor: Floor,
        factsheet: Factsheet,
        base_reach: BaseReach = len,
        *,
        in_reach_m: float = 0.3,
    ) -> None:
        self._identity = identity
        self._version = version
        speed_mps = factsheet.physical_parameters.maximum_speed
        self._acceptance = Acceptance(version, floor, in_reach_m, speed_mps)
        self._factsheet = factsheet
        self._base_reach = base_reach
        self._headers: dict[type[Header], int] = {}
        self._situation: Situation | None = None
        self._mode = OperatingMode.STARTUP
        self._order: Order | None = None
        self._cancelled = False
        self._last_node = ("", 0)
        self._route = Route()
        self._actions = ActionQueue()
        self._instant = InstantBook(version)
        self._errors = ErrorBook()
        self._commanded: tuple[Stop, ...] = ()
        self._allowed: int | None = 0
        self._told: State | None = None
        self._told_at: datetime | None = None

    def step(self, now: datetime, inputs: Sequence[Input] = ()) -> tuple[Output, ...]:
        """Take everything in, in its order; then say what follows, and the state if it has changed or was not
        sent for STATE_EVERY_S.  `now` in UTC."""
        out: list[Output] = []
        for one in inputs:
            match one:
                case Order():
                    out += self._take_order(one)
                case InstantActions():
                    out += self._take_instant(one)
                case Missed(Order() as order, refusal):
                    out += self._take_order(order, refusal)
                case Missed(InstantActions() as actions, refusal):
                    out += self._take_instant(actions, refusal)
                case Malformed():
                    self._errors.malformed(one)
                case Situation():
                    self._situation = one
                    if one.node is not None and self._idle:
                        self._reach(one.node)
                case Reached():
                    self._reach(one.node)
                case Progress():
                    self._actions.progress(one.action_id, one.status, one.result)
        out += self._settle()
        wants_state = self._instant.take_state_request()
        if self._instant.take_factsheet_request():
            out.append(self.factsheet(now))
        out += self._states(now, wants_state)
        return tuple(out)

    @property
    def last_node(self) -> str:
        """The node that the drone is at, or left last; empty before one is known."""
        return self._last_node[0]

    @property
    def last_sequence(self) -> int:
        """The sequence id of that node in the order."""
        return self._last_node[1]

    @property
    def ahead(self) -> tuple[str, ...]:
        """The nodes that the drone was told last to fly along, as far as it has not reached them."""
        return tuple(stop.node for stop in self._commanded)

    @property
    def actions(self) -> dict[str, tuple[Action, ...]]:
        """The order's actions that are not over: at each node of the base those of the drone's next visit; at
        the node that it is at, where it has some, these."""
        found = {
            node.node_id: tuple(one for one in node.actions if not self.is_over(one.action_id))
            for node in reversed(self._route.base)
        }
        return found | ({self.last_node: self._actions.due} if self._actions.due else {})

    def is_over(self, action_id: str) -> bool:
        """Whether an action of the order goes on no more, or is not known."""
        return self._actions.is_over_of(action_id)

    def failure_of(self, action_id: str) -> str | None:
        """Why an action of the order failed, as far as that was told; None where it did not."""
        return self._actions.failure_of(action_id)

    @property
    def held_back(self) -> str:
        """Why the drone stands though its base leads on: it would not come home.  Empty where it does not."""
        return "" if self._commanded else self._errors.what(ErrorType.BASE_BEYOND_SAFE_RETURN)

    @property
    def is_paused(self) -> bool:
        """Whether it was told to stand until it may go on."""
        return self._instant.pauses

    @property
    def is_idle(self) -> bool:
        """Whether no order is left to be flown or done."""
        return self._idle

    @property
    def is_known(self) -> bool:
        """Whether the drone has told how it is."""
        return self._situation is not None

    def change_floor(self, floor: Floor) -> None:
        """The drone was started anew, perhaps with another map; orders are checked by this one."""
        self._acceptance = replace(self._acceptance, floor=floor)

    def factsheet(self, now: datetime) -> Factsheet:
        """The message on the topic `factsheet`."""
        return self._with_header(self._factsheet, now)

    def connection(self, state: ConnectionState, now: datetime) -> Connection:
        """The message on the topic `connection`."""
        blank = Connection(
            header_id=0, timestamp="", version="", manufacturer="", serial_number="", connection_state=state
        )
        return self._with_header(blank, now)

    def state(self, now: datetime) -> State | None:
        """The message on the topic `state`, as it is now; None before the drone told how it is."""
        return None if self._situation is None else self._with_header(self._state(self._situation), now)

    def visualization(self, now: datetime) -> Visualization:
        """The message on the topic `visualization`."""
        seen = self._situation
        blank = Visualization(
            header_id=0,
            timestamp="",
            version="",
            manufacturer="",
            serial_number="",
            reference_state_header_id=max(self._headers.get(State, 0) - 1, 0),
            mobile_robot_position=seen.position if seen else None,
            velocity=seen.velocity if seen else None,
        )
        return self._with_header(blank, now)

    # orders

    @property
    def _idle(self) -> bool:
        """3.0: 6.6.8; while an order is being cancelled the vehicle is not."""
        is_over = not self._route.nodes and not self._route.edges and self._actions.is_over
        return is_over and not self._instant.cancels

    def _take_order(self, order: Order, missed: Refusal | None = None) -> Iterator[Output]:
        horizon = {action.action_id for part in self._route.horizon for action in part.actions}
        holding = Holding(
            order=self._order,
            idle=self._idle,
            cancelled=self._cancelled or self._instant.cancels,
            route=self._route,
            last_node=self._last_node,
            mode=self._mode,
            situation=self._situation,
            base_actions=self._actions.ids - horizon,
        )
        refusal = self._acceptance.refusal(order, holding)
        if refusal is IGNORED:
            return
        refusal = refusal or missed
        if refusal is not None:
            self._errors.order_refused(order, refusal)
            yield Decided(order, refusal)
            return
        yield Decided(order)
        self._errors.order_accepted()
        if self._order is None or order.order_id != self._order.order_id:
            self._begin(order)
        else:
            self._actions.remove(self._route.horizon)
            self._route.stitch(order)
            self._actions.add((*order.nodes[1:], *order.edges))
        self._order = order

    def _begin(self, order: Order) -> None:
        self._cancelled = False
        self._actions.clear()
        if self._version is Version.V2_1:
            self._instant.forget_over()  # they stand among the states of the order before
        self._route.begin(order)
        self._actions.add((*order.nodes, *order.edges))
        self._pass(order.nodes[0])

    @property
    def _order_id(self) -> str:
        return self._order.order_id if self._order else ""

    # instant actions

    def _take_instant(self, message: InstantActions, missed: Refusal | None = None) -> Iterator[Output]:
        for action in message.actions:
            if self._instant.knows(action.action_id):
                continue
            refused = self._instant.refusal(action, self._mode, self._active_order) or missed
            if refused is not None:
                self._instant.fail(action)
                self._errors.instant_refused(message, action, refused)
                yield Decided(action, refused)
                continue
            yield Decided(action)
            self._errors.instant_accepted()
            match action.action_type:
                case "startPause":
                    yield from self._actions.pause()
                case "stopPause":
                    yield from self._actions.resume()
                case "cancelOrder":
                    yield from self._cancel()
            self._instant.begin(action)

    @property
    def _active_order(self) -> str | None:
        """The id of the order that can be cancelled."""
        return None if self._order is None or self._idle or self._cancelled else self._order.order_id

    def _cancel(self) -> Iterator[Output]:
        yield from self._actions.fail()
        driving = self._situation is not None and self._situation.driving
        on_the_way = driving and bool(self._commanded)
        self._route.cut(1 if on_the_way and self._route.base else 0)

    # the way

    def _reach(self, node: str) -> None:
        base = [one.node_id for one in self._route.base]
        if node == self._last_node[0]:
            return  # it was there before: a way that comes back here has other nodes first
        if node in base:
            for _ in range(base.index(node) + 1):
                self._pass(self._route.traverse())
        elif self._idle:
            self._last_node = node, 0

    def _pass(self, node: Node) -> None:
        self._last_node = node.node_id, node.sequence_id
        self._commanded = tuple(stop for stop in self._commanded if stop.sequence_id > node.sequence_id)
        if not self._instant.cancels:
            self._actions.reach(node)

    def _settle(self) -> Iterator[Output]:
        """Everything that follows from how things are now."""
        driving = self._situation is not None and self._situation.driving
        yield from self._change_mode()
        if not self._instant.pauses and not self._instant.cancels:
            yield from self._actions.start()
            # a further node where the drone is already, for more actions there
            while (
                self._may_fly and self._allowed_nodes() and self._route.nodes[0].node_id == self._last_node[0]
            ):
                self._pass(self._route.traverse())
                yield from self._actions.start()
        if self._instant.cancels and not driving:
            self._route.cut(0)  # where it stands, for whatever reason, it stays
        yield from self._fly()
        self._instant.settle(standing=not driving)
        if self._instant.cancels and not self._route.nodes and not driving and not self._actions.runs:
            self._instant.finish_cancels()
            self._cancelled = True

    def _change_mode(self) -> Iterator[Output]:
        if self._situation is None or self._situation.mode is self._mode:
            return
        if self._situation.mode in _CLEARS:
            if not self._idle:
                yield from self._actions.fail()
                if self._actions.runs:
                    return  # another mode is told when no action of the order goes on
                self._cancelled = True
            self._route.cut(0)
            if self._situation.mode in _LOSES_NODE:
                self._last_node = "", self._last_node[1]
        self._mode = self._situation.mode
        if self._acceptance.allows_orders(self._mode):
            self._errors.drop(ErrorType.MOBILE_ROBOT_NOT_AVAILABLE)

    @property
    def _may_fly(self) -> bool:
        return not (self._instant.pauses or self._actions.stops_driving or self._mode not in FLIES)

    def _allowed_nodes(self) -> list[Node]:
        """The part of the base that is flown: as far as the drone still comes home from."""
        base = self._route.base
        told = self._base_reach(base) if base else 0
        if told is None:
            self._allowed = None
            return []
        reach = max(0, min(told, len(base)))
        self._errors.drop(ErrorType.BASE_BEYOND_SAFE_RETURN)
        if reach < len(base):
            beyond = base[reach]
            about = (("orderId", self._order_id), ("nodeId", beyond.node_id))
            what = f"the drone would not come home from {beyond.node_id}; it holds before"
            self._errors.put(Refusal(ErrorType.BASE_BEYOND_SAFE_RETURN, what, about))
        self._allowed = reach
        return base[:reach]

    def _fly(self) -> Iterator[Output]:
        allowed = self._allowed_nodes()
        stops: tuple[Stop, ...] = ()
        if self._may_fly:
            stops = tuple(Stop(node.node_id, node.sequence_id) for node in allowed[: stops_at(allowed)])
        if stops == self._commanded:
            return
        if stops:
            yield Fly(stops)
        elif self._mode in FLIES:
            yield Hold()
        self._commanded = stops

    # messages

    def _states(self, now: datetime, wanted: bool) -> Iterator[State]:
        seen = self._situation
        if seen is None:
            return
        state = self._state(seen)
        due = self._told_at is None or (now - self._told_at).total_seconds() >= STATE_EVERY_S
        if wanted or due or self._told is None or _events(state) != _events(self._told):
            self._told, self._told_at = state, now
            yield self._with_header(state, now)

    def _state(self, seen: Situation) -> State:
        order_actions, instant = self._actions.states(), self._instant.states()
        return State(
            header_id=0,
            timestamp="",
            version="",
            manufacturer="",
            serial_number="",
            order_id=self._order_id,
            order_update_id=self._order.order_update_id if self._order else 0,
            last_node_id=self._last_node[0],
            last_node_sequence_id=self._last_node[1],
            node_states=self._route.node_states(),
            edge_states=self._route.edge_states(),
            driving=seen.driving,
            paused=self._instant.paused,
            new_base_request=bool(self._route.horizon) and self._allowed in {0, 1},
            mobile_robot_position=seen.position,
            velocity=seen.velocity,
            action_states=order_actions,
            instant_action_states=instant,
            power_supply=seen.power,
            operating_mode=self._mode,
            errors=[*self._errors.states(), *self._instant.errors(), *seen.errors],
            information=list(seen.information) or None,
            safety_state=seen.safety,
        )

    def _with_header(self, message: _M, now: datetime) -> _M:
        number = self._headers.get(type(message), 0)
        self._headers[type(message)] = (number + 1) % 2**32
        stamp = now.strftime("%Y-%m-%dT%H:%M:%S.") + f"{now.microsecond // 1000:03d}Z"
        return msgspec.structs.replace(
            message,
            header_id=number,
            timestamp=stamp,
            version=self._version.value,
            manufacturer=self._identity.manufacturer,
            serial_number=self._identity.serial_number,
        )


def _events(state: State) -> dict[str, Any]:
    """A state without what changes all the time."""
    told: dict[str, Any] = msgspec.structs.asdict(state)
    for key in ("mobile_robot_position", "velocity"):
        del told[key]
    told["power_supply"] = state.power_supply.charging
    return told
