"""Messages between this process and a child of its, over a socket pair: the event loop never waits for them.

A child may be stopped, or die, in the middle of a message.  What has come of it is kept here until the rest
comes; who expects a message decides how long.
"""

from __future__ import annotations

import asyncio
import select
import socket
import struct
from collections.abc import Callable
from multiprocessing.reduction import ForkingPickler
from typing import Any

MOST_BYTES = 64 << 20
"""A picture of the largest size that is configured, as JPEG, and room to spare; longer is no message."""

_LENGTH = struct.Struct("<I")
_CHUNK_BYTES = 1 << 16
"""Read at once; then the loop's other work has its turn."""


class ChildEnd:
    """The child's end of a channel; it may wait."""

    def __init__(self, link: socket.socket) -> None:
        self._link = link
        self._received = bytearray()

    def fileno(self) -> int:
        return self._link.fileno()

    def send(self, message: Any) -> None:
        """Hand a message over.  OSError when the parent is gone."""
        self._link.sendall(_encoded(message))

    def receive(self) -> Any:
        """The next message.  EOFError when the parent is gone."""
        while (taken := _taken(self._received, MOST_BYTES)) is None:
            chunk = self._link.recv(_CHUNK_BYTES)
            if not chunk:
                raise EOFError
            self._received += chunk
        return taken[0]

    def has_news(self) -> bool:
        """Whether a message is coming, or the parent is gone: `receive` waits for no more than its rest."""
        return bool(self._received) or bool(select.select([self._link], [], [], 0.0)[0])


class Channel:
    """This process's end.  `theirs` is for the child, whose `ChildEnd` is made of it; who hands it over
    closes it here.

    From `listen` on each message goes to `on_message`.  When no more will come, `on_end` is called once and
    told why; it is not when `close` ended the channel.
    """

    def __init__(self, most_bytes: int = MOST_BYTES) -> None:
        self._most_bytes = most_bytes
        self._link, self.theirs = socket.socketpair()
        self._link.setblocking(False)
        self._received = bytearray()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._closed = False

    def listen(self, on_message: Callable[[Any], None], on_end: Callable[[str], None]) -> None:
        """Begin to read."""
        self._on_message, self._on_end = on_message, on_end
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(self._link.fileno(), self._readable)

    def send(self, message: Any) -> bool:
        """Hand a message over now.  False, and the channel is closed, when the child does not take it."""
        if self._closed:
            return False
        encoded = _encoded(message)
        try:
            taken = self._link.send(encoded)
        except OSError:
            taken = 0
        if taken < len(encoded):  # the rest could go out only while the loop waits
            self.close()
            return False
        return True

    def close(self) -> None:
        """Read and send no more; idempotent."""
        if self._closed:
            return
        self._closed = True
        if self._loop is not None:
            self._loop.remove_reader(self._link.fileno())
        self._link.close()
        self._received.clear()

    def _readable(self) -> None:
        try:
            chunk = self._link.recv(_CHUNK_BYTES)
        except BlockingIOError:
            return
        except OSError:
            chunk = b""
        if not chunk:
            self._end("the process died")
            return
        self._received += chunk
        while not self._closed:
            try:
                taken = _taken(self._received, self._most_bytes)
            except ValueError as err:
                self._end(str(err))
                return
            if taken is None:
                return
            self._on_message(taken[0])

    def _end(self, why: str) -> None:
        self.close()
        self._on_end(why)


def _encoded(message: Any) -> bytes:
    content = ForkingPickler.dumps(message)
    return _LENGTH.pack(len(content)) + content


def _taken(received: bytearray, most_bytes: int) -> tuple[Any] | None:
    """The first message, taken out of `received`; None while it is not whole.  ValueError when it is longer
    than any can be."""
    if len(received) < _LENGTH.size:
        return None
    (length,) = _LENGTH.unpack_from(received)
    if length > most_bytes:
        raise ValueError(f"the process sent a message of {length / 1e6:.0f} MB")
    end = _LENGTH.size + length
    if len(received) < end:
        return None
    with memoryview(received) as whole:
        message = ForkingPickler.loads(whole[_LENGTH.size : end])
    del received[:end]
    return (message,)
