"""Answers requests from the ground.  No sockets here: bytes in, answer out.

Nothing that a stranger can send raises; whatever has no effect is refused with a reason.
"""

from __future__ import annotations

from collections import OrderedDict, deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from flightd import __version__
from flightd.adapters.ground_link.audit import AuditEntry
from flightd.adapters.ground_link.floor_status import floor_status
from flightd.adapters.ground_link.protocol import (
    DECODE_ERRORS,
    VERSION,
    Accepted,
    Answer,
    AskInventory,
    AskPicture,
    AskStatus,
    Attend,
    CameraOptics,
    Code,
    Envelope,
    EventReport,
    Hello,
    InventoryAnswer,
    Order,
    Refused,
    Request,
    Role,
    StatusAnswer,
    StatusReport,
    Welcome,
    decode_envelope,
    decode_request,
)
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
_LATE_NS = 5_000_000_000
"""By an older status nothing else is ordered: the order lay in a queue, or its giver saw nothing."""


@dataclass(frozen=True, slots=True)
class Peer:
    """Where a request came from: `name` and `role` by its key, `route` its connection."""

    name: str
    role: Role
    route: bytes = b""
    address: str = ""


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
        self._floor = floor_status(site)
        self._session = session
        self._audit = audit
        self._picture_fps = picture_fps
        self._inventory = inventory
        self._cameras = tuple(cameras)
        self._optics = tuple(optics)
        self._commands: deque[Command] = deque()
        self._done: OrderedDict[tuple[str, str], tuple[CommandKind, str]] = OrderedDict()
        self._recent: deque[tuple[str, int]] = deque(maxlen=_ORDERS_PER_S * 8)
        self._heard_ns: dict[tuple[str, bytes], int] = {}
        self.events: deque[EventReport] = deque(maxlen=_RECENT_EVENTS)
        self.status: StatusReport | None = None
        self.possible = possible_commands(BEGIN)
        """The commands that the mission takes now."""
        self.requests = 0
        self.refused = 0

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

    def answer(self, body: bytes, peer: Peer, now_ns: int) -> Answer | AskPicture:
        """What to answer to `body`, or the request for a picture, which takes a while."""
        self.requests += 1
        request = self._read(body)
        match request:
            case Hello():
                return self._welcome(request, peer)
            case Order():
                return self._order(request, peer, now_ns)
            case Attend():
                return self._attend(request, peer, now_ns)
            case Refused():
                return request
        return self._show(request)

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

    def _show(self, request: AskStatus | AskInventory | AskPicture) -> Answer | AskPicture:
        if isinstance(request, AskStatus):
            return StatusAnswer(request=request.id, status=self.status)
        if isinstance(request, AskPicture):
            if self._picture_fps == 0:
                text = "pictures are off: set ground.picture_fps"
                return self._refuse(request.id, Code.UNAVAILABLE, text)
            if request.camera not in self._cameras:
                text = f"this flight uses no {request.camera} camera"
                return self._refuse(request.id, Code.UNAVAILABLE, text)
            return request
        if self._inventory is None:
            return self._refuse(request.id, Code.UNAVAILABLE, "this flightd keeps no inventory store")
        return InventoryAnswer(request=request.id, places=tuple(self._inventory()))

    def refuse_picture(self, request: AskPicture, code: Code, text: str) -> Refused:
        """The answer to a request for a picture that cannot be served."""
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
        known = self._done.get((peer.name, order.id))
        answer: Answer
        if known == (order.command, order.node):
            answer, outcome, text = Accepted(request=order.id, repeated=True), "repeated", ""
        else:
            code, text = self._objection(order, peer, now_ns, known is not None)
            if code is None:
                self._accept(order, peer)
                answer, outcome = Accepted(request=order.id), "accepted"
            else:
                answer, outcome = self._refuse(order.id, code, text), code.value
        if outcome != Code.BUSY:
            self._audit(
                AuditEntry(
                    client=peer.name,
                    role=peer.role.value,
                    address=peer.address,
                    id=order.id,
                    command=order.command.value,
                    node=order.node,
                    outcome=outcome,
                    text=text,
                )
            )
        return answer

    def _objection(self, order: Order, peer: Peer, now_ns: int, id_known: bool) -> tuple[Code | None, str]:
        """Why an order cannot be obeyed, if it cannot."""
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
                (kind is CommandKind.GOTO) != bool(node),
                Code.MALFORMED,
                "goto needs a node, the other commands have none",
            ),
            (
                bool(node) and node not in self._nodes,
                Code.NODE,
                f"no node {node!r} on site {self._floor.name}",
            ),
            (kind not in self.possible, Code.PHASE, self._impossible(kind, phase)),
        )
        return next(((code, text) for applies, code, text in checks if applies), (None, ""))

    def _impossible(self, kind: CommandKind, phase: Phase) -> str:
        """Why the mission does not take an order now."""
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

    def _accept(self, order: Order, peer: Peer) -> None:
        self._done[peer.name, order.id] = (order.command, order.node)
        if len(self._done) > _REMEMBERED_ORDERS:
            self._done.popitem(last=False)
        command = Command(order.id, order.command, order.node)
        if not any(waiting.kind is command.kind for waiting in self._commands if command.kind in _URGENT):
            self._commands.append(command)

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
