"""Answers requests from the ground.  No sockets here: bytes in, answer out.

Nothing that a stranger can send raises; whatever has no effect is refused with a reason.
"""

from __future__ import annotations

from collections import OrderedDict, deque
from collections.abc import Callable, Sequence
from dataclasses import replace

import msgspec

from flightd import __version__
from flightd.adapters.ground_link.audit import AuditEntry
from flightd.adapters.ground_link.floor_status import floor_status
from flightd.adapters.ground_link.maintenance_rules import objection
from flightd.adapters.ground_link.messages.answers import (
    Accepted,
    Code,
    InventoryAnswer,
    Planned,
    Refused,
    StatusAnswer,
    Welcome,
)
from flightd.adapters.ground_link.messages.base import VERSION, Role
from flightd.adapters.ground_link.messages.counts import shelf_counts
from flightd.adapters.ground_link.messages.floor import CameraOptics
from flightd.adapters.ground_link.messages.maintenance import Maintenance
from flightd.adapters.ground_link.messages.published import EventReport, StatusReport
from flightd.adapters.ground_link.messages.requests import (
    AskInventory,
    AskPicture,
    AskPlan,
    AskStatus,
    Attend,
    Hello,
    Order,
    PlanFlight,
)
from flightd.adapters.ground_link.peer import Peer
from flightd.adapters.ground_link.plan_answers import PlanAnswers, impossible
from flightd.adapters.ground_link.protocol import (
    DECODE_ERRORS,
    Answer,
    Envelope,
    Request,
    decode_envelope,
    decode_request,
)
from flightd.core.planned_flight import Planner
from flightd.core.preview import CameraName
from flightd.core.types import WAITING, Command, CommandKind, Phase
from flightd.mission.machine import BEGIN, possible_commands
from flightd.site.site import Site

_RECENT_EVENTS = 50
_REMEMBERED_ORDERS = 1024
_ORDERS_WAITING = 32
_ORDERS_PER_S = 20
_ATTENDING = 64
_TAKEN_OVER_NS = 3_000_000_000
"""Who attends but was silent for so long has been taken over from, once somebody else attends."""

_URGENT = frozenset({CommandKind.LAND, CommandKind.STOP})
"""Never held back for being too many."""
_NEVER_LATE = _URGENT | {CommandKind.PAUSE}
_WAIT = frozenset({CommandKind.GOTO, CommandKind.PLAN})
_LATE_NS = 5_000_000_000
"""By an older status nothing else is ordered: the order lay in a queue, or its giver saw nothing."""


