"""The station's drones at a real broker, as a fleet's manager sees them."""

from __future__ import annotations

import asyncio
import contextlib
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import aiomqtt
import pytest

from flightd.core.errors import InputError
from flightd.fleet.vda5050.codec import Version, encoded
from flightd.fleet.vehicle.drone_factsheet import Measures
from flightd.ground.hub import Hub
from flightd.ground.mqtt.broker_address import BrokerAddress, read_body, read_broker, read_version
from flightd.ground.mqtt.fleet_link import FleetLink
from flightd.ground.mqtt.managed_drone import ManagedDrone
from tests.rigs.broker import Mosquitto, mosquitto
from tests.rigs.event_loops import real
from tests.rigs.ground_link import address_of, local, serving, telling
from tests.rigs.waiting import until
from tests.unit.fleet.vehicle_rig import instant, order
from tests.web.fleet_manager import Manager, and_a_turn
from tests.web.paper_station import managed_drone
from tests.web.served import served

BODY = Measures(3.0, 1.0, 1.0, 0.6, 0.6, 0.3)


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
            await manager.say("order", encoded(order("A1 A2", name="of yesterday"), version), retain=True)
            await stack.enter_async_context(served(("demo", address_of(link)), fleet=fleet))
            async with telling(link):
                await until(lambda: manager.last("visualization"))
                assert manager.last("connection")["connectionState"] == "ONLINE"
                assert manager.last("factsheet")["serialNumber"] == "demo"
                state = manager.last("state")
                assert (state["operatingMode"], state["orderId"], state["errors"]) == ("MANUAL", "", [])
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
        real(and_a_turn(go(broker)))


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
        real(and_a_turn(go(broker)))
    lines = [line.rpartition(f"demo: {broker.url}: ")[2] for line in caplog.messages if "demo: " in line]
    assert lines[0].endswith("; it is tried again")
    assert lines[1] == "connected"


def test_an_error_about_a_drone_or_its_connection_ends_no_station(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    async def go() -> None:
        nowhere = BrokerAddress("broker..hall", 1883, tls=False)
        hub = cast(Hub, SimpleNamespace(drones={"demo": None}))
        running = asyncio.ensure_future(FleetLink(["demo"], nowhere, Version.V2_1, BODY).run(hub))
        await until(lambda: caplog.text.count("failed, and begins anew") == 2)
        assert not running.done()
        running.cancel()
        await asyncio.wait([running])

    monkeypatch.setattr(ManagedDrone, "run", lambda *_: 1 / 0)
    real(and_a_turn(go()))


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
        real(and_a_turn(go(broker)))


@pytest.mark.parametrize("turns", range(8))
def test_what_ends_as_the_broker_answers_ends(
    turns: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    publish, ended = aiomqtt.Client.publish, list[asyncio.Task[object]]()

    async def published(client: aiomqtt.Client, topic: str, *args: object, **how: object) -> None:
        task = asyncio.current_task()
        if not ended and task is not None and topic.endswith("/visualization"):
            ended.append(task)
            end_in(turns, task)
        await publish(client, topic, *args, **how)  # type: ignore[arg-type]

    def end_in(left: int, task: asyncio.Task[object]) -> None:
        asyncio.get_running_loop().call_soon(task.cancel if left == 0 else lambda: end_in(left - 1, task))

    async def go(broker: Mosquitto) -> None:
        await broker.listens()
        async with managed_drone(broker, Version.V2_1):
            await until(lambda: ended and ended[0].done(), 30)

    monkeypatch.setattr(aiomqtt.Client, "publish", published)
    with mosquitto(tmp_path) as broker:
        real(and_a_turn(go(broker)), 4.0)


def test_a_broker_is_named_by_its_url_and_no_refusal_tells_a_password() -> None:
    assert read_broker("mqtt://hall") == BrokerAddress("hall", 1883, tls=False)
    told = read_broker("mqtts://ann:s%3Acret@[::1]:99/top")
    assert told == BrokerAddress("::1", 99, True, "ann", "s:cret", "top")
    assert told.shown == "mqtts://[::1]:99"
    for wrong in ("hall", "http://hall", "mqtt://", "mqtt://a:secret@hall:x", "mqtt://a:secret@hall/a/b",
                  "mqtt://hall/#", "mqtt://[::1", "mqtt://a:secret@broker..hall",
                  f"mqtt://{'a' * 64}.hall"):  # fmt: skip
        with pytest.raises(InputError) as refused:
            read_broker(wrong)
        assert str(refused.value).startswith("--mqtt: ")
        assert "secret" not in str(refused.value)
    assert read_version("3.0") is Version.V3_0
    assert read_body("0.5x0.4x0.25").width_m == 0.4
    for read, text in ((read_version, "2.0"), (read_body, "0.5"), (read_body, "9x9x9")):
        with pytest.raises(InputError):
            read(text)
