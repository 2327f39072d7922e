"""The ground link's sockets: status and events out, requests in."""

from __future__ import annotations

import asyncio
import secrets
import time
from collections import Counter, deque
from collections.abc import Callable, Sequence
from typing import Any, Self, TypeAlias

import zmq
import zmq.asyncio

from flightd.adapters.ground_link.audit import AuditEntry, AuditLog
from flightd.adapters.ground_link.authenticator import DOMAIN, Authenticator
from flightd.adapters.ground_link.keys import Client, KeyPair, load_clients, load_pair
from flightd.adapters.ground_link.maintenance_desk import Maintainer, MaintenanceDesk
from flightd.adapters.ground_link.messages.answers import Code
from flightd.adapters.ground_link.messages.base import VERSION, Role
from flightd.adapters.ground_link.messages.floor import CameraOptics
from flightd.adapters.ground_link.messages.maintenance import Maintenance
from flightd.adapters.ground_link.messages.published import EventReport, LinkReport
from flightd.adapters.ground_link.messages.requests import AskPicture
from flightd.adapters.ground_link.peer import Peer
from flightd.adapters.ground_link.picture_answer import picture_answer
from flightd.adapters.ground_link.protocol import EVENT_TOPIC, MAX_REQUEST_BYTES, STATUS_TOPIC, Answer, encode
from flightd.adapters.ground_link.request_handler import RequestHandler
from flightd.adapters.ground_link.status_report import status_report
from flightd.config.ground import GroundConfig
from flightd.core.errors import TransientError, UnavailableError
from flightd.core.planned_flight import Planner
from flightd.core.preview import CameraName, Preview
from flightd.core.snapshot import Snapshot
from flightd.core.types import Command, Event
from flightd.ports import Clock
from flightd.site.site import Site

_LOCAL = Client("local", Role.OPERATOR)
"""Who may connect without a key: this machine's own users."""

_Waiting: TypeAlias = "deque[tuple[list[bytes], AskPicture, int]]"
"""Who asked for a picture, what, and when."""

_REQUESTS_AT_ONCE = 10
_TURN_S = 0.001
_REST_S = 0.005
_REST_SHARE = 4.0
"""After so many requests, or so long, the loop is left to the flight: for the rest, or a multiple of the
time taken if that is longer.  2,000 requests a second and a fifth of the loop's time at most."""

_PICTURES_WAITING = 32
_PICTURE_NS = 3_000_000_000
_STATUS_WAITING = 100
_REQUESTS_WAITING = 64
_LINGER_MS = 200


