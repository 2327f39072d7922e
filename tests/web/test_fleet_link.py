"""The station's drones at a real broker, as a fleet's manager sees them."""

from __future__ import annotations

import asyncio
import contextlib
import json
import sys
from collections.abc import AsyncIterator, Coroutine
from pathlib import Path
from typing import Any

import aiomqtt
import pytest

from flightd.core.errors import InputError
from flightd.fleet.vda5050.codec import Version, encoded
from flightd.fleet.vehicle.drone_factsheet import Measures
from flightd.ground.mqtt.broker_address import BrokerAddress, read_body, read_broker, read_version
from flightd.ground.mqtt.fleet_link import FleetLink
from tests.rigs.broker import Mosquitto, mosquitto
from tests.rigs.event_loops import real
from tests.rigs.ground_link import address_of, local, serving, telling
from tests.rigs.waiting import until
from tests.unit.fleet.vehicle_rig import instant, order, validator
from tests.web.served import served

BODY = Measures(3.0, 1.0, 1.0, 0.6, 0.6, 0.3)


class Manager:
    """A fleet's manager: everything that the broker has of one drone, each message held to its schema."""

    def __init__(self, version: Version) -> None:
        self._version = version
        self.top = f"{'uagv' if version is Version.V2_1 else 'vda5050'}/{version.topic}/flightd/demo"
        self.heard: list[tuple[str, dict[str, Any], bool]] = []
        self._client: aiomqtt.Client | None = None

    def of(self, topic: str) -> list[dict[str, Any]]:
        """All messages of a topic."""
        return [told for name, told, _ in self.heard if name == topic]

    def last(self, topic: str) -> dict[str, Any]:
        """The newest message of a topic; empty before the first."""
        return (self.of(topic) or [{}])[-1]

    async def say(self, topic: str, data: bytes) -> None:
        """To the drone."""
        assert self._client is not None
        await self._client.publish(f"{self.top}/{topic}", data)

    @contextlib.asynccontextmanager
    async def watching(self, broker: Mosquitto) -> AsyncIterator[None]:
        """It listens meanwhile."""
        async with asyncio.timeout(20):
            while True:
                with contextlib.suppress(aiomqtt.MqttError):
                    client = aiomqtt.Client("127.0.0.1", broker.port)
                    await client.__aenter__()
                    break
                await asyncio.sleep(0.02)
        self._client = client
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


async def _and_a_turn(main: Coroutine[Any, Any, None]) -> None:
    """A task of aiomqtt's ends a turn after its client."""
    await main
    for _ in range(3):
        await asyncio.sleep(0)


_WORDS = {
    Version.V2_1: ("agvPosition", "CONNECTIONBROKEN", "orderError"),
    Version.V3_0: ("mobileRobotPosition", "CONNECTION_BROKEN", "MOBILE_ROBOT_NOT_AVAILABLE"),
}


@pytest.mark.parametrize("version", list(Version))
def test_a_manager_sees_the_drone_is_refused_and_loses_it_with_the_link(
    version: Version, tmp_path: Path
) -> None:
    async def go(broker: Mosquitto) -> None:
        manager = Manager(version)
        position, broken, refusal = _WORDS[version]
        async with contextlib.AsyncExitStack() as stack, contextlib.AsyncExitStack() as drone:
            link = await drone.enter_async_context(serving(local()))
            fleet = FleetLink(["demo"], read_broker(broker.url), version, BODY)
            await stack.enter_async_context(manager.watching(broker))
            await stack.enter_async_context(served(("demo", address_of(link)), fleet=fleet))
            async with telling(link):
                await until(lambda: manager.last("visualization"))
                assert manager.last("connection")["connectionState"] == "ONLINE"
                assert manager.last("factsheet")["serialNumber"] == "demo"
                state = manager.last("state")
                assert (state["operatingMode"], state["orderId"]) == ("MANUAL", "")
                at = manager.last("visualization")[position]
                assert (at["x"], at["y"], at["mapId"]) == (1.0, -0.01, "demo")
                # its own people fly it: orders are refused, questions are answered
                await manager.say("order", encoded(order("A2 A3"), version))
                await until(lambda: manager.last("state")["errors"])
                assert manager.last("state")["errors"][0]["errorType"] == refusal
                await manager.say("order", b"{}")
                await until(lambda: len(manager.last("state")["errors"]) == 2)
                sheets = len(manager.of("factsheet"))
                await manager.say("instantActions", encoded(instant("factsheetRequest"), version))
                await until(lambda: len(manager.of("factsheet")) > sheets)
            await drone.aclose()
            await until(lambda: manager.last("connection")["connectionState"] == broken)
        late = Manager(version)
        async with late.watching(broker):
            await until(lambda: late.last("connection") and late.last("factsheet"))
        assert [retained for *_, retained in late.heard] == [True, True]
        assert late.last("connection")["connectionState"] == "OFFLINE"

    with mosquitto(tmp_path) as broker:
        real(_and_a_turn(go(broker)))


