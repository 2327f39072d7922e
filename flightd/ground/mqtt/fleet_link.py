"""Each drone's own connection to the broker: what it tells goes out, what is asked of it comes in.

A broker that dies or hangs stops nothing else of the station: it is tried again, and a line says so.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
from collections import deque
from collections.abc import Callable, Iterable
from datetime import UTC, datetime
from typing import Any, Final

import aiomqtt

from flightd.adapters.ground_link.messages.published import StatusReport
from flightd.fleet.vda5050.codec import TOPICS, MalformedError, Version, decoded, encoded
from flightd.fleet.vda5050.factsheet import Factsheet
from flightd.fleet.vda5050.order import InstantActions, Order
from flightd.fleet.vda5050.parts import Header
from flightd.fleet.vda5050.state import Connection, ConnectionState
from flightd.fleet.vehicle.drone_factsheet import Measures, drone_factsheet
from flightd.fleet.vehicle.floor import Floor
from flightd.fleet.vehicle.machine import Identity, Vehicle
from flightd.fleet.vehicle.signals import Input, Malformed
from flightd.ground.messages import LinkPicture, LinkState, PictureKey
from flightd.ground.mqtt.broker_address import BrokerAddress
from flightd.ground.mqtt.reported_drone import floor_of_link, situation_of

_LOG = logging.getLogger(__name__)
MANUFACTURER: Final = "flightd"
_INTERFACES: Final = {Version.V2_1: "uagv", Version.V3_0: "vda5050"}
_STEP_S: Final = 0.1
_SHOWN_EVERY_S: Final = 0.5
_SILENT_S: Final = 3.0
_AGAIN_S: Final = (1.0, 2.0, 5.0, 10.0)
_ANSWER_S: Final = 5.0
_LEAVE_S: Final = 1.0
_MOST_WAITING: Final = 32
_RETAINED: Final = (Connection, Factsheet)


class DroneAtBroker:
    """One drone: `tell` takes what the hub says of it, `run` keeps it at the broker until cancelled."""

    def __init__(
        self,
        name: str,
        broker: BrokerAddress,
        version: Version,
        measures: Measures,
        now: Callable[[], datetime] = lambda: datetime.now(UTC),
    ) -> None:
        self._name = name
        self._broker = broker
        self._version = version
        self._measures = measures
        self._now = now
        self._welcome: dict[str, Any] | None = None
        self._status: StatusReport | None = None
        self._heard = False
        self._asked: deque[Input] = deque(maxlen=_MOST_WAITING)
        self._vehicle = self._made(Floor("", frozenset(), frozenset(), {}))
        interface = broker.interface or _INTERFACES[version]
        self._topic = f"{interface}/{version.topic}/{MANUFACTURER}/{name}"
        self._failures = 0
        """In a row; the first is logged."""
        self.dropped = 0
        """Messages that came faster than they were taken."""

    def _made(self, floor: Floor) -> Vehicle:
        sheet = drone_factsheet("flightd", self._measures)
        return Vehicle(Identity(MANUFACTURER, self._name), self._version, floor, sheet)

    def tell(self, topic: str, value: Any) -> None:
        """What the hub says of the drone."""
        match topic:
            case "welcome":
                if self._welcome is None or value["session"] != self._welcome["session"]:
                    self._vehicle.change_floor(floor_of_link(value["floor"]))
                    self._status = None
                self._welcome = value
            case "status":
                self._status = value
            case "link":
                link: LinkState = value
                self._heard = link.connected and link.heard_s is not None and link.heard_s < _SILENT_S

    async def run(self) -> None:
        """Connect, and again after whatever went wrong."""
        while True:
            try:
                await self._connected()
            except* aiomqtt.MqttError as group:
                if not self._failures:
                    _LOG.warning("%s: %s: %s", self._name, self._broker.shown, group.exceptions[0])
            await asyncio.sleep(_AGAIN_S[min(self._failures, len(_AGAIN_S) - 1)])
            self._failures += 1

    async def _connected(self) -> None:
        will = self._vehicle.connection(ConnectionState.CONNECTION_BROKEN, self._now())
        client = aiomqtt.Client(
            self._broker.host,
            self._broker.port,
            username=self._broker.user,
            password=self._broker.password,
            tls_params=aiomqtt.TLSParameters() if self._broker.tls else None,
            identifier=f"flightd-{self._name}-{secrets.token_hex(4)}",
            will=aiomqtt.Will(self._at(Connection), encoded(will, self._version), qos=1, retain=True),
            timeout=_ANSWER_S,
            keepalive=15,
            max_queued_incoming_messages=_MOST_WAITING,
            logger=_QUIET,
        )
        async with client:
            self._failures = 0
            try:
                async with asyncio.TaskGroup() as tasks:
                    for kind in (Order, InstantActions):
                        await client.subscribe(self._at(kind))
                    tasks.create_task(self._listen(client), name=f"{self._name} at the broker")
                    tasks.create_task(self._say(client), name=f"{self._name} to the broker")
            finally:
                with contextlib.suppress(aiomqtt.MqttError, TimeoutError):
                    async with asyncio.timeout(_LEAVE_S):
                        gone = self._vehicle.connection(ConnectionState.OFFLINE, self._now())
                        await self._publish(client, gone)

    async def _listen(self, client: aiomqtt.Client) -> None:
        async for message in client.messages:
            if len(self._asked) == _MOST_WAITING:
                self.dropped += 1
            self._asked.append(self._read(str(message.topic), message.payload))

    def _read(self, topic: str, payload: Any) -> Input:
        data = bytes(payload) if isinstance(payload, bytes | bytearray) else str(payload).encode()
        kind: type[Order | InstantActions] = Order if topic == self._at(Order) else InstantActions
        try:
            return decoded(kind, data, self._version)
        except MalformedError as err:
            return Malformed(TOPICS[kind], err)

    async def _say(self, client: aiomqtt.Client) -> None:
        """Newest wins: what the drone told meanwhile is not said."""
        state: ConnectionState | None = None
        shown_at = -_SHOWN_EVERY_S
        loop = asyncio.get_running_loop()
        factsheet_told = False
        while True:
            now_is = ConnectionState.ONLINE if self._heard else ConnectionState.CONNECTION_BROKEN
            if now_is is not state and (self._heard or state is not None):
                state = now_is
                await self._publish(client, self._vehicle.connection(state, self._now()))
            if self._heard and self._status is not None and self._welcome is not None:
                asked = [self._asked.popleft() for _ in range(len(self._asked))]
                seen = situation_of(self._status, self._welcome["floor"])
                for one in self._vehicle.step(self._now(), [seen, *asked]):
                    if isinstance(one, Header):
                        await self._publish(client, one)
                if not factsheet_told:
                    factsheet_told = True
                    await self._publish(client, self._vehicle.factsheet(self._now()))
                if loop.time() - shown_at >= _SHOWN_EVERY_S:
                    shown_at = loop.time()
                    await self._publish(client, self._vehicle.visualization(self._now()))
            await asyncio.sleep(_STEP_S)

    async def _publish(self, client: aiomqtt.Client, message: Header) -> None:
        kind = type(message)
        qos = 1 if kind is Connection else 0
        await client.publish(
            self._at(kind), encoded(message, self._version), qos=qos, retain=kind in _RETAINED
        )

    def _at(self, kind: type[Header]) -> str:
        return f"{self._topic}/{TOPICS[kind]}"


class FleetLink:
    """A viewer of the hub (`hub.Viewer`) with the given drones; `run` is a task beside the hub's."""

    def __init__(
        self, drones: Iterable[str], broker: BrokerAddress, version: Version, measures: Measures
    ) -> None:
        self._drones = {name: DroneAtBroker(name, broker, version, measures) for name in drones}

    async def run(self) -> None:
        """Keep all at the broker until cancelled."""
        async with asyncio.TaskGroup() as tasks:
            for name, drone in self._drones.items():
                tasks.create_task(drone.run(), name=f"{name} at the broker")

    def attach(self, wake: Callable[[], object] | None) -> None:
        """No pictures are wanted here."""

    def tell(self, drone: str, topic: str, value: Any) -> None:
        """As `hub.Viewer`."""
        if drone in self._drones:
            self._drones[drone].tell(topic, value)

    def show(self, key: PictureKey, picture: LinkPicture) -> None:
        """No pictures are wanted here."""

    def has_use_for(self, key: PictureKey) -> bool:  # noqa: ARG002 - as the protocol has it
        """No pictures are wanted here."""
        return False


_QUIET: Final = logging.getLogger(f"{__name__}.client")
_QUIET.setLevel(logging.CRITICAL)  # what goes wrong is said once, by the line above
