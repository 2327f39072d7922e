"""Each drone's own connection to the broker: what it tells goes out, what is asked of it comes in.

A broker that dies or hangs stops nothing else of the station: it is tried again, and a line says so.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import math
import secrets
from collections.abc import AsyncIterator, Awaitable, Iterable
from typing import Any, Final

import aiomqtt

from flightd.fleet.vda5050.codec import TOPICS, MalformedError, Version, decoded, encoded
from flightd.fleet.vda5050.factsheet import Factsheet
from flightd.fleet.vda5050.order import InstantActions, Order
from flightd.fleet.vda5050.parts import Header
from flightd.fleet.vda5050.state import Connection, ConnectionState
from flightd.fleet.vehicle.drone_factsheet import Measures
from flightd.fleet.vehicle.signals import Malformed, Said
from flightd.ground.access.roles import Identity, Role
from flightd.ground.hub import Hub
from flightd.ground.mqtt.broker_address import BrokerAddress
from flightd.ground.mqtt.managed_drone import MANUFACTURER, ManagedDrone, OrderRules
from flightd.ground.mqtt.vehicle_sides import VehicleSides, kept_on
from flightd.runtime.within import Within

MANAGER: Final = Identity("fleet manager", Role.OPERATOR, "mqtt")
"""Whose orders they are, in the audit."""
_LOG = logging.getLogger(__name__)
_INTERFACES: Final = {Version.V2_1: "uagv", Version.V3_0: "vda5050"}
_SHOWN_EVERY_S: Final = 0.5
_AGAIN_S: Final = (1.0, 2.0, 5.0, 10.0)
_ANSWER_S: Final = 5.0
_CONNECT_S: Final = 10.0
"""Half of it is paho's own, for a host that takes no connection."""
_LEAVE_S: Final = 1.0
_MOST_WAITING: Final = 32
_LOOK_S: Final = 0.1
_RETAINED: Final = (Connection, Factsheet)


