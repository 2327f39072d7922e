"""A station in the test's own loop, and what talks to it without a browser."""

from __future__ import annotations

import asyncio
import contextlib
import json
import socket
from collections.abc import AsyncIterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed
from websockets.typing import Origin

from flightd.adapters.ground_link.client import Address
from flightd.ground.access.access import Access
from flightd.ground.fleet.own_fleet import OwnFleet
from flightd.ground.ground_store.store import GroundStore
from flightd.ground.hub import Viewer
from flightd.ground.mqtt.fleet_link import FleetLink
from flightd.ground.schedules.night_shift import THIS_MACHINE, StationClock
from flightd.ground.server import Listening, opened, serve
from flightd.runtime.within import Within

JSON = {"Content-Type": "application/json"}


@dataclass(frozen=True)
class Station:
    """Where it listens."""

    where: Listening

    @property
    def origin(self) -> str:
        return self.where.url

    @contextlib.asynccontextmanager
    async def page(self, **options: Any) -> AsyncIterator[ClientConnection]:
        """The WebSocket of a page."""
        url = self.where.url.replace("http", "ws") + "/live"
        async with connect(
            url, origin=Origin(self.origin), proxy=None, max_size=None, close_timeout=0.3, **options
        ) as socket:
            yield socket

    async def act(self, drone: str, headers: Mapping[str, str] | None = None, **act: str) -> tuple[int, str]:
        """The status and the body of the answer to an act of the station's own page."""
        own = {"Origin": self.origin, **JSON}
        return await self.ask(
            "POST", f"/drones/{drone}/acts", own if headers is None else headers, json.dumps(act).encode()
        )

    async def ask(
        self,
        method: str,
        path: str,
        headers: Mapping[str, str] | None = None,
        body: bytes = b"",
        within_s: float = 60.0,
    ) -> tuple[int, str]:
        """The status and the body of the answer to any request."""
        head, text = await self.answer(method, path, headers, body, within_s)
        return int(head.split(" ")[1]), text

    async def answer(
        self,
        method: str,
        path: str,
        headers: Mapping[str, str] | None = None,
        body: bytes = b"",
        within_s: float = 60.0,
    ) -> tuple[str, str]:
        """The head and the body of the answer."""
        given = {"Host": f"{self.where.host}:{self.where.port}", **(headers or {})}
        lines = [f"{method} {path} HTTP/1.1", *(f"{name}: {value}" for name, value in given.items())]
        lines += [f"Content-Length: {len(body)}", "Connection: close", "", ""]
        said = await self.say("\r\n".join(lines).encode() + body, within_s)
        head, _, text = said.partition(b"\r\n\r\n")
        return head.decode(), text.decode()

    async def say(self, data: bytes, within_s: float = 10.0) -> bytes:
        """Whatever is answered to these bytes until the station closes, or for so long."""
        reader, writer = await asyncio.open_connection(self.where.host, self.where.port)
        heard = b""
        try:
            writer.write(data)
            with contextlib.suppress(TimeoutError, ConnectionError):
                async with Within(within_s):
                    while part := await reader.read(65536):
                        heard += part
        finally:
            writer.close()
            with contextlib.suppress(ConnectionError):
                await writer.wait_closed()
        return heard


@contextlib.asynccontextmanager
async def served(
    *drones: tuple[str, Address],
    folder: Path | None = None,
    state: Path | None = None,
    login: bool = False,
    viewers: Sequence[Viewer] = (),
    send_buffer: int | None = None,
    fleet: FleetLink | None = None,
    store: GroundStore | None = None,
    own_fleet: OwnFleet | None = None,
    clock: StationClock = THIS_MACHINE,
) -> AsyncIterator[Station]:
    """A station that serves meanwhile; flights lie below `folder`, people and audit in `state`; its system
    takes so many bytes at once for a page (None: as many as it likes).  Schedules go by the `clock`."""
    listener, where = opened(Listening("127.0.0.1", 0))
    if send_buffer is not None:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, send_buffer)
    ready = asyncio.Event()
    with listener, TemporaryDirectory() as elsewhere:
        access = Access(state or Path(elsewhere), login, secure=False)
        serving = asyncio.ensure_future(
            serve(
                drones,
                listener,
                where,
                access,
                lambda _: ready.set(),
                folder=folder,
                viewers=viewers,
                fleet=fleet,
                store=store,
                own_fleet=own_fleet,
                clock=clock,
            )
        )
        try:
            await asyncio.wait_for(ready.wait(), 20)
            yield Station(where)
        finally:
            serving.cancel()
            await asyncio.wait([serving])
            if not serving.cancelled():
                serving.result()


async def told(socket: ClientConnection, topic: str, drone: str = "demo", within_s: float = 20.0) -> Any:
    """The next value of a topic that a page is told."""
    async with Within(within_s):
        while True:
            message = await socket.recv()
            if isinstance(message, str):
                said = json.loads(message)
                if (said["drone"], said["topic"]) == (drone, topic):
                    return said["value"]


async def pictured(socket: ClientConnection, within_s: float = 20.0) -> tuple[dict[str, Any], bytes]:
    """The next picture: its head and its JPEG."""
    async with Within(within_s):
        while True:
            message = await socket.recv()
            if isinstance(message, bytes):
                length = int.from_bytes(message[:4], "big")
                return json.loads(message[4 : 4 + length]), message[4 + length :]


async def until_told(socket: ClientConnection, topic: str, field: str, value: Any) -> None:
    """Wait until the station's own topic says this."""
    while (await told(socket, topic, ""))[field] != value:
        pass


async def ending(page: ClientConnection) -> int | None:
    """The code with which the station closes a page."""
    try:
        async with Within(10):
            while True:
                await page.recv()
    except ConnectionClosed as ended:
        return None if ended.rcvd is None else ended.rcvd.code
