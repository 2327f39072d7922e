"""One drone as a vehicle of a fleet: steps its state machine by what the ground link tells, and has the
drone do what comes out of it.

Where orders are on, the manager flies the drone as long as no person does: whatever a person commands, at
this station or at another, wins, and the drone stays his until he gives it back.
"""

from __future__ import annotations

import asyncio
import logging
import uuid
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Any, Final

from flightd.adapters.ground_link.messages.floor import FloorStatus
from flightd.adapters.ground_link.messages.published import EventReport, StatusReport
from flightd.core.errors import FlightdError
from flightd.core.types import CommandKind, EventLevel, Phase
from flightd.fleet.vda5050.codec import Version
from flightd.fleet.vda5050.factsheet import Factsheet
from flightd.fleet.vda5050.order import Node, Order
from flightd.fleet.vda5050.parts import Header
from flightd.fleet.vda5050.state import Error, OperatingMode, State
from flightd.fleet.vehicle.drone_factsheet import Measures, drone_factsheet
from flightd.fleet.vehicle.floor import Floor
from flightd.fleet.vehicle.machine import Identity, Vehicle
from flightd.fleet.vehicle.signals import (
    Abort,
    Begin,
    Decided,
    Fly,
    Hold,
    Input,
    Output,
    PauseAction,
    Progress,
    Reached,
    ResumeAction,
    Said,
)
from flightd.ground.drone_link import DroneLink
from flightd.ground.messages import Act, LinkState
from flightd.ground.mqtt.audit_words import act_in_words, decision_in_words
from flightd.ground.mqtt.drone_trouble import of_refusal, unreachable
from flightd.ground.mqtt.kept_session import KeptSession, StationBefore
from flightd.ground.mqtt.linked_floor import WaysHome, floor_of_link
from flightd.ground.mqtt.manager_inbox import ManagerInbox
from flightd.ground.mqtt.order_flight import CommandNext, Next, PlanNext, Stuck, Wish, next_act, reached
from flightd.ground.mqtt.reported_drone import ChargeTrend, situation_of, takes_orders
from flightd.ground.mqtt.safe_return import SafeReturn, Standing, ask_standing
from flightd.ground.mqtt.sent_commands import SentCommands
from flightd.ground.mqtt.shelf_counts import ShelfCounts, counts_of, levels_of

_LOG = logging.getLogger(__name__)
MANUFACTURER: Final = "flightd"
_STEP_S: Final = 0.1
_SILENT_S: Final = 3.0
_SAME_AGAIN_S: Final = 1.0
_ASK_AGAIN_S: Final = 2.0
_MOST_WORDS: Final = 300
_MOST_PLANS: Final = 16
_COMMANDS: Final = frozenset(CommandKind)
_DID_NOTHING: Final[tuple[Next, float, int]] = (None, 0.0, 0)
_OURS: Final = "vda5050-"
"""Before the id of what a manager's vehicle side asks of a drone."""

WriteDown = Callable[[str, str, str, str], None]
"""What the manager did, to which drone, and what came of it: act, drone, outcome, why."""


@dataclass(frozen=True, slots=True)
class OrderRules:
    """Orders are on.  A drone that holds in the air without an order, or without the broker, for `hold_s` is
    sent home."""

    hold_s: float
    write_down: WriteDown