class DroneAtBroker:
    """One drone's connection: `run` keeps it at the broker until cancelled."""

    def __init__(self, name: str, broker: BrokerAddress, version: Version, drone: ManagedDrone) -> None:
        self._name = name
        self._broker = broker
        self._version = version
        self._drone = drone
        interface = broker.interface or _INTERFACES[version]
        self._topic = f"{interface}/{version.topic}/{MANUFACTURER}/{name}"
        self._failures = 0
        """In a row; the first is logged."""

    async def run(self) -> None:
        """Connect, and again after whatever went wrong: that ends neither the station nor what it flies."""
        while True:
            try:
                await self._connected()
            except* aiomqtt.MqttError as group:
                if not self._failures:
                    why = group.exceptions[0]
                    _LOG.warning("%s: %s: %s; it is tried again", self._name, self._broker.shown, why)
            except* Exception:  # noqa: BLE001 - an error of ours
                if not self._failures:
                    _LOG.error("%s at the broker: it failed, and begins anew", self._name, exc_info=True)
            await asyncio.sleep(_AGAIN_S[min(self._failures, len(_AGAIN_S) - 1)])
            self._failures += 1

    async def _connected(self) -> None:
        vehicle = self._drone.vehicle
        async with self._client() as client:
            try:
                async with asyncio.TaskGroup() as tasks:
                    for kind in (Order, InstantActions):
                        await _answered(client.subscribe(self._at(kind)))
                    if self._failures:
                        _LOG.warning("%s: %s: connected", self._name, self._broker.shown)
                    self._failures = 0
                    self._drone.at_broker = True
                    tasks.create_task(self._listen(client), name=f"{self._name} at the broker")
                    tasks.create_task(self._say(client), name=f"{self._name} to the broker")
            finally:
                self._drone.at_broker = False
                with contextlib.suppress(aiomqtt.MqttError, TimeoutError):
                    async with Within(_LEAVE_S):
                        gone = vehicle.connection(ConnectionState.OFFLINE, self._drone.now())
                        await self._publish(client, gone)

    @contextlib.asynccontextmanager
    async def _client(self) -> AsyncIterator[aiomqtt.Client]:
        """Connected meanwhile."""
        will = self._drone.vehicle.connection(ConnectionState.CONNECTION_BROKEN, self._drone.now())
        client = aiomqtt.Client(
            self._broker.host,
            self._broker.port,
            username=self._broker.user,
            password=self._broker.password,
            tls_params=aiomqtt.TLSParameters() if self._broker.tls else None,
            identifier=f"flightd-{self._name}-{secrets.token_hex(4)}",
            will=aiomqtt.Will(self._at(Connection), encoded(will, self._version), qos=1, retain=True),
            timeout=math.inf,  # see _answered
            keepalive=15,
            max_queued_incoming_messages=_MOST_WAITING,
            logger=_QUIET,
        )
        await _answered(client.__aenter__(), _CONNECT_S)
        try:
            yield client
        finally:
            with contextlib.suppress(aiomqtt.MqttError):  # why it is left counts, and no more
                await _answered(client.__aexit__(None, None, None))

    async def _listen(self, client: aiomqtt.Client) -> None:
        async for message in client.messages:
            if message.retain:  # of whatever time, and nobody waits for it: nothing takes off by that
                _LOG.warning("%s: %s: kept by the broker, left out", self._name, message.topic)
            else:
                self._drone.hear(self._read(str(message.topic), message.payload))

    def _read(self, topic: str, payload: Any) -> Said:
        data = bytes(payload) if isinstance(payload, bytes | bytearray) else str(payload).encode()
        kind: type[Order | InstantActions] = Order if topic == self._at(Order) else InstantActions
        try:
            return decoded(kind, data, self._version)
        except MalformedError as err:
            return Malformed(TOPICS[kind], err)

    async def _say(self, client: aiomqtt.Client) -> None:
        """Newest wins: what the drone told meanwhile is not said."""
        drone, state, shown_at = self._drone, None, -_SHOWN_EVERY_S
        loop = asyncio.get_running_loop()
        is_known = False
        while True:
            heard = drone.is_heard
            now_is = ConnectionState.ONLINE if heard else ConnectionState.CONNECTION_BROKEN
            if now_is is not state and (heard or state is not None):
                state = now_is
                await self._publish(client, drone.vehicle.connection(state, drone.now()))
            if heard and drone.vehicle.is_known:
                if not is_known:
                    is_known = True
                    drone.say_again()
                for one in drone.take_messages():
                    await self._publish(client, one)
                if loop.time() - shown_at >= _SHOWN_EVERY_S:
                    shown_at = loop.time()
                    await self._publish(client, drone.vehicle.visualization(drone.now()))
            with contextlib.suppress(TimeoutError):
                async with Within(_LOOK_S):
                    await drone.changed.wait()
            drone.changed.clear()

    async def _publish(self, client: aiomqtt.Client, message: Header) -> None:
        kind = type(message)
        qos = 1 if kind is Connection else 0
        data = encoded(message, self._version)
        await _answered(client.publish(self._at(kind), data, qos=qos, retain=kind in _RETAINED))

    def _at(self, kind: type[Header]) -> str:
        return f"{self._topic}/{TOPICS[kind]}"


async def _answered(wait: Awaitable[object], within_s: float = _ANSWER_S) -> None:
    """Wait for the broker; MqttError where it takes too long.  The client's own bound is `asyncio.wait_for`,
    which before Python 3.12 loses a cancellation that comes together with the answer."""
    try:
        async with Within(within_s):
            await wait
    except TimeoutError:
        raise aiomqtt.MqttError("no answer in time") from None


class FleetLink(VehicleSides):
    """The given drones at a broker; with `rules` its manager flies them.  `run` goes beside the hub's."""

    def __init__(
        self,
        drones: Iterable[str],
        broker: BrokerAddress,
        version: Version,
        measures: Measures,
        rules: OrderRules | None = None,
    ) -> None:
        managed = {name: ManagedDrone(name, version, measures, rules) for name in drones}
        super().__init__(managed, takes_orders=rules is not None)
        self._at_broker = [DroneAtBroker(name, broker, version, drone) for name, drone in managed.items()]

    async def run(self, hub: Hub) -> None:
        """Keep all at the broker until cancelled, and fly as they are ordered."""
        self.follow(hub)
        async with asyncio.TaskGroup() as tasks:
            for name, drone in self._drones.items():
                tasks.create_task(kept_on(name, drone, hub), name=f"{name} as a vehicle")
            for one in self._at_broker:
                tasks.create_task(one.run(), name="at the broker")


_QUIET: Final = logging.getLogger(f"{__name__}.client")
_QUIET.setLevel(logging.CRITICAL)  # what goes wrong is said once, by the line above
