"""A client of the ground link, as `flightctl` and tests use it."""

from __future__ import annotations

import asyncio
import hashlib
import socket
import uuid
from collections.abc import AsyncIterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Self, TypeVar

import zmq
import zmq.asyncio
from zmq.utils.monitor import parse_monitor_message

from flightd.adapters.ground_link.keys import KeyPair, load_pair, load_public
from flightd.adapters.ground_link.messages.answers import (
    Accepted,
    Code,
    InventoryAnswer,
    PictureAnswer,
    PlanAnswer,
    Planned,
    Refused,
    StatusAnswer,
    Welcome,
)
from flightd.adapters.ground_link.messages.base import VERSION
from flightd.adapters.ground_link.messages.counts import Counts
from flightd.adapters.ground_link.messages.maintenance import (
    MOST_PROFILE_BYTES,
    AskDoctor,
    AskSettings,
    DoctorAnswer,
    FixParameter,
    InstallProfile,
    ProposeSettings,
    Restart,
    SettingsAnswer,
    TakeSettingsBack,
)
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
from flightd.adapters.ground_link.protocol import (
    DECODE_ERRORS,
    EVENT_TOPIC,
    STATUS_TOPIC,
    Answer,
    Request,
    decode_answer,
    decode_event,
    decode_status,
    encode,
)
from flightd.core.errors import InputError, RunError, TransientError, UnavailableError
from flightd.core.preview import CameraName
from flightd.core.types import CommandKind
from flightd.runtime.within import Within

RETRY_S = 1.0
"""An answer that does not come for so long is asked for again, with the same id."""

MAINTENANCE_S, PROPOSAL_S = 15.0, 75.0
"""What looks after the drone takes a while: a look, and a proposal that is checked as a whole."""

_NAME_S = 1.0

_KINDS_OF_INPUT = {
    Code.MALFORMED, Code.VERSION, Code.NODE, Code.PLAN, Code.UNAVAILABLE, Code.INVALID,
}  # fmt: skip
_WATCHED: Final = (
    zmq.Event.CONNECTED
    | zmq.Event.HANDSHAKE_SUCCEEDED
    | zmq.Event.HANDSHAKE_FAILED_AUTH
    | zmq.Event.HANDSHAKE_FAILED_PROTOCOL
    | zmq.Event.HANDSHAKE_FAILED_NO_DETAIL
)
"""What is asked for of what ZMQ tells.  It waits until that is read, and so would the end of the connection:
of all that it tells of each new try, nobody could leave a daemon that was away for a minute."""
_SHUT_OUT = {zmq.Event.HANDSHAKE_FAILED_AUTH, zmq.Event.HANDSHAKE_FAILED_PROTOCOL}
"""Events after which asking again is of no use."""

_A = TypeVar("_A")
_S = TypeVar("_S", StatusReport, "StatusReport | None")


@dataclass(frozen=True, slots=True)
class Address:
    """Where a daemon listens, and the keys to it: ours, and the daemon's public one (both or none)."""

    host: str = "127.0.0.1"
    status_port: int = 5571
    command_port: int = 5572
    keys: KeyPair | None = None
    server_key: str | None = None

    @classmethod
    def with_keys(cls, host: str, ports: tuple[int, int], key: Path | None, server_key: Path | None) -> Self:
        """The address with what is in the key files: ours, secret, and the daemon's.  `ports` are those of
        status and commands.  InputError for one key without the other, and for files that hold none."""
        if (key is None) != (server_key is None):
            raise InputError("belong together: yours, and the daemon's public one", key="--key, --server-key")
        keys = None if key is None else load_pair(key)
        return cls(host, *ports, keys, None if server_key is None else load_public(server_key))

    def endpoint(self, port: int) -> str:
        return f"tcp://[{self.host}]:{port}" if ":" in self.host else f"tcp://{self.host}:{port}"