def test_a_broker_that_dies_stops_nothing_and_is_found_again(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async def go(broker: Mosquitto) -> None:
        fleet = FleetLink(["demo"], read_broker(broker.url), Version.V2_1, BODY)
        async with (
            serving(local()) as link,
            served(("demo", address_of(link)), fleet=fleet) as station,
            telling(link),
        ):
            for _ in range(2):
                manager = Manager(Version.V2_1)
                async with manager.watching(broker):
                    await until(lambda: manager.last("visualization"))  # noqa: B023 - called in this turn
                    assert manager.last("connection")["connectionState"] == "ONLINE"
                broker.kill()
                async with station.page() as page:
                    assert await page.recv()  # the pages go on
                broker.start()

    with mosquitto(tmp_path) as broker:
        real(_and_a_turn(go(broker)))
    assert f"demo: {broker.url}: " in caplog.text


def test_of_a_station_that_is_killed_the_broker_says_so(tmp_path: Path) -> None:
    async def go(broker: Mosquitto) -> None:
        manager = Manager(Version.V2_1)
        async with serving(local()) as link, telling(link), manager.watching(broker):
            at = address_of(link)
            drone = f"demo={at.host}:{at.status_port}/{at.command_port}"
            station = await asyncio.create_subprocess_exec(
                sys.executable, "-m", "flightd", "ground", "--drone", drone, "--listen", "127.0.0.1:0",
                "--mqtt", broker.url, "--state", str(tmp_path),
                stderr=asyncio.subprocess.DEVNULL,
            )  # fmt: skip
            try:
                await until(lambda: manager.last("visualization"))
                assert manager.last("connection")["connectionState"] == "ONLINE"
            finally:
                station.kill()
                await station.wait()
            await until(lambda: manager.last("connection")["connectionState"] == "CONNECTIONBROKEN")

    with mosquitto(tmp_path) as broker:
        real(_and_a_turn(go(broker)))


def test_a_broker_is_named_by_its_url_and_no_refusal_tells_a_password() -> None:
    assert read_broker("mqtt://hall") == BrokerAddress("hall", 1883, tls=False)
    told = read_broker("mqtts://ann:s%3Acret@[::1]:99/top")
    assert told == BrokerAddress("::1", 99, True, "ann", "s:cret", "top")
    assert told.shown == "mqtts://[::1]:99"
    for wrong in ("hall", "http://hall", "mqtt://", "mqtt://a:secret@hall:x", "mqtt://a:secret@hall/a/b",
                  "mqtt://hall/#", "mqtt://[::1"):  # fmt: skip
        with pytest.raises(InputError) as refused:
            read_broker(wrong)
        assert str(refused.value).startswith("--mqtt: ")
        assert "secret" not in str(refused.value)
    assert read_version("3.0") is Version.V3_0
    assert read_body("0.5x0.4x0.25").width_m == 0.4
    for read, text in ((read_version, "2.0"), (read_body, "0.5"), (read_body, "9x9x9")):
        with pytest.raises(InputError):
            read(text)