class ZmqGround:
    """`ports.Ground` over ZMQ.  A context manager: entered, it listens; `run` answers requests.

    Publishing never waits: a client that does not keep up misses messages, which their `seq` shows.
    """

    def __init__(
        self,
        config: GroundConfig,
        site: Site,
        clock: Clock,
        inventory: Callable[[], Sequence[dict[str, str]]] | None = None,
        cameras: Sequence[CameraName] = (CameraName.DOWN,),
        maintainer: Maintainer | None = None,
        optics: Sequence[CameraOptics] = (),
    ) -> None:
        """Read keys and allow-list.  InputError names what is wrong with them.  `cameras` are those that this
        flight has pictures of, `optics` their lenses and mounts; `maintainer` does what the ground asks to
        look after the drone."""
        self._config = config
        self._clock = clock
        self._keys: KeyPair | None = load_pair(config.server_key) if config.server_key else None
        self._clients = load_clients(config.clients) if config.clients else {}
        self._session = secrets.token_hex(8)
        self._audit: AuditLog | None = None
        self._handler = RequestHandler(
            site, self._session, self._write_down, config.picture_fps, inventory, cameras, optics
        )
        self._desk = MaintenanceDesk(
            maintainer,
            lambda request, peer: self._handler.maintenance_objection(request, peer, clock.now_ns()),
            self._send,
            self._write_down,
            self._handler.refuse_later,
        )
        self._handler.looked_after = lambda: self._desk.is_busy
        self._seq: Counter[bytes] = Counter()
        self._waiting: dict[CameraName, _Waiting] = {camera: deque() for camera in CameraName}
        self._picture_ns = dict.fromkeys(CameraName, -(10**12))
        self._dropped = 0
        self._context: zmq.asyncio.Context | None = None
        self._authenticator: Authenticator | None = None
        self._status: Any = None
        self._requests: Any = None

    def __enter__(self) -> Self:
        """Listen.  UnavailableError when a port is taken or the audit log cannot be written."""
        if self._config.audit is not None:
            self._audit = AuditLog(self._config.audit)
        self._context = zmq.asyncio.Context()
        try:
            if self._keys is not None:
                self._authenticator = Authenticator(self._context, self._clients)
            plain: zmq.Context[Any] = zmq.Context.shadow(self._context)
            self._status = self._listen(plain.socket(zmq.PUB), self._config.status_port, "status_port")
            self._requests = self._listen(
                self._context.socket(zmq.ROUTER), self._config.command_port, "command_port"
            )
        except UnavailableError:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        if self._authenticator is not None:
            self._authenticator.close()
        for socket in (self._status, self._requests):
            if socket is not None:
                socket.close(linger=_LINGER_MS)
        if self._context is not None:
            self._context.term()
        if self._audit is not None:
            self._audit.close()

    @property
    def endpoints(self) -> tuple[str, str]:
        """Where it listens: status, commands."""
        return _endpoint(self._status), _endpoint(self._requests)

    async def run(self) -> None:
        """Answer requests until cancelled.  TransientError when the sockets fail."""
        try:
            async with asyncio.TaskGroup() as tasks:
                tasks.create_task(self._answer_requests(), name="ground requests")
                tasks.create_task(self._desk.run(), name="ground maintenance")
                if self._authenticator is not None:
                    tasks.create_task(self._authenticator.run(), name="ground authenticator")
        except ExceptionGroup as group:
            failed, other = group.split(zmq.ZMQError)
            if failed is None or other is not None:
                raise
            raise TransientError(f"ground link: {failed.exceptions[0]}") from group

    def tell(self, snapshot: Snapshot) -> None:
        """Publish it."""
        self.give_up_pictures(snapshot.stamp_ns)
        authenticator = self._authenticator
        link = LinkReport(
            attending=self._handler.attending(snapshot.stamp_ns),
            requests=self._handler.requests,
            refused=self._handler.refused,
            denied=authenticator.denied if authenticator is not None else 0,
            dropped=self._dropped + (self._audit.dropped if self._audit is not None else 0),
        )
        report = status_report(snapshot, self._session, self._next(STATUS_TOPIC), link)
        self._handler.status = report
        self._handler.possible = snapshot.possible
        self._publish(STATUS_TOPIC, encode(report))

    def event(self, event: Event) -> None:
        """Publish an event."""
        report = EventReport(
            version=VERSION,
            session=self._session,
            seq=self._next(EVENT_TOPIC),
            stamp_ns=event.stamp_ns,
            level=event.level,
            name=event.name,
            text=event.text,
        )
        self._handler.events.append(report)
        self._publish(EVENT_TOPIC, encode(report))

    def plan_by(self, planner: Planner) -> None:
        """Plans are asked of it from now on."""
        self._handler.plan_by(planner)

    def take_commands(self) -> list[Command]:
        return self._handler.take_commands()

    def silent_s(self, now_ns: int) -> float:
        return self._handler.silent_ns(now_ns) * 1e-9

    @property
    def requests(self) -> int:
        """Requests heard so far, junk among them."""
        return self._handler.requests

    @property
    def refused(self) -> int:
        """Requests that were refused so far."""
        return self._handler.refused

    @property
    def pictures_wanted(self) -> int:
        """Requests that wait for a picture."""
        return sum(map(len, self._waiting.values()))

    def picture_due(self, stamp_ns: int, camera: CameraName = CameraName.DOWN) -> bool:
        """Somebody waits for a picture of that camera, and one exposed then does not exceed the rate."""
        fps = self._config.picture_fps
        due = bool(self._waiting[camera]) and (stamp_ns - self._picture_ns[camera]) * fps >= 10**9
        if due:
            self._picture_ns[camera] = stamp_ns
        return due

    def picture(self, preview: Preview) -> None:
        """Give the picture to all who wait for one of that camera."""
        waiting = self._waiting[preview.camera]
        while waiting:
            head, request, _ = waiting.popleft()
            self._send(head, picture_answer(preview, request.id), preview.jpeg)

    def _listen(self, socket: Any, port: int, key: str) -> Any:
        config = self._config
        socket.linger = _LINGER_MS
        socket.maxmsgsize = MAX_REQUEST_BYTES
        socket.sndhwm = _STATUS_WAITING
        socket.rcvhwm = _REQUESTS_WAITING
        socket.handshake_ivl = 5000
        socket.heartbeat_ivl = 2000
        socket.heartbeat_timeout = 6000
        socket.tcp_keepalive = 1
        socket.ipv6 = ":" in config.listen
        if self._keys is not None:
            socket.curve_server = True
            socket.curve_secretkey = self._keys.secret.encode()
            socket.zap_domain = DOMAIN
        if socket.type == zmq.ROUTER:
            socket.router_mandatory = True
        host = f"[{config.listen}]" if ":" in config.listen else config.listen
        host = "127.0.0.1" if host == "localhost" else host
        try:
            socket.bind(f"tcp://{host}:{port or '*'}")
        except zmq.ZMQError as err:
            socket.close()
            raise UnavailableError(
                f"ground.listen {config.listen}, {key} {port}: {err.strerror}; give an address of this "
                "machine and a free port"
            ) from None
        return socket

    async def _answer_requests(self) -> None:
        """One request after the other, with rests: a flood waits in the network, not in the flight."""
        while True:
            taken_s = 0.0
            for _ in range(_REQUESTS_AT_ONCE):
                frames = await self._requests.recv_multipart(copy=False)
                began_s = time.perf_counter()  # the loop's time, whatever clock the flight goes by
                self._take(frames)
                taken_s += time.perf_counter() - began_s
                if taken_s > _TURN_S:
                    break
            await asyncio.sleep(max(_REST_S, _REST_SHARE * taken_s))

    def _take(self, frames: Sequence[zmq.Frame]) -> None:
        """Answer one request; REQ sockets put an empty frame before the body, which is given back."""
        now_ns = self._clock.now_ns()
        *head, body = (frame.bytes for frame in frames)
        if len(head) not in {1, 2} or (len(head) == 2 and head[1]):
            head, body = head[:1], b""
        if not head:
            return
        peer = self._peer(head[0], frames[-1])
        if peer is None:
            return
        answer = self._handler.answer(body, peer, now_ns)
        if isinstance(answer, Maintenance):
            self._desk.hand_in(head, answer, peer)
        elif not isinstance(answer, AskPicture):
            self._send(head, answer)
        elif len(self._waiting[answer.camera]) < _PICTURES_WAITING:
            self._waiting[answer.camera].append((head, answer, now_ns))
        else:
            text = "too many clients wait for a picture; ask again later"
            self._send(head, self._handler.refuse_later(answer, Code.BUSY, text))

    def _peer(self, route: bytes, frame: zmq.Frame) -> Peer | None:
        """Who sent it, by the key of its connection; None for nobody that is known."""
        client = _LOCAL if self._keys is None else self._clients.get(_property(frame, "User-Id"))
        if client is None:
            return None
        return Peer(client.name, client.role, route, _property(frame, "Peer-Address"))

    def _send(self, head: list[bytes], answer: Answer, *more: bytes) -> None:
        sent = self._requests.send_multipart([*head, encode(answer), *more], zmq.NOBLOCK)
        if sent.done() and sent.exception() is not None:
            self._dropped += 1  # it is gone, or does not read its answers

    def _publish(self, topic: bytes, body: bytes) -> None:
        try:
            self._status.send_multipart([topic, body], zmq.NOBLOCK)
        except zmq.ZMQError:
            self._dropped += 1

    def give_up_pictures(self, now_ns: int) -> None:
        """Refuse the requests for a picture that no camera answered in time."""
        for camera, waiting in self._waiting.items():
            while waiting and now_ns - waiting[0][2] > _PICTURE_NS:
                head, request, _ = waiting.popleft()
                text = f"the {camera} camera delivers no picture"
                self._send(head, self._handler.refuse_later(request, Code.UNAVAILABLE, text))

    def _next(self, topic: bytes) -> int:
        self._seq[topic] += 1
        return self._seq[topic]

    def _write_down(self, entry: AuditEntry) -> None:
        if self._audit is not None:
            self._audit.write(entry)


def _property(frame: zmq.Frame, name: str) -> str:
    """A property of the connection, empty where it has none (peers of ZMQ's first protocols)."""
    try:
        return str(frame.get(name))
    except zmq.ZMQError:
        return ""


def _endpoint(socket: Any) -> str:
    return str(socket.getsockopt_string(zmq.LAST_ENDPOINT)).rstrip("\0")
