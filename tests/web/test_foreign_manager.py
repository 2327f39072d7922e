"""A fleet's manager that others wrote (the PyPI package vda5050-sdk, of version 2.1) flies a drone at a real
broker: what it reads, it reads by its own models and its own copies of the schemas."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import TYPE_CHECKING

from flightd.fleet.vda5050.codec import Version
from tests.rigs.broker import Mosquitto, mosquitto
from tests.rigs.event_loops import real
from tests.rigs.extras import of_extra
from tests.rigs.waiting import until
from tests.web.fleet_manager import and_a_turn
from tests.web.paper_station import BODY, managed_drone

if TYPE_CHECKING:
    from vda5050 import MasterClient, OrderBuilder
    from vda5050.client.events import ErrorEvent, VehicleErrorEvent
    from vda5050.identity import VehicleKey
    from vda5050.model.connection import Connection
    from vda5050.model.state import State

vda5050 = of_extra("vda5050", "dev")
DRONE = "flightd/a"
_SPEED = 4.0


def order_of(name: str = "o") -> OrderBuilder:
    """One to be filled with nodes and edges."""
    empty: OrderBuilder = vda5050.OrderBuilder(order_id=name, manufacturer="flightd", serial_number="a")
    return empty


class ForeignManager:
    """The package's own client, and all that it made of what it heard."""

    def __init__(self, broker: Mosquitto) -> None:
        config = vda5050.MasterConfig(broker_url=broker.url, visualization=True, validate_messages=True)
        self.client: MasterClient = vda5050.MasterClient(config)
        self.states: list[State] = []
        self.connections: list[str] = []
        self.refusals: list[str] = []
        self.unread: list[ErrorEvent] = []
        self.client.on_state(self._on_state)
        self.client.on_connection(self._on_connection)
        self.client.on_vehicle_error(self._on_vehicle_error)
        self.client.on_error(self.unread.append)

    def _on_state(self, state: State, _: VehicleKey) -> None:
        self.states.append(state)

    def _on_connection(self, told: Connection, _: VehicleKey) -> None:
        self.connections.append(told.connection_state.value)

    def _on_vehicle_error(self, told: VehicleErrorEvent, _: VehicleKey) -> None:
        kind = "refused" if told.is_order_rejection else "failed"
        self.refusals.append(f"{kind}: {told.error.error_type} {told.error.error_level.value}")

    @property
    def ahead(self) -> str:
        """The nodes ahead; those of the horizon in brackets."""
        nodes = self.states[-1].node_states
        return " ".join(one.node_id if one.released else f"({one.node_id})" for one in nodes)

    def is_at(self, node: str) -> bool:
        """It was there last, and stands."""
        return bool(self.states) and self.states[-1].last_node_id == node and not self.states[-1].driving

    def is_done(self, action: str) -> bool:
        """An action is finished."""
        return any(
            (one.action_id, one.action_status.value) == (action, "FINISHED")
            for one in self.states[-1].action_states
        )


def test_a_manager_of_others_flies_a_drone_and_reads_all_that_it_tells(tmp_path: Path) -> None:
    async def go(broker: Mosquitto) -> None:
        await broker.listens()
        async with contextlib.AsyncExitStack() as stack, contextlib.AsyncExitStack() as ground:
            manager = ForeignManager(broker)
            master = await stack.enter_async_context(manager.client)
            drone = await ground.enter_async_context(managed_drone(broker, Version.V2_1))
            await until(lambda: manager.is_at("A1") and master.capabilities(DRONE).factsheet)
            assert manager.connections == ["ONLINE"]
            assert manager.states[-1].operating_mode.value == "AUTOMATIC"
            size = master.capabilities(DRONE).physical_parameters
            assert size is not None
            assert (size.width, size.length, size.speed_max) == (
                BODY.width_m,
                BODY.length_m,
                BODY.max_speed_mps,
            )
            assert master.capabilities(DRONE).supports_action("startPause")

            order = order_of()
            for node in ("A1", "A2", "A3"):
                order.add_node(node, released=node != "A3")
            order.add_edge("A1", "A2").add_edge("A2", "A3", released=False)
            assert (await master.dispatch(order.build(), DRONE)).accepted
            await until(lambda: manager.is_at("A2") and master.pending_base_requests())
            assert manager.ahead == "(A3)"

            more = order_of()
            more.add_node("A3").add_node("A4").add_edge("A2", "A3").add_edge("A3", "A4")
            assert (await master.extend_base(DRONE, more.nodes, more.edges)).accepted
            await until(lambda: drone.truth.x_m > 2.5)
            drone.held = True
            await until(lambda: manager.states[-1].driving and manager.ahead == "A3 A4")
            assert (manager.states[-1].order_id, manager.states[-1].order_update_id) == ("o", 1)

            await master.pause(DRONE)
            await until(lambda: "pause" in drone.commands)
            drone.held = False
            await until(lambda: manager.states[-1].paused and manager.is_done("pause"))
            assert manager.is_at("A2")
            await master.resume(DRONE)
            await until(lambda: drone.truth.x_m > 3.0)
            drone.held = True
            await until(lambda: manager.is_done("resume") and manager.states[-1].driving)
            assert not manager.states[-1].paused
            await master.cancel_order(DRONE)
            await until(lambda: drone.commands[-1] == "goto A3")
            drone.held = False
            await until(lambda: manager.is_done("cancel-order") and manager.is_at("A3"))
            assert manager.ahead == ""

            lost = order_of("lost")
            here = drone.site.nodes["A3"]
            lost.add_node("A3", x=here.x_m, y=here.y_m, map_id="hall", allowed_deviation_xy=0.5)
            lost.add_node("Z9").add_edge("A3", "Z9")
            taken = await master.dispatch(lost.build(), DRONE)
            assert taken.accepted, taken
            await until(lambda: manager.refusals)
            await ground.aclose()
            await until(lambda: manager.connections[-1] == "OFFLINE")
            assert (manager.refusals, manager.unread) == (["refused: orderError WARNING"], [])
            assert manager.client.metrics.visualizations_received

    with mosquitto(tmp_path) as broker:
        real(and_a_turn(go(broker)), _SPEED)
