"""The manager of a fleet at a real broker, for one drone."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator, Coroutine
from typing import Any

import aiomqtt

from flightd.fleet.vda5050.codec import Version
from tests.rigs.broker import Mosquitto
from tests.unit.fleet.vehicle_rig import validator


class Manager:
    """A fleet's manager: everything that the broker has of one drone, each message held to its schema."""

    def __init__(self, version: Version, drone: str = "demo") -> None:
        self._version = version
        self.top = f"{'uagv' if version is Version.V2_1 else 'vda5050'}/{version.topic}/flightd/{drone}"
        self.heard: list[tuple[str, dict[str, Any], bool]] = []
        self._client: aiomqtt.Client | None = None

    def of(self, topic: str) -> list[dict[str, Any]]:
        """All messages of a topic."""
        return [told for name, told, _ in self.heard if name == topic]

    def last(self, topic: str) -> dict[str, Any]:
        """The newest message of a topic; empty before the first."""
        return (self.of(topic) or [{}])[-1]

    async def say(self, topic: str, data: bytes, *, retain: bool = False) -> None:
        """To the drone."""
        assert self._client is not None
        await self._client.publish(f"{self.top}/{topic}", data, retain=retain)

    @contextlib.asynccontextmanager
    async def watching(self, broker: Mosquitto) -> AsyncIterator[None]:
        """It listens meanwhile."""
        await broker.listens()
        self._client = client = aiomqtt.Client("127.0.0.1", broker.port)
        await client.__aenter__()
        await client.subscribe(f"{self.top}/#")
        listening = asyncio.create_task(self._listen(client))
        try:
            yield
        finally:
            listening.cancel()
            with contextlib.suppress(asyncio.CancelledError, aiomqtt.MqttError):
                await listening
            with contextlib.suppress(aiomqtt.MqttError):
                await client.__aexit__(None, None, None)

    async def _listen(self, client: aiomqtt.Client) -> None:
        async for message in client.messages:
            topic = str(message.topic).rpartition("/")[2]
            assert isinstance(message.payload, bytes)
            told = json.loads(message.payload)
            if topic not in {"order", "instantActions"}:
                validator(self._version, topic).validate(told)
                self.heard.append((topic, told, bool(message.retain)))


async def and_a_turn(main: Coroutine[Any, Any, None]) -> None:
    """A task of aiomqtt's ends a turn after its client."""
    await main
    for _ in range(3):
        await asyncio.sleep(0)