class GroundClient:
    """Connected while entered: `async with GroundClient(address) as client`.

    Calls may run beside each other: none waits for another's answer.  Each raises UnavailableError when no
    daemon answers within `timeout_s` (saying why, as far as ZMQ knows), InputError when it refuses what was
    asked for, RunError when it refuses to do it.
    """

    def __init__(self, address: Address, name: str = "flightctl", timeout_s: float = 3.0) -> None:
        self._address = address
        self._name = name
        self._timeout_s = timeout_s
        self._context = zmq.asyncio.Context()
        self._requests: Any = self._socket(zmq.DEALER)
        self._status: Any = self._socket(zmq.SUB)
        self._monitor: Any = self._requests.get_monitor_socket(_WATCHED)
        self._asked: dict[asyncio.Future[tuple[Answer, list[bytes]]], str] = {}
        """What waits, for the answer to which request: an order may be sent again while the first waits."""
        self._reading: asyncio.Task[None] | None = None
        self._seen: set[int] = set()
        self.session = ""
        self._seen_ns = 0
        """`stamp_ns` of the newest status; 0 before the first."""

    async def __aenter__(self) -> Self:
        address = self._address
        self._status.subscribe(STATUS_TOPIC)
        self._status.subscribe(EVENT_TOPIC)
        try:
            self._requests.connect(address.endpoint(address.command_port))
            self._status.connect(address.endpoint(address.status_port))
        except zmq.ZMQError as err:
            self._close()
            raise InputError(
                f"{address.endpoint(address.command_port)}: {err.strerror}: no such host"
            ) from None
        if self._reading is None:
            self._reading = asyncio.create_task(self._read(), name="ground link answers")
        return self

    async def __aexit__(self, *_: object) -> None:
        if self._reading is not None:
            self._reading.cancel()
            await asyncio.wait([self._reading])
        for asked in self._waiting(""):
            asked.set_exception(UnavailableError("the connection was given up"))
        self._close()

    async def hello(self) -> Welcome:
        """Say hello; raises InputError when the daemon speaks another version of the protocol."""
        welcome = await self._ask(Hello(version=VERSION, id=_new_id(), client=self._name), Welcome)
        self.session = welcome.session
        return welcome

    async def order(
        self,
        kind: CommandKind,
        node: str = "",
        order_id: str = "",
        *,
        session: str | None = None,
        seen_ns: int | None = None,
        plan: str = "",
        waits: bool = False,
        lands: bool = False,
        counts: Counts = None,
    ) -> Accepted:
        """Give a command; sent again until it is answered, done once.  It is for the flight `session`, given
        by who saw the status of `seen_ns`; left out: this client's, and the newest that it heard.  A start
        may name the `plan` that it is for; a goto that `waits` leads to a node to hold there, one that
        `lands` down onto its pad; `counts` is all that is counted at its node."""
        order = Order(
            version=VERSION,
            id=order_id or _new_id(),
            command=kind,
            node=node,
            plan=plan,
            session=self.session if session is None else session,
            seen_ns=self._seen_ns if seen_ns is None else seen_ns,
            waits=waits,
            lands=lands,
            counts=counts,
        )
        return await self._ask(order, Accepted)

    async def plan_flight(
        self,
        nodes: Sequence[str],
        levels: Sequence[int] = (),
        order_id: str = "",
        *,
        best_order: bool = False,
        dry: bool = False,
        session: str | None = None,
        seen_ns: int | None = None,
        waits: bool = False,
        counts: Counts = None,
    ) -> Planned:
        """Hand a drone that stands disarmed the nodes of its next flight, at whose end it holds where it
        `waits`, or (`dry`) only ask what that would be; `counts` is all that is counted, in place of
        `levels`; the rest as `order`."""
        request = PlanFlight(
            version=VERSION,
            id=order_id or _new_id(),
            nodes=tuple(nodes),
            levels=tuple(levels),
            best_order=best_order,
            dry=dry,
            session=self.session if session is None else session,
            seen_ns=self._seen_ns if seen_ns is None else seen_ns,
            waits=waits,
            counts=counts,
        )
        return await self._ask(request, Planned)

    async def plan(self) -> PlanAnswer:
        """The plan that is flown, or would be with the next start, and what is left of it."""
        return await self._ask(AskPlan(version=VERSION, id=_new_id()), PlanAnswer)

    async def attend(self, leave: bool = False) -> Accepted:
        """Say that somebody watches this flight (at least once a second), or no longer does."""
        return await self._ask(Attend(version=VERSION, id=_new_id(), leave=leave), Accepted)

    async def status(self) -> StatusReport | None:
        """The newest status, None before the daemon's first tick."""
        status = (await self._ask(AskStatus(version=VERSION, id=_new_id()), StatusAnswer)).status
        return self._noted(status)

    async def inventory(self) -> tuple[dict[str, str], ...]:
        """What has been counted, place by place."""
        return (await self._ask(AskInventory(version=VERSION, id=_new_id()), InventoryAnswer)).places

    async def picture(self, camera: CameraName = CameraName.DOWN) -> tuple[PictureAnswer, bytes]:
        """A camera's next picture and its JPEG."""
        request = AskPicture(version=VERSION, id=_new_id(), camera=camera)
        answer, frames = await self._answer(request, max(self._timeout_s, 4.0))
        picture = _expected(answer, PictureAnswer)
        if len(frames) < 2:
            raise TransientError("the daemon's picture came without its JPEG")
        return picture, frames[1]

    async def doctor(self) -> DoctorAnswer:
        """What the drone finds of itself; RunError where it does not stand on the ground."""
        return await self._ask(AskDoctor(version=VERSION, id=_new_id()), DoctorAnswer, MAINTENANCE_S)

    async def fix(self, name: str, person: str = "") -> DoctorAnswer:
        """Have a parameter of the autopilot set right and read back; what the drone finds then."""
        request = FixParameter(version=VERSION, id=_new_id(), name=name, person=person)
        return await self._ask(request, DoctorAnswer, MAINTENANCE_S)

    async def settings(self) -> SettingsAnswer:
        """The configuration's file as it stands."""
        return await self._ask(AskSettings(version=VERSION, id=_new_id()), SettingsAnswer, MAINTENANCE_S)

    async def propose(self, base: str, changes: Mapping[str, Any], person: str = "") -> SettingsAnswer:
        """Have keys changed of the settings that `base` names; InputError where that is no sound
        configuration."""
        request = ProposeSettings(
            version=VERSION, id=_new_id(), base=base, changes=dict(changes), person=person
        )
        return await self._ask(request, SettingsAnswer, PROPOSAL_S)

    async def take_back(self, base: str, version: int, person: str = "") -> SettingsAnswer:
        """Have a kept version of the settings brought back."""
        request = TakeSettingsBack(
            version=VERSION, id=_new_id(), base=base, version_kept=version, person=person
        )
        return await self._ask(request, SettingsAnswer, PROPOSAL_S)

    async def install_profile(self, base: str, name: str, content: bytes, person: str = "") -> SettingsAnswer:
        """Have a colour profile laid beside the settings that `base` names, and named in them; InputError
        where it is none."""
        if len(content) > MOST_PROFILE_BYTES:
            raise InputError(
                f"profile {name} has {len(content)} bytes; {MOST_PROFILE_BYTES} at most are sent"
            )
        request = InstallProfile(
            version=VERSION,
            id=_new_id(),
            base=base,
            name=name,
            content=content,
            file_hash=hashlib.sha256(content).hexdigest(),
            person=person,
        )
        return await self._ask(request, SettingsAnswer, PROPOSAL_S)

    async def restart(self, person: str = "") -> Accepted:
        """Have the daemon started anew."""
        return await self._ask(Restart(version=VERSION, id=_new_id(), person=person), Accepted)

    async def published(self) -> AsyncIterator[StatusReport | EventReport]:
        """Every status and event from now on, for ever.  InputError for a message of another version."""
        while True:
            topic, body = (await self._status.recv_multipart())[:2]
            try:
                yield self._noted(decode_status(body)) if topic == STATUS_TOPIC else decode_event(body)
            except DECODE_ERRORS as err:
                raise InputError(f"the daemon's {topic.decode()} message is not ours: {err}") from None

    def _noted(self, status: _S) -> _S:
        if status is not None:
            self._seen_ns = max(self._seen_ns, status.stamp_ns)
        return status

    async def _ask(self, request: Request, kind: type[_A], least_s: float = 0.0) -> _A:
        return _expected((await self._answer(request, max(self._timeout_s, least_s)))[0], kind)

    async def _answer(self, request: Request, timeout_s: float) -> tuple[Answer, list[bytes]]:
        """The answer to this request, asked for again while it does not come."""
        asked: asyncio.Future[tuple[Answer, list[bytes]]] = asyncio.get_running_loop().create_future()
        self._asked[asked] = request.id
        try:
            async with Within(timeout_s):
                return await self._repeated(request, asked)
        except TimeoutError:
            raise UnavailableError(await self._why_silent()) from None
        finally:
            del self._asked[asked]
            asked.cancel()

    async def _repeated(
        self, request: Request, asked: asyncio.Future[tuple[Answer, list[bytes]]]
    ) -> tuple[Answer, list[bytes]]:
        patience_s = 4.0 if isinstance(request, AskPicture) else RETRY_S
        while True:
            await self._requests.send(encode(request))
            try:
                async with Within(patience_s):
                    return await asyncio.shield(asked)
            except TimeoutError:
                await self._note_events()
                if self._seen & _SHUT_OUT:
                    raise

    async def _read(self) -> None:
        """Give each answer to the call that asked for it; late ones, which nobody waits for any more, are
        left out.  One without a request's id, and one that cannot be read, may be anybody's."""
        while True:
            frames = await self._requests.recv_multipart()
            try:
                answer = decode_answer(frames[0])
            except DECODE_ERRORS as err:
                text = f"the daemon's answer is not of our protocol ({err}): update the older"
                for asked in self._waiting(""):
                    asked.set_exception(InputError(text))
                continue
            for asked in self._waiting(answer.request):
                asked.set_result((answer, frames))

    def _waiting(self, request_id: str) -> list[asyncio.Future[tuple[Answer, list[bytes]]]]:
        """What waits for the answer to a request, or for any where the id is empty."""
        return [asked for asked, of in self._asked.items() if request_id in ("", of) and not asked.done()]

    async def _why_silent(self) -> str:
        """What ZMQ saw happen to the connection, in words."""
        where = self._address.endpoint(self._address.command_port)
        await self._note_events()
        seen = self._seen
        if zmq.Event.HANDSHAKE_FAILED_AUTH in seen:
            return f"{where}: refused: this key is not on the daemon's list of clients"
        if zmq.Event.HANDSHAKE_FAILED_PROTOCOL in seen or zmq.Event.HANDSHAKE_FAILED_NO_DETAIL in seen:
            needs = "wrong keys" if self._address.keys else "it wants a key (--key, --server-key)"
            return f"{where}: refused the connection: {needs}, or it is no flightd"
        if zmq.Event.HANDSHAKE_SUCCEEDED in seen:
            return f"{where}: connected, but no answer in {self._timeout_s:g} s"
        if zmq.Event.CONNECTED in seen:
            needs = "wrong server key" if self._address.keys else "it wants a key (--key, --server-key)"
            return f"{where}: something listens there but does not shake hands: {needs}, or it is no flightd"
        if await self._is_unknown():
            return f"{where}: this name is not known here; look at its spelling, or give the drone's address"
        return f"{where}: nobody listens; is flightd running, with [ground] listen set?"

    async def _is_unknown(self) -> bool:
        """The host's name stands for no address; not where nobody says so in time."""
        loop = asyncio.get_running_loop()
        try:
            async with Within(_NAME_S):
                await loop.getaddrinfo(self._address.host, None)
        except socket.gaierror:
            return True
        except (TimeoutError, OSError, UnicodeError):
            pass
        return False

    async def _note_events(self) -> None:
        """Keep what ZMQ told of the connection since the last call."""
        while await self._monitor.poll(0):
            self._seen.add(parse_monitor_message(await self._monitor.recv_multipart())["event"])

    def _socket(self, kind: int) -> Any:
        socket: Any = self._context.socket(kind)
        socket.linger = 0
        socket.rcvhwm = 200
        socket.sndhwm = 50
        # a way that is gone is noticed on both sockets: one that only listens would wait for ever
        socket.heartbeat_ivl, socket.heartbeat_timeout = 1000, 4000
        socket.ipv6 = ":" in self._address.host
        if self._address.keys is not None:
            socket.curve_publickey = self._address.keys.public.encode()
            socket.curve_secretkey = self._address.keys.secret.encode()
            socket.curve_serverkey = (self._address.server_key or "").encode()
        return socket

    def _close(self) -> None:
        self._requests.disable_monitor()
        self._context.destroy(linger=0)


def _new_id() -> str:
    return uuid.uuid4().hex


def _expected(answer: Answer, kind: type[_A]) -> _A:
    if isinstance(answer, Refused):
        error = InputError if answer.code in _KINDS_OF_INPUT else RunError
        raise error(f"refused: {answer.text}")
    if not isinstance(answer, kind):
        raise TransientError(f"the daemon answered {type(answer).__name__}, not {kind.__name__}")
    return answer
