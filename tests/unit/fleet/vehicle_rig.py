"""A vehicle of VDA 5050 without a drone: what it is told, what it answers, all held to the schemas."""

from __future__ import annotations

import functools
import itertools
import json
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, TypeVar

import jsonschema
import msgspec
import pytest

from flightd.fleet.vda5050.codec import TOPICS, Version, encoded
from flightd.fleet.vda5050.factsheet import Factsheet
from flightd.fleet.vda5050.order import Edge, InstantActions, Node, NodePosition, Order
from flightd.fleet.vda5050.parts import Action, ActionParameter, BlockingType, Header, MobileRobotPosition
from flightd.fleet.vda5050.state import OperatingMode, PowerSupply, State
from flightd.fleet.vehicle.drone_factsheet import Measures, drone_factsheet
from flightd.fleet.vehicle.floor import Floor
from flightd.fleet.vehicle.machine import BaseReach, Identity, Vehicle
from flightd.fleet.vehicle.signals import Decided, Fly, Input, Output, Situation
from flightd.site.site import Site
from flightd.site.site_file import load_site

BOTH = pytest.mark.parametrize("version", list(Version))
V2, V3 = Version.V2_1, Version.V3_0
SCHEMAS = Path(__file__).parent / "schemas"
FOLDERS = {Version.V2_1: "2.1.0", Version.V3_0: "3.0"}
_O = TypeVar("_O")
IDENTITY = Identity("acme", "d1")
POWER = PowerSupply(state_of_charge=80.0, charging=False)


@functools.cache
def validator(version: Version, topic: str) -> Any:
    """Of the official schema."""
    schema = json.loads((SCHEMAS / FOLDERS[version] / f"{topic}.schema").read_text())
    kind = jsonschema.validators.validator_for(schema)
    kind.check_schema(schema)
    return kind(schema)


def check(message: Header, version: Version) -> bytes:
    """The message as it is sent, valid by the schema."""
    data = encoded(message, version)
    validator(version, TOPICS[type(message)]).validate(json.loads(data))
    return data


@functools.cache
def site() -> Site:
    """Two aisles, A1 to A6 and B1 to B6, joined at both ends."""
    return load_site(Path(__file__).parents[3] / "configs" / "site-demo.toml")


def floor_of(site: Site) -> Floor:
    """The floor of a site; its map is called as the site is, as in the site's LIF."""
    ways = set()
    for edge in site.edges:
        if not site.is_closed(edge):
            ways.add((edge.a, edge.b))
            if not edge.one_way:
                ways.add((edge.b, edge.a))
    sides = {aisle.id: aisle.shelves for aisle in site.aisles}
    places = {(place.node, place.side, place.level) for place in site.locations.values()}
    shelves = {
        node.id: {
            side: frozenset(level for at, on, level in places if (at, on) == (node.id, side))
            if places
            else None
            for side in sides[node.aisle]
        }
        for node in site.nodes.values()
    }
    at_m = {node.id: (node.x_m, 0.0 - node.y_m) for node in site.nodes.values()}
    return Floor(site.name, frozenset(site.nodes), frozenset(ways), shelves, at_m)


def scan(name: str, blocking: BlockingType = BlockingType.HARD, **more: Any) -> Action:
    """A scanShelf."""
    told = {"levels": [1, 2], "side": "left", **more}
    return Action(
        action_type="scanShelf",
        action_id=name,
        blocking_type=blocking,
        action_parameters=[ActionParameter(key=key, value=value) for key, value in told.items()],
    )


def order(
    way: str,
    released: int = 99,
    *,
    number: int = 0,
    name: str = "o",
    first: int = 0,
    actions: dict[str, list[Action]] | None = None,
    **edge: Any,
) -> Order:
    """An order along `way`, its first `released` nodes released; sequence ids from `first` on."""
    ids, told = way.split(), actions or {}
    nodes = [
        Node(node_id=one, sequence_id=first + 2 * i, released=i < released, actions=told.get(one, []))
        for i, one in enumerate(ids)
    ]
    edges = [
        Edge(edge_id=f"{a}-{b}", sequence_id=first + 2 * i + 1, released=i + 1 < released, actions=[], **edge)
        for i, (a, b) in enumerate(itertools.pairwise(ids))
    ]
    return Order(
        header_id=1, timestamp="2026-03-01T08:00:00.000Z", version="3.0.0", manufacturer="acme",
        serial_number="d1", order_id=name, order_update_id=number, nodes=nodes, edges=edges,
    )  # fmt: skip


