"""Who may come in: the ZAP (ZMQ RFC 27) handler that checks each CURVE key against the allow-list.

Own code: of pyzmq 27.3's authenticator nothing would be left.  It lets NULL and GSSAPI in without a question,
leaves 400 of 2,000 random requests unanswered (a REP socket is stuck after that), counts no refusal, and runs
in a task of its own that nobody awaits, so that its death shuts everybody out without a word.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import zmq
import zmq.asyncio
from zmq.utils import z85

from flightd.adapters.ground_link.keys import Client

_ENDPOINT = "inproc://zeromq.zap.01"
_VERSION = b"1.0"
DOMAIN = b"flightd"


class Authenticator:
    """Answers ZMQ's question for each new connection; bind it before the sockets it keeps.

    A client that is let in carries its public key as the `User-Id` of every message; nobody can claim
    another's.  The others are counted in `denied`.
    """

    def __init__(self, context: zmq.asyncio.Context, clients: Mapping[str, Client]) -> None:
        self._clients = clients
        self._socket: Any = context.socket(zmq.REP)
        self._socket.linger = 0
        self._socket.bind(_ENDPOINT)
        self.denied = 0

    async def run(self) -> None:
        """Answer until cancelled."""
        while True:
            request = await self._socket.recv_multipart()
            await self._socket.send_multipart(self.answer(request))

    def answer(self, request: list[bytes]) -> list[bytes]:
        """The ZAP reply to a ZAP request."""
        number = request[1] if len(request) > 1 else b""
        key = _curve_key(request)
        if key is not None and key in self._clients:
            return [_VERSION, number, b"200", b"OK", key.encode(), b""]
        self.denied += 1
        return [_VERSION, number, b"400", b"not on the allow-list", b"", b""]

    def close(self) -> None:
        self._socket.close()


def _curve_key(request: list[bytes]) -> str | None:
    """The public key that a ZAP request speaks of; None where it speaks of none."""
    if len(request) != 7 or request[0] != _VERSION or request[5] != b"CURVE" or len(request[6]) != 32:
        return None
    return z85.encode(request[6]).decode()
