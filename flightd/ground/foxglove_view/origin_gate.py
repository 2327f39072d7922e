"""The door before the SDK's server, which looks at nobody's origin: a page that a browser of this machine
shows, of whatever site, could read warehouse and pictures.

What comes without an origin is no page; of pages only Foxglove's own are let in.  Behind the door the SDK's
server listens at a loopback address that is drawn by lot and told to nobody.
"""

from __future__ import annotations

import asyncio
import contextlib
import secrets
import socket
import threading

from flightd.core.errors import UnavailableError
from flightd.ground.bounded import Room
from flightd.runtime.within import Within

MOST_VIEWERS = 8
"""More are turned away: each costs memory and time."""
FOXGLOVES_PAGE = "https://app.foxglove.dev"
"""Foxglove in the browser; its program for the desktop shows pages of schemes that no site has."""

_HEAD_BYTES = 8192
_HEAD_S = 5.0
_HELD_BYTES = 1 << 16
"""What waits here for a slow viewer; beyond it the SDK's server waits, and drops."""
_GOOD_BYE_S = 0.5
_JOIN_S = 5.0


def hidden_address() -> str:
    """A loopback address that no page can guess."""
    return f"127.{secrets.randbelow(254) + 1}.{secrets.randbelow(254) + 1}.{secrets.randbelow(254) + 1}"


def is_let_in(head: bytes) -> bool:
    """Whether a request comes from no page of a foreign site, by all its Origin headers."""
    named = [line.partition(b":") for line in head.split(b"\r\n")[1:]]
    origins = [
        value.strip().decode("latin-1") for name, _, value in named if name.strip().lower() == b"origin"
    ]
    return all(map(_is_foxgloves, origins))


def _is_foxgloves(origin: str) -> bool:
    scheme, found, _ = origin.partition("://")
    return origin == FOXGLOVES_PAGE or bool(found and scheme.isalpha() and scheme.lower() not in _OF_SITES)


_OF_SITES = {"http", "https", "ws", "wss"}


class OriginGate:
    """Lets viewers from `listener` through to a server at `behind`, on a thread of its own, until closed."""

    def __init__(self, listener: socket.socket, behind: tuple[str, int]) -> None:
        self._listener = listener
        self._behind = behind
        self._room = Room(MOST_VIEWERS, "too many viewers look on")
        self._loop = asyncio.new_event_loop()
        self._ending = asyncio.Event()
        self._inside: set[asyncio.Task[None]] = set()
        self._thread = threading.Thread(target=self._run, name="foxglove gate", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End every connection; idempotent."""
        with contextlib.suppress(RuntimeError):  # the loop has been closed
            self._loop.call_soon_threadsafe(self._ending.set)
        self._thread.join(_JOIN_S)

    def _run(self) -> None:
        with asyncio.Runner(loop_factory=lambda: self._loop) as runner:
            runner.run(self._serve())

    async def _serve(self) -> None:
        server = await asyncio.start_server(self._come, sock=self._listener, limit=_HEAD_BYTES)
        await self._ending.wait()
        server.close()
        if self._inside:  # the server behind says good-bye
            _, staying = await asyncio.wait(self._inside, timeout=_GOOD_BYE_S)
            for viewer in staying:
                viewer.cancel()
            if staying:
                await asyncio.wait(staying)

    async def _come(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        viewer = asyncio.current_task()
        assert viewer is not None
        self._inside.add(viewer)
        try:
            with self._room.taken():
                await self._through(reader, writer)
        except UnavailableError as err:
            await _refuse(writer, "503 Service Unavailable", str(err))
        except (OSError, TimeoutError, asyncio.IncompleteReadError, asyncio.LimitOverrunError):
            pass  # it went, or said nothing of use
        except asyncio.CancelledError:
            writer.transport.abort()  # what it does not take is given up
            raise
        finally:
            writer.close()
            self._inside.discard(viewer)

    async def _through(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        async with Within(_HEAD_S):
            head = await reader.readuntil(b"\r\n\r\n")
        if not is_let_in(head):
            await _refuse(writer, "403 Forbidden", "a page of another site")
            return
        from_server, to_server = await asyncio.open_connection(*self._behind)
        try:
            to_server.write(head)
            for held in (writer, to_server):
                held.transport.set_write_buffer_limits(_HELD_BYTES)
            directions = [
                asyncio.ensure_future(_pass_on(from_server, writer)),
                asyncio.ensure_future(_pass_on(reader, to_server)),
            ]
            try:
                await asyncio.wait(directions, return_when=asyncio.FIRST_COMPLETED)
            finally:
                for direction in directions:
                    direction.cancel()
                await asyncio.wait(directions)
        finally:
            to_server.close()


async def _pass_on(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Until one of them ends; what is not taken is not read."""
    with contextlib.suppress(OSError):
        while part := await reader.read(_HELD_BYTES):
            writer.write(part)
            await writer.drain()


async def _refuse(writer: asyncio.StreamWriter, status: str, why: str) -> None:
    body = f"{why}\n".encode()
    head = [
        f"HTTP/1.1 {status}",
        "Content-Type: text/plain",
        f"Content-Length: {len(body)}",
        "Connection: close",
    ]
    with contextlib.suppress(OSError):
        writer.write("\r\n".join([*head, "", ""]).encode() + body)
        await writer.drain()