def instant(kind: str, name: str = "", **told: Any) -> InstantActions:
    """One instant action."""
    parameters = [ActionParameter(key=key, value=value) for key, value in told.items()]
    action = Action(
        action_type=kind, action_id=name or kind, blocking_type=BlockingType.NONE,
        action_parameters=parameters or None,
    )  # fmt: skip
    return InstantActions(
        header_id=1, timestamp="2026-03-01T08:00:00.000Z", version="3.0.0", manufacturer="acme",
        serial_number="d1", actions=[action],
    )  # fmt: skip


class Drone:
    """A vehicle that stands at `at`, in `AUTOMATIC`."""

    def __init__(self, version: Version, at: str | None = "A1", reach: BaseReach = len, **more: Any) -> None:
        self.version = version
        self.vehicle = Vehicle(
            Identity("acme", "d1"),
            version,
            floor_of(site()),
            drone_factsheet("quad", MEASURES),
            reach,
            **more,
        )
        self.now = datetime(2026, 3, 1, 8, 0, tzinfo=UTC)
        self.states: list[State] = []
        self.is_at(at)

    def say(self, *inputs: Input, after_s: float = 0.1) -> list[Output]:
        """What the machine makes of these, without the states."""
        self.now += timedelta(seconds=after_s)
        out = self.vehicle.step(self.now, inputs)
        for one in out:
            if isinstance(one, Header):
                check(one, self.version)
        self.states += [one for one in out if isinstance(one, State)]
        return [one for one in out if not isinstance(one, State | Decided)]

    def is_at(
        self,
        node: str | None,
        *,
        driving: bool = False,
        mode: OperatingMode = OperatingMode.AUTOMATIC,
        at_m: tuple[float, float] | None = None,
        theta: float = 0.0,
    ) -> list[Output]:
        """Say how the drone is."""
        where = None
        if at_m is not None:
            where = MobileRobotPosition(x=at_m[0], y=at_m[1], theta=theta, map_id=site().name, localized=True)
        return self.say(Situation(mode=mode, driving=driving, power=POWER, node=node, position=where))

    @property
    def state(self) -> State:
        """The newest."""
        return self.states[-1]

    @property
    def ahead(self) -> str:
        """The nodes ahead; those of the horizon in brackets."""
        return " ".join(one.node_id if one.released else f"({one.node_id})" for one in self.state.node_states)

    @property
    def statuses(self) -> dict[str, str]:
        """Of all actions by their ids."""
        told = [*self.state.action_states, *self.state.instant_action_states]
        return {one.action_id: one.action_status.value for one in told}

    @property
    def errors(self) -> list[str]:
        """Their types."""
        return [one.error_type for one in self.state.errors]

    def about(self, key: str) -> list[str]:
        """What the errors refer to by this key."""
        return [
            one.reference_value
            for error in self.state.errors
            for one in error.error_references or ()
            if one.reference_key == key
        ]


MEASURES = Measures(2.0, 1.0, 1.0, 0.5, 0.5, 0.2)


def only(out: Sequence[Output], kind: type[_O]) -> list[_O]:
    """The outputs of one kind."""
    return [one for one in out if isinstance(one, kind)]


def facts(out: Sequence[Output]) -> list[Factsheet]:
    """The factsheets among them."""
    return only(out, Factsheet)


def flown(out: Sequence[Output]) -> str:
    """The stops of the last way that was commanded."""
    return " ".join(stop.node for stop in only(out, Fly)[-1].stops)


def at(told: Order, index: int = 0, **where: Any) -> Order:
    """The order with a position of its first node, or of another one."""
    nodes = [*told.nodes]
    nodes[index] = msgspec.structs.replace(nodes[index], node_position=NodePosition(**where))
    return msgspec.structs.replace(told, nodes=nodes)