class RequestHandler:
    """Answers requests; what they ask of the flight waits in `take_commands` and `attending`."""

    def __init__(
        self,
        site: Site,
        session: str,
        audit: Callable[[AuditEntry], None],
        picture_fps: float = 0.0,
        inventory: Callable[[], Sequence[dict[str, str]]] | None = None,
        cameras: Sequence[CameraName] = (CameraName.DOWN,),
        optics: Sequence[CameraOptics] = (),
    ) -> None:
        self._nodes = frozenset(site.nodes)
        self._pads = frozenset(pad.node for pad in site.pads)
        self._locations = site.locations
        self._floor = floor_status(site)
        self._session = session
        self._audit = audit
        self._picture_fps = picture_fps
        self._inventory = inventory
        self._cameras = tuple(cameras)
        self._optics = tuple(optics)
        self._commands: deque[Command] = deque()
        self._plans: PlanAnswers | None = None
        self._done: OrderedDict[tuple[str, str], tuple[Command, Answer]] = OrderedDict()
        self._recent: deque[tuple[str, int]] = deque(maxlen=_ORDERS_PER_S * 8)
        self._heard_ns: dict[tuple[str, bytes], int] = {}
        self.events: deque[EventReport] = deque(maxlen=_RECENT_EVENTS)
        self.status: StatusReport | None = None
        self.possible = possible_commands(BEGIN)
        """The commands that the mission takes now."""
        self.looked_after: Callable[[], bool] = lambda: False
        """Whether somebody changes or checks something of the drone now: then nothing is started."""
        self.requests = 0
        self.refused = 0

    def plan_by(self, planner: Planner) -> None:
        """Plans are asked of it from now on."""
        self._plans = PlanAnswers(planner, self._session)

    def take_commands(self) -> list[Command]:
        """The orders accepted since the last call, oldest first."""
        taken = list(self._commands)
        self._commands.clear()
        return taken

    def silent_ns(self, now_ns: int) -> int:
        """Time since anybody who attends was heard; 0 when nobody attends."""
        return now_ns - max(self._heard_ns.values()) if self._heard_ns else 0

    def attending(self, now_ns: int) -> int:
        """How many attend and were heard lately."""
        return sum(now_ns - heard_ns < _TAKEN_OVER_NS for heard_ns in self._heard_ns.values())

    def answer(self, body: bytes, peer: Peer, now_ns: int) -> Answer | AskPicture | Maintenance:
        """What to answer to `body`, or a request that takes a while: for a picture, or to look after the
        drone."""
        self.requests += 1
        request = self._read(body)
        match request:
            case Hello():
                return self._welcome(request, peer)
            case Order():
                return self._order(request, peer, now_ns)
            case PlanFlight():
                return self._plan_flight(request, peer, now_ns)
            case Attend():
                return self._attend(request, peer, now_ns)
            case AskPlan() | AskStatus() | AskInventory() | AskPicture():
                return self._show(request)
        return request

    def maintenance_objection(self, request: Maintenance, peer: Peer, now_ns: int) -> tuple[Code, str] | None:
        """Why the drone is not looked after now; None where it may be."""
        return objection(request, peer.role, self.status, self.possible, now_ns)

    def _read(self, body: bytes) -> Request | Refused:
        """The request in `body`; the version is looked at before anything else."""
        request_id = ""
        try:
            envelope = decode_envelope(body)
            request_id = envelope.id[:64]
            if envelope.version != VERSION:
                return self._refuse(request_id, Code.VERSION, _wrong_version(envelope))
            return decode_request(body)
        except DECODE_ERRORS as err:
            return self._refuse(request_id, Code.MALFORMED, f"not a request of this protocol: {err}")

    def _show(self, request: AskPlan | AskStatus | AskInventory | AskPicture) -> Answer | AskPicture:
        if isinstance(request, AskPlan):
            return self._standing_plan(request)
        if isinstance(request, AskStatus):
            return StatusAnswer(request=request.id, status=self.status)
        if isinstance(request, AskPicture):
            missing = self._no_picture(request)
            return self._refuse(request.id, Code.UNAVAILABLE, missing) if missing else request
        if self._inventory is None:
            return self._refuse(request.id, Code.UNAVAILABLE, "this flightd keeps no inventory store")
        return InventoryAnswer(request=request.id, places=tuple(map(self._placed, self._inventory())))

    def _placed(self, row: dict[str, str]) -> dict[str, str]:
        """A row of the inventory, with the side and level of its location."""
        at = self._locations.get(row.get("location", ""))
        return row if at is None else {"location": at.code, "side": at.side, "level": str(at.level), **row}

    def _no_picture(self, request: AskPicture) -> str:
        if self._picture_fps == 0:
            return "pictures are off: set ground.picture_fps"
        return "" if request.camera in self._cameras else f"this flight uses no {request.camera} camera"

    def refuse_later(self, request: AskPicture | Maintenance, code: Code, text: str) -> Refused:
        """The answer to a request that took a while, and cannot be served."""
        return self._refuse(request.id, code, text)

    def _welcome(self, request: Hello, peer: Peer) -> Welcome:
        return Welcome(
            request=request.id,
            flightd=__version__,
            session=self._session,
            role=peer.role,
            client=peer.name,
            picture_fps=self._picture_fps,
            floor=self._floor,
            events=tuple(self.events),
            cameras=self._cameras,
            optics=self._optics,
        )

    def _order(self, order: Order, peer: Peer, now_ns: int) -> Answer:
        """Accept, refuse or repeat an order, and write down which."""
        command = Command(
            order.id,
            order.command,
            order.node,
            counts=shelf_counts(order.counts),
            plan=order.plan,
            waits=order.waits,
            lands=order.lands,
        )
        repeated = self._repeated(command, peer)
        if repeated is not None:
            return repeated
        code, text = self._objection(order, peer, now_ns)
        if code is not None:
            return self._not_done(command, peer, code, text)
        return self._accept(command, peer, Accepted(request=order.id))

    def _repeated(self, command: Command, peer: Peer) -> Answer | None:
        """The answer to a command that was done before, None to a new one."""
        done = self._done.get((peer.name, command.id))
        if done is None or done[0] != command or not isinstance(done[1], Accepted | Planned):
            return None
        self._write_down(command, peer, "repeated", "")
        return msgspec.structs.replace(done[1], repeated=True)

    def _not_done(self, command: Command, peer: Peer, code: Code, text: str) -> Refused:
        if code is not Code.BUSY:
            self._write_down(command, peer, code.value, text)
        return self._refuse(command.id, code, text)

    def _write_down(self, command: Command, peer: Peer, outcome: str, text: str) -> None:
        self._audit(
            AuditEntry(
                client=peer.name,
                role=peer.role.value,
                address=peer.address,
                id=command.id,
                command=command.kind.value,
                node=command.node or ",".join(command.nodes),
                outcome=outcome,
                text=text,
            )
        )

    def _plan_flight(self, request: PlanFlight, peer: Peer, now_ns: int) -> Answer:
        """What a flight over the nodes is, handed to the mission unless it is only asked for."""
        command = Command(
            request.id,
            CommandKind.PLAN,
            nodes=request.nodes,
            levels=request.levels,
            counts=shelf_counts(request.counts),
            waits=request.waits,
        )
        if not request.dry and (repeated := self._repeated(command, peer)) is not None:
            return repeated
        code, text = self._against_plan(request, peer, now_ns)
        if code is None and self._plans is not None:
            planned = self._plans.planned(request, now_ns)
            if isinstance(planned, Planned):
                if request.dry:
                    return planned
                taken = replace(command, nodes=planned.nodes if request.nodes else ())
                return self._accept(taken, peer, planned, asked=command)
            code, text = planned
        code = code or Code.UNAVAILABLE
        return (
            self._refuse(request.id, code, text) if request.dry else self._not_done(command, peer, code, text)
        )

    def _against_plan(self, request: PlanFlight, peer: Peer, now_ns: int) -> tuple[Code | None, str]:
        """Why a plan is not looked at, if it is not."""
        order = Order(
            version=request.version,
            id=request.id,
            command=CommandKind.PLAN,
            session=request.session,
            seen_ns=request.seen_ns,
            waits=request.waits,
        )
        if request.counts is not None and not request.nodes:
            return Code.MALFORMED, "a plan comes with its nodes: op plan_flight"
        if request.waits and not request.nodes and not request.dry:
            return Code.MALFORMED, "a plan that waits at its end has nodes"
        if self._plans is None:
            return Code.UNAVAILABLE, "no flight is planned here yet; ask again in a moment"
        if request.dry:  # planned between two ticks: not while it flies
            phase = self.status.phase if self.status is not None else Phase.PREFLIGHT
            return (None, "") if phase in WAITING else (Code.PHASE, impossible(phase))
        return self._objection(order, peer, now_ns, planned=True)

    def _standing_plan(self, request: AskPlan) -> Answer:
        if self._plans is None:
            return self._refuse(request.id, Code.UNAVAILABLE, "no flight is planned here yet")
        return self._plans.standing(request)

    def _objection(
        self, order: Order, peer: Peer, now_ns: int, *, planned: bool = False
    ) -> tuple[Code | None, str]:
        """Why an order cannot be obeyed, if it cannot; `planned`: it came with its plan."""
        id_known = (peer.name, order.id) in self._done
        phase = self.status.phase if self.status is not None else Phase.PREFLIGHT
        kind, node = order.command, order.node
        checks = (
            (
                not self._has_time(peer, kind, now_ns),
                Code.BUSY,
                f"more than {_ORDERS_PER_S} commands a second",
            ),
            (
                peer.role is not Role.OPERATOR and not _takes_start_back(kind, phase),
                Code.ROLE,
                f"{peer.name} is a {peer.role}; commands need the role operator",
            ),
            (
                kind not in _NEVER_LATE and bool(order.seen_ns) and now_ns - order.seen_ns > _LATE_NS,
                Code.LATE,
                f"{kind} was given {(now_ns - order.seen_ns) * 1e-9:.0f} s ago: look, and give it again",
            ),
            (id_known, Code.ID_REUSED, "this id was used for another command; make a new one for each"),
            (
                order.session not in {"", self._session},
                Code.SESSION,
                "flightd was started anew since; say hello again",
            ),
            (
                (kind is CommandKind.GOTO) != bool(node) or (order.counts is not None and not node),
                Code.MALFORMED,
                "goto needs a node, the other commands have none",
            ),
            (
                any(one.node != node for one in order.counts or ()),
                Code.MALFORMED,
                f"the counts of a goto are of its own node, here {node}",
            ),
            (
                (kind is CommandKind.PLAN) != planned,
                Code.MALFORMED,
                "a plan comes with its nodes: op plan_flight",
            ),
            (
                bool(order.plan) and kind is not CommandKind.START,
                Code.MALFORMED,
                "only start names the plan that it is for",
            ),
            (
                order.waits and kind not in _WAIT,
                Code.MALFORMED,
                "only goto and a plan over nodes end by waiting",
            ),
            (
                order.lands and (kind is not CommandKind.GOTO or order.waits),
                Code.MALFORMED,
                "only a goto that does not wait lands on another pad",
            ),
            (
                order.lands and node in self._nodes - self._pads,
                Code.NODE,
                f"no pad at {node}",
            ),
            (
                bool(node) and node not in self._nodes,
                Code.NODE,
                f"no node {node!r} on site {self._floor.name}",
            ),
            (kind not in self.possible, Code.PHASE, self._impossible(kind, phase)),
            (
                kind is CommandKind.START and self.looked_after(),
                Code.BUSY,
                "the drone is looked after just now: start it in a moment",
            ),
        )
        return next(((code, text) for applies, code, text in checks if applies), (None, ""))

    def _impossible(self, kind: CommandKind, phase: Phase) -> str:
        """Why the mission does not take an order now."""
        if kind is CommandKind.PLAN:
            return impossible(phase)
        if kind is CommandKind.START and phase in WAITING and self.status is not None:
            return f"cannot {kind}: {self.status.reason}"
        return f"cannot {kind} in phase {phase}"

    def _has_time(self, peer: Peer, kind: CommandKind, now_ns: int) -> bool:
        """Hold back who orders too much; what is urgent always gets through."""
        if kind in _URGENT and peer.role is Role.OPERATOR:
            return True
        lately = sum(name == peer.name and now_ns - at_ns < 10**9 for name, at_ns in self._recent)
        if lately >= _ORDERS_PER_S or len(self._commands) >= _ORDERS_WAITING:
            return False
        self._recent.append((peer.name, now_ns))
        return True

    def _accept(self, command: Command, peer: Peer, answer: Answer, asked: Command | None = None) -> Answer:
        """Hand a command to the mission; `asked`: as the client put it, where that is otherwise."""
        self._done[peer.name, command.id] = (asked or command, answer)
        if len(self._done) > _REMEMBERED_ORDERS:
            self._done.popitem(last=False)
        self._write_down(command, peer, "accepted", "")
        if not any(waiting.kind is command.kind for waiting in self._commands if command.kind in _URGENT):
            self._commands.append(command)
        return answer

    def _attend(self, request: Attend, peer: Peer, now_ns: int) -> Answer:
        if peer.role is not Role.OPERATOR:
            return self._refuse(request.id, Code.ROLE, f"{peer.name} is a {peer.role}; only operators attend")
        who = (peer.name, peer.route)
        lost = [other for other, at_ns in self._heard_ns.items() if now_ns - at_ns > _TAKEN_OVER_NS]
        for other in lost:
            del self._heard_ns[other]
        if request.leave:
            self._heard_ns.pop(who, None)
        elif who in self._heard_ns or len(self._heard_ns) < _ATTENDING:
            self._heard_ns[who] = now_ns
        else:
            return self._refuse(request.id, Code.BUSY, f"{_ATTENDING} clients attend already")
        return Accepted(request=request.id)

    def _refuse(self, request_id: str, code: Code, text: str) -> Refused:
        self.refused += 1
        return Refused(request=request_id, code=code, text=text)


def _takes_start_back(kind: CommandKind, phase: Phase) -> bool:
    """What anybody who looks on may order: he sees who stands beside the drone that is about to start."""
    return kind is CommandKind.PAUSE and (phase in WAITING or phase is Phase.ARMING)


def _wrong_version(envelope: Envelope) -> str:
    theirs = f"version {envelope.version}" if envelope.version else "no version"
    return f"this flightd speaks version {VERSION} of the ground protocol, the client {theirs}: update it"
