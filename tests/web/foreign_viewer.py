"""A viewer that speaks `foxglove.sdk.v1` and knows nothing of flightd or of the SDK: a WebSocket and the
protocol's own words."""

from __future__ import annotations

import asyncio
import contextlib
import json
import struct
from collections.abc import AsyncIterator
from typing import Any

from websockets.asyncio.client import ClientConnection, connect
from websockets.typing import Origin, Subprotocol

PROTOCOL = "foxglove.sdk.v1"
_MESSAGE_DATA = 1


class ForeignViewer:
    """One connection; `next` is the next message of a topic, as its encoding has it."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.server: dict[str, Any] = {}
        self.channels: dict[str, dict[str, Any]] = {}
        self._topics: dict[int, str] = {}
        self._waiting: list[tuple[str, int, bytes]] = []

    async def advertised(self, *topics: str) -> None:
        """Until the server offers these."""
        async with asyncio.timeout(20):
            while not set(topics) <= self.channels.keys():
                await self._hear()

    async def subscribe(self, *topics: str) -> None:
        """Want these from now on."""
        await self.advertised(*topics)
        wanted = []
        for topic in topics:
            number = len(self._topics) + 1
            self._topics[number] = topic
            wanted.append({"id": number, "channelId": self.channels[topic]["id"]})
        await self.socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))

    async def next(self, topic: str) -> tuple[int, Any]:
        """Log time (ns) and content: a JSON object, or the fields of a protobuf message by number."""
        async with asyncio.timeout(20):
            while True:
                for index, (came_on, stamp_ns, payload) in enumerate(self._waiting):
                    if came_on == topic:
                        del self._waiting[index]
                        is_json = self.channels[topic]["encoding"] == "json"
                        return stamp_ns, json.loads(payload) if is_json else protobuf_fields(payload)
                await self._hear()

    async def _hear(self) -> None:
        message = await self.socket.recv()
        if isinstance(message, str):
            said = json.loads(message)
            if said["op"] == "serverInfo":
                self.server = said
            elif said["op"] == "advertise":
                self.channels |= {channel["topic"]: channel for channel in said["channels"]}
            return
        kind, number, stamp_ns = struct.unpack_from("<BIQ", message)
        assert kind == _MESSAGE_DATA
        self._waiting.append((self._topics[number], stamp_ns, message[13:]))


@contextlib.asynccontextmanager
async def viewing(url: str, origin: str | None = None) -> AsyncIterator[ForeignViewer]:
    """A viewer that is connected meanwhile."""
    async with connect(
        url,
        subprotocols=[Subprotocol(PROTOCOL)],
        origin=None if origin is None else Origin(origin),
        proxy=None,
        max_size=None,
        close_timeout=0.3,
    ) as socket:
        yield ForeignViewer(socket)


def protobuf_fields(message: bytes) -> dict[int, Any]:
    """The newest value of each field: bytes, or an integer (wire types 2 and 0)."""
    fields: dict[int, Any] = {}
    at = 0
    while at < len(message):
        key, at = _varint(message, at)
        value, at = _varint(message, at)
        if key & 7 == 2:
            fields[key >> 3], at = message[at : at + value], at + value
        else:
            assert key & 7 == 0
            fields[key >> 3] = value
    return fields


def _varint(message: bytes, at: int) -> tuple[int, int]:
    value, shift = 0, 0
    while True:
        byte = message[at]
        value |= (byte & 0x7F) << shift
        at, shift = at + 1, shift + 7
        if byte < 0x80:
            return value, at
