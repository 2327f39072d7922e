"""What looks after the drone on the ground takes a while: one after the other, beside the link."""

from __future__ import annotations

import asyncio
import logging
from collections import OrderedDict
from collections.abc import Callable
from typing import Protocol

import msgspec

from flightd.adapters.ground_link.audit import AuditEntry
from flightd.adapters.ground_link.maintenance_rules import changes_something
from flightd.adapters.ground_link.messages.answers import Code, Refused
from flightd.adapters.ground_link.messages.maintenance import Maintenance, ProposeSettings
from flightd.adapters.ground_link.peer import Peer
from flightd.adapters.ground_link.protocol import Answer
from flightd.core.errors import FlightdError, InputError, TransientError, UnavailableError

_LOG = logging.getLogger(__name__)

MOST_WAITING = 4
_REMEMBERED = 64
_DETAILS_SHOWN = 400


class Maintainer(Protocol):
    """The drone itself.  `serve` does what was asked for and answers; FlightdError with a line for a person
    where it is not done."""

    async def serve(self, request: Maintenance, peer: Peer) -> Answer: ...


class MaintenanceDesk:
    """`hand_in` takes a request, `run` has them done.  The same request again is answered again, not done
    again; `send` gives the answer to where it was asked, `objection` says why it is not done by now,
    `refuse` makes a refusal of it."""

    def __init__(
        self,
        maintainer: Maintainer | None,
        objection: Callable[[Maintenance, Peer], tuple[Code, str] | None],
        send: Callable[[list[bytes], Answer], None],
        audit: Callable[[AuditEntry], None],
        refuse: Callable[[Maintenance, Code, str], Refused],
    ) -> None:
        self._maintainer = maintainer
        self._objection = objection
        self._send = send
        self._audit = audit
        self._refuse = refuse
        self._waiting: asyncio.Queue[tuple[list[bytes], Maintenance, Peer]] = asyncio.Queue(MOST_WAITING)
        self._known: OrderedDict[tuple[str, str], tuple[Maintenance, Answer | None]] = OrderedDict()
        self.is_busy = False
        """Something is being done: no flight begins meanwhile."""

    def hand_in(self, head: list[bytes], request: Maintenance, peer: Peer) -> None:
        """Have it done, or refuse it at once."""
        known = self._known.get((peer.name, request.id))
        if known is not None:
            asked, answer = known
            if asked != request:
                text = "this id was used for something else; make a new one for each"
                self._send(head, self._refuse(request, Code.ID_REUSED, text))
            elif answer is not None:
                self._send(head, answer)
            return
        refusal = self._refusal(request, peer)
        if refusal is None and self._waiting.full():
            refusal = Code.BUSY, "the drone is looked after already: ask again in a moment"
        if refusal is not None:
            self._note(request, peer, refusal[0].value, refusal[1])
            self._send(head, self._refuse(request, *refusal))
            return
        self._known[peer.name, request.id] = request, None
        self._waiting.put_nowait((head, request, peer))

    async def run(self) -> None:
        """Do one after the other until cancelled."""
        while True:
            head, request, peer = await self._waiting.get()
            answer = await self._answer(request, peer)
            self._known[peer.name, request.id] = request, answer
            while len(self._known) > _REMEMBERED:
                self._known.popitem(last=False)
            self._send(head, answer)

    def _refusal(self, request: Maintenance, peer: Peer) -> tuple[Code, str] | None:
        if self._maintainer is None:
            return Code.UNAVAILABLE, "this flightd is not looked after from the ground"
        return self._objection(request, peer)

    async def _answer(self, request: Maintenance, peer: Peer) -> Answer:
        refusal = self._refusal(request, peer)  # it may have begun to fly while this waited
        if refusal is None:
            assert self._maintainer is not None
            self.is_busy = True
            try:
                answer = await self._maintainer.serve(request, peer)
            except FlightdError as err:
                refusal = _code_of(err), str(err)
            except (OSError, ArithmeticError, LookupError, TypeError, ValueError) as err:
                _LOG.exception("%s cannot be done", type(request).__name__)  # an error of ours ends no link
                refusal = Code.UNAVAILABLE, f"that failed: {type(err).__name__}; the drone's log says more"
            else:
                self._note(request, peer, "accepted", "")
                return answer
            finally:
                self.is_busy = False
        self._note(request, peer, refusal[0].value, refusal[1])
        return self._refuse(request, *refusal)

    def _note(self, request: Maintenance, peer: Peer, outcome: str, text: str) -> None:
        if not changes_something(request):
            return
        tag = request.__struct_config__.tag
        details = _details(request)
        self._audit(
            AuditEntry(
                client=peer.name,
                role=peer.role.value,
                address=peer.address,
                id=request.id,
                command=str(tag),
                node="",
                outcome=outcome,
                text=f"{details}: {text}" if text else details,
            )
        )


def _details(request: Maintenance) -> str:
    """What was asked for, in short, and by whom."""
    fields = msgspec.structs.asdict(request)
    person = str(fields.pop("person", ""))
    for plain in ("version", "id", "base", "content"):
        fields.pop(plain, None)
    said = request.changes if isinstance(request, ProposeSettings) else fields
    text = msgspec.json.encode(said).decode()[:_DETAILS_SHOWN]
    return f"{text} by {person}" if person else text


def _code_of(err: FlightdError) -> Code:
    if isinstance(err, InputError):
        return Code.INVALID
    return Code.UNAVAILABLE if isinstance(err, UnavailableError | TransientError) else Code.PHASE
