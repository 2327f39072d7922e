"""A line of so many bits a second between a browser and a station on loopback, for `tools.bench_station`."""

from __future__ import annotations

import asyncio
import contextlib
import socket

_PART_BYTES = 2048
_WAITING_BYTES = 32_768
"""So much waits at the line's near end; the sender keeps the rest."""


class SlowLine:
    """Each way carries `mbit` Mbit/s, for all connections together.  Within a running loop."""

    def __init__(self, station_port: int, mbit: float) -> None:
        self._station_port = station_port
        self._bits_per_s = mbit * 1e6
        self._free_s = {"up": 0.0, "down": 0.0}
        self._server: asyncio.Server | None = None
        self._passing: set[asyncio.Task[None]] = set()

    async def open(self) -> int:
        """The port on loopback where it begins."""
        self._server = await asyncio.start_server(self._carry, "127.0.0.1", 0, limit=_PART_BYTES)
        return int(self._server.sockets[0].getsockname()[1])

    def close(self) -> None:
        """Cut it."""
        if self._server is not None:
            self._server.close()
        for task in self._passing:
            task.cancel()

    async def _carry(self, browser: asyncio.StreamReader, to_browser: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._passing.add(task)
        with socket.socket() as near, contextlib.suppress(OSError, ExceptionGroup, asyncio.CancelledError):
            near.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _WAITING_BYTES)
            near.setblocking(False)
            await asyncio.get_running_loop().sock_connect(near, ("127.0.0.1", self._station_port))
            station, to_station = await asyncio.open_connection(sock=near, limit=_PART_BYTES)
            try:
                async with asyncio.TaskGroup() as tasks:
                    tasks.create_task(self._pass(browser, to_station, "up"), name="up")
                    tasks.create_task(self._pass(station, to_browser, "down"), name="down")
            finally:
                to_station.transport.abort()
                to_browser.transport.abort()
                self._passing.discard(task)

    async def _pass(self, source: asyncio.StreamReader, sink: asyncio.StreamWriter, way: str) -> None:
        """Everything, as fast as the line is; OSError at its end, which ends the other way, too."""
        loop = asyncio.get_running_loop()
        while part := await source.read(_PART_BYTES):
            self._free_s[way] = max(self._free_s[way], loop.time()) + len(part) * 8 / self._bits_per_s
            await asyncio.sleep(self._free_s[way] - loop.time())
            sink.write(part)
            await sink.drain()
        raise ConnectionResetError