class ManagedDrone:
    """`tell` takes what the hub says of it, `hear` what the broker does; `run` steps it until cancelled.
    What is to be said to the broker waits in `take_messages`, newest of each kind; `changed` is set by it."""

    def __init__(
        self,
        name: str,
        version: Version,
        measures: Measures,
        rules: OrderRules | None = None,
        now: Callable[[], datetime] = lambda: datetime.now(UTC),
    ) -> None:
        self._name = name
        self._rules = rules
        self.now = now
        sheet = drone_factsheet("flightd", measures)
        nowhere = Floor("", frozenset(), frozenset(), {})
        identity = Identity(MANUFACTURER, name)
        self.vehicle = Vehicle(identity, version, nowhere, sheet, self._reach)
        self.changed = asyncio.Event()
        self.at_broker = False
        """Somebody may hear what is said."""
        self.on_taken: Callable[[bool], None] = lambda _taken: None
        self.on_decided: Callable[[Decided], None] = lambda _decided: None
        self.flies = self.lands = self.docks = False
        """As `Wish`: whoever gives the orders sets them."""
        self.has_more = False
        """A drone that holds without an order waits for one that will come."""
        self.may_go_home = True
        """Nobody is in its way home: it may be sent there."""
        self.is_automatic = False
        """The manager may fly it, by what it told last."""
        self._messages: dict[type[Header], Header] = {}
        self._welcome: dict[str, Any] | None = None
        self._ways: WaysHome | None = None
        self._status: StatusReport | None = None
        self._is_new = True
        """It was started anew: what was ordered before is over."""
        self._heard = self._waited = False
        """The station hears it; it stood before a flight, by its last status."""
        self._inbox, self._counts = ManagerInbox(name), ShelfCounts()
        self._progress: list[Progress] = []
        """Of the order's actions, at most one each."""
        self._link: DroneLink | None = None
        self._taken = False
        self._sent = SentCommands()
        self._event_seq: int | None = None
        self._standing: Standing | None = None
        self._stood: Standing | None = None
        """As it told before its newest flight."""
        self._asked_at_s = -_ASK_AGAIN_S
        self._return, self._charge = SafeReturn(), ChargeTrend()
        self._acting: asyncio.Task[None] | None = None
        self._did = _DID_NOTHING
        """The last act, when it was answered, and the status by which it shows."""
        self._order: Order | None = None
        self._ahead: list[str] = []
        self._plans: deque[str] = deque(maxlen=_MOST_PLANS)
        self._planned: tuple[str, PlanNext] | None = None
        self._trouble: Error | None = None
        self._rests_since_s: float | None = None
        self._before = StationBefore()

    # what outlives the station

    def kept(self) -> KeptSession:
        """What the next station has to know of the drone's session."""
        session = "" if self._welcome is None else str(self._welcome["session"])
        seq = self._event_seq or 0
        if not session:  # not heard by this station
            return replace(self._before.kept, taken=self._taken)
        return KeptSession(session, tuple(self._plans), self._standing, seq, self._taken)

    def recall(self, kept: KeptSession, ordered: Iterable[str]) -> None:
        """Go on with what the station before knew, before anything is heard: it flies by that one's plans,
        and may have been given these commands at last.  If it has another session by then nothing of this
        holds but that a person has it."""
        if kept.taken:
            self.taken_by_person()
        self._before.recall(kept, ordered)

    # what comes in

    @property
    def is_heard(self) -> bool:
        """The station hears the drone."""
        return self._heard

    @property
    def is_taken(self) -> bool:
        """A person commands it."""
        return self._taken

    @property
    def status(self) -> StatusReport | None:
        """What it told last."""
        return self._status

    @property
    def stands_on(self) -> str | None:
        """The node of the pad on which it says to stand; None where it has not told."""
        return None if self._standing is None else self._standing.node

    @property
    def standing(self) -> Standing | None:
        """What it told of itself before its start."""
        return self._standing

    @property
    def trouble(self) -> str:
        """What keeps it from going on with its order, as long as it does: what it refuses, or is not sent
        to."""
        return self.vehicle.held_back if self._trouble is None else self._trouble.error_description or ""

    @property
    def floor(self) -> FloorStatus | None:
        """The map that it flies by."""
        return None if self._welcome is None else self._welcome["floor"]

    def tell(self, topic: str, value: Any) -> None:
        """What the hub says of the drone."""
        match topic:
            case "welcome":
                self._take_welcome(value)
            case "status":
                self._status = value
            case "events":
                self._take_events(value)
            case "link":
                link: LinkState = value
                self._heard = link.connected and link.heard_s is not None and link.heard_s < _SILENT_S

    def hear(self, one: Said) -> None:
        """What the broker says."""
        self._inbox.hear(one, asyncio.get_running_loop().time())

    def taken_by_person(self, taken: bool = True) -> None:
        """A person commands the drone from now on, or gives it back."""
        if taken:
            self._leave_off()
            self._counts.given = ()
        if taken is not self._taken:
            self._taken = taken
            self.on_taken(taken)

    def _leave_off(self) -> None:
        """Nothing of the manager's is sent after it."""
        if self._acting is not None:
            self._acting.cancel()

    def _take_welcome(self, welcome: dict[str, Any]) -> None:
        before, self._welcome = self._welcome, welcome
        if before is not None and before["session"] == welcome["session"]:
            return
        self.vehicle.change_floor(floor_of_link(welcome["floor"]))
        self._ways = WaysHome(welcome["floor"])
        self._status = self._standing = self._stood = self._event_seq = None
        self._is_new, self.is_automatic, self._waited = True, False, False
        self.flies = self.lands = self.docks = self.has_more = False
        self._asked_at_s = -_ASK_AGAIN_S
        self._return, self._charge = SafeReturn(), ChargeTrend()
        self._leave_off()
        # it counts its statuses, and maybe its clock, from the beginning
        self._did, self._planned, self._trouble = _DID_NOTHING, None, None
        self._counts, self._progress = ShelfCounts(), []
        self._sent.clear()
        if kept := self._before.greet(str(welcome["session"])):
            self._plans.extend(kept.plans)
            self._standing, self._event_seq = kept.standing, kept.event_seq

    def _take_events(self, events: Iterable[EventReport]) -> None:
        """Commands that are none of ours are a person's; those before the first that is heard are past."""
        seen = self._event_seq
        for event in events:
            if seen is not None and event.seq > seen:
                self._take_event(event)
            self._event_seq = max(self._event_seq or 0, event.seq)
        self._event_seq = self._event_seq or 0
        self._before.is_past()

    def _take_event(self, event: EventReport) -> None:
        if event.name == "visited":
            self._counts.note_visit(event)
        act = self._did[0]
        if isinstance(act, CommandNext) and act.node and event.level is EventLevel.WARNING:
            refused = event.name == "command" and event.text.startswith(f"{act.kind} {act.node} refused")
            self._trouble = unreachable(act.node, event.text) if refused else self._trouble
            if refused and act.counts is not None:
                self._counts.forget(act.node)
        is_command = event.name == "command" and event.level is EventLevel.INFO
        is_command = is_command and event.text.split(" ")[0] in _COMMANDS
        if is_command and not self._before.gave(event.text) and not self._sent.take(event):
            self.taken_by_person()

    # what goes on

    async def run(self, link: DroneLink | None) -> None:
        """Step until cancelled; without a `link` the drone is only told of."""
        self._link = link
        if link is not None and self._rules is not None:
            link.on_person = self.taken_by_person
        loop = asyncio.get_running_loop()
        async with asyncio.TaskGroup() as tasks:
            while True:
                if self._heard and self._status is not None and self._welcome is not None:
                    self._step(self._status, loop.time(), tasks)
                else:
                    self._inbox.see_late(loop.time())
                await asyncio.sleep(_STEP_S)

    def take_messages(self) -> list[Header]:
        """What is to be said, newest of each kind."""
        taken, self._messages = list(self._messages.values()), {}
        return taken

    def say_again(self) -> None:
        """Somebody hears what is said for the first time."""
        state = self.vehicle.state(self.now())
        self._put(self.vehicle.factsheet(self.now()))
        if state is not None:
            self._put(state)

    def _put(self, message: Header) -> None:
        self._messages[type(message)] = message
        self.changed.set()

    def _step(self, status: StatusReport, now_s: float, tasks: asyncio.TaskGroup) -> None:
        assert self._welcome is not None
        before, self._waited = self._waited, status.phase is Phase.PREFLIGHT
        if self._waited and not before:  # maybe on another pad than it stood on
            self._stood, self._standing = self._standing or self._stood, None
            self._return = SafeReturn()
        arrived = self._arrived(status)
        progress, self._progress = self._progress, []
        if self._before.flies_on and status.plan.startswith(_OURS) and status.plan not in self._plans:
            # handed over after the station before wrote down for the last time
            self._plans.append(status.plan)
        mode = OperatingMode.MANUAL if self._is_new else self._mode(status)
        self._is_new = False
        last, floor = self.vehicle.last_node, self._welcome["floor"]
        pad, dropped = self.stands_on, self._inbox.dropped
        charging = self._charge.see(status, floor, pad)
        errors = [] if self._trouble is None else [self._trouble]
        seen = situation_of(status, floor, mode, last, pad, errors, charging=charging, dropped=dropped)
        for one in self.vehicle.step(self.now(), [seen, *arrived, *progress, *self._inbox.take()]):
            self._take_output(one, status)
        self._ahead = list(self.vehicle.ahead)
        self._see_wanted()
        self.is_automatic = mode is OperatingMode.AUTOMATIC
        self._before.see(status)
        if self.is_automatic and self._link is not None and not self._before.flies_on:
            self._go_on(status, now_s, tasks, self._link)

    def _mode(self, status: StatusReport) -> OperatingMode:
        """AUTOMATIC where the manager may fly the drone."""
        may = self._rules is not None and not self._taken and self._welcome is not None
        if may and self._welcome is not None:
            may = self._welcome["role"] == "operator"
        return OperatingMode.AUTOMATIC if may and takes_orders(status, self._plans) else OperatingMode.MANUAL

    def _arrived(self, status: StatusReport) -> list[Input]:
        node = reached(status, self._wish)
        if node is None:
            return []
        del self._ahead[: self._ahead.index(node) + 1]
        return [Reached(node)]

    @property
    def _wish(self) -> Wish:
        ahead, last = tuple(self._ahead), self.vehicle.last_node
        wanted, given = self._counts.wanted, self._counts.given
        return Wish(ahead, last, self._counts.go_on, self.flies, self.lands, self.docks, wanted, given)

    def _see_wanted(self) -> None:
        self._counts.wanted = counts_of(self.vehicle.actions) if self._takes_counts else None

    @property
    def _takes_counts(self) -> bool:
        """It is told what to count at each node; a daemon of before counts all that a node sees."""
        return self.floor is not None and any(node.left is not None for node in self.floor.nodes)

    def _take_output(self, one: Output, status: StatusReport) -> None:
        match one:
            case Fly() | Hold():
                pass  # what is ahead is known by the machine
            case Begin(action):
                node, tells = self.vehicle.last_node, self._takes_counts
                failed = self._counts.begin(action, node, status, self._standing, tells=tells)
                self._progress += [] if failed is None else [failed]
            case Abort(action_id):
                self._counts.abort(action_id)
            case PauseAction(action_id) | ResumeAction(action_id):
                self._counts.hold(action_id, isinstance(one, PauseAction))
            case Decided():
                self._decided(one)
            case State() | Factsheet():
                self._put(one)

    def _decided(self, one: Decided) -> None:
        self._trouble = None
        self.on_decided(one)
        if isinstance(one.about, Order) and one.refusal is None:
            self._order = one.about
        self._write_down(*decision_in_words(one))

    def _write_down(self, what: str, refused: str) -> None:
        if self._rules is not None:
            self._rules.write_down(
                what[:_MOST_WORDS], self._name, "refused" if refused else "accepted", refused[:_MOST_WORDS]
            )

    # acts

    def _reach(self, nodes: Sequence[Node]) -> int | None:
        if self._status is None or self._ways is None:
            return None
        ids, last = [node.node_id for node in nodes], self.vehicle.last_node
        self._see_wanted()  # an order is being looked at
        counts = self._wish.counts_at(*ids)
        return self._return.reach(ids, last, self._status, self._ways, self._standing, counts)

    def _go_on(self, status: StatusReport, now_s: float, tasks: asyncio.TaskGroup, link: DroneLink) -> None:
        """Begin what is to be done next, one thing after the other."""
        if self._acting is not None and not self._acting.done():
            return
        over = self._counts.over(now_s)
        waits = status.phase is Phase.PREFLIGHT and CommandKind.PLAN in status.possible
        asks = waits and (self._standing is None or self._return.is_due(now_s))
        if over:
            asked = self._ask_count(over, now_s, link)
            self._acting = tasks.create_task(asked, name=f"{self._name} counted")
        elif asks and now_s - self._asked_at_s >= _ASK_AGAIN_S:
            self._asked_at_s = now_s
            self._acting = tasks.create_task(self._ask(now_s, link), name=f"{self._name} is asked")
        else:
            act = self._homeward(status, now_s) or next_act(status, self._wish, self._planned)
            if isinstance(act, Stuck):
                self._trouble = unreachable("", f"the drone was halted on its way to {act.towards}")
            elif act is None:
                self._trouble = None
            elif self._is_due(act, status, now_s):
                self._acting = tasks.create_task(self._do(act, status, link), name=f"{self._name} is sent on")

    def _is_due(self, act: Next, status: StatusReport, now_s: float) -> bool:
        before, at_s, seq = self._did
        return status.seq >= seq if act != before else now_s - at_s >= _SAME_AGAIN_S

    def _homeward(self, status: StatusReport, now_s: float) -> Next:
        """Home, for a drone that holds in the air and has nothing to wait for."""
        wish = self._wish
        needless = (self.vehicle.is_idle and not self.has_more) or not self.at_broker
        if status.phase is not Phase.HOLD or wish.ahead or wish.works or not needless:
            self._rests_since_s = None
            return None
        self._rests_since_s = now_s if self._rests_since_s is None else self._rests_since_s
        assert self._rules is not None
        is_due = self.may_go_home and now_s - self._rests_since_s >= self._rules.hold_s
        return CommandNext(CommandKind.HOME) if is_due else None

    async def _ask(self, now_s: float, link: DroneLink) -> None:
        """Where it stands, and how far it could fly."""
        try:
            if self._standing is None and self._ways is not None:
                self._standing = await ask_standing(link, self._ways, self._stood)
                self._asked_at_s = -_ASK_AGAIN_S
            if self._return.is_due(now_s):
                await self._return.ask(link, now_s)
                self._asked_at_s = -_ASK_AGAIN_S
        except FlightdError as err:
            _LOG.info("%s: %s", self._name, err)

    async def _ask_count(self, over: list[str], now_s: float, link: DroneLink) -> None:
        """Tell what was counted."""
        told = await self._counts.results(over, link, now_s)
        self._progress += told  # a step may have taken the others meanwhile

    async def _do(self, act: PlanNext | CommandNext, status: StatusReport, link: DroneLink) -> None:
        act_id = f"{_OURS}{uuid.uuid4().hex}"
        if isinstance(act, PlanNext):
            text, levels = "plan", () if act.counts is not None else levels_of(self._order, act.nodes)
            self._plans.append(act_id)
        else:
            text = f"{act.kind} {act.node}".rstrip()
        self._sent.note(text, status.stamp_ns)
        refused = ""
        try:
            if isinstance(act, PlanNext):
                await link.plan_flight(
                    act.nodes,
                    levels,
                    act_id,
                    session=status.session,
                    seen_ns=status.stamp_ns,
                    waits=status.waits_at is not None,
                    by_person=False,
                    counts=act.counts,
                )
                self._planned, self._counts.levels = (act_id, act), levels
                self._counts.tell(act.counts, None, status.stamp_ns)
            else:
                plan = self._planned[0] if act.kind is CommandKind.START and self._planned else ""
                order = Act(
                    act_id, act.kind, act.node, plan, status.session, status.stamp_ns, act.waits, act.lands
                )
                await link.act(order, by_person=False, counts=act.counts)
                if act.node:
                    self._counts.tell(act.counts, {act.node}, status.stamp_ns)
            self._trouble = self._trouble if act == self._did[0] else None
        except FlightdError as err:
            refused = str(err).removeprefix("refused: ")
            if (trouble := of_refusal(act, err)) is not None:
                self._trouble = trouble
                self._sent.refused(text)
        newest = status if self._status is None else self._status
        self._did = act, asyncio.get_running_loop().time(), newest.seq + 2
        self._write_down(act_in_words(act), refused)
