"""One drone of the station's own fleet, between traffic and the vehicle side that a manager's orders go to:
what is released to it becomes an order, and what it tells becomes actions that are done."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from flightd.adapters.ground_link.messages.published import StatusReport
from flightd.core.types import OVER, CommandKind, Phase
from flightd.fleet.traffic.dispatcher import DroneReport
from flightd.fleet.traffic.motions import Act
from flightd.fleet.traffic.plan import Action
from flightd.fleet.vda5050.order import Order
from flightd.fleet.vehicle.signals import Decided
from flightd.ground.fleet.base_orders import BaseOrders, instant, scan
from flightd.ground.fleet.fleet_floor import FleetFloor
from flightd.ground.mqtt.managed_drone import ManagedDrone
from flightd.ground.mqtt.order_flight import WAITS
from flightd.mission.machine import FLYING
from flightd.site.site import Side

RESERVE: Final = 0.15
FLIGHT_S: Final = 3600.0
"""The charge that traffic is told is the time that the drone itself expects to have left, in such flights."""
_FULL_S: Final = 600.0
"""Of a drone that tells no charge: its own rules bring it home."""
_DOUBTS_M: Final = 3.0
"""By how much a drone may be off that looks for its place: a node beside the one that it was at."""
_SIGMAS: Final = 3.0
_CALLED_OFF_EVERY_S: Final = 2.0
_STARTS_WITHIN_S: Final = 60.0
_CLIMBS: Final = frozenset({Phase.TAKE_OFF, Phase.ACQUIRE})


@dataclass(slots=True)
class _Step:
    """Released and not done; at `sequence` of the order, None: not ordered yet; `count` is the id of its
    scan."""

    action: Action
    sequence: int | None = None
    count: str = ""


class FleetDrone:
    """`is_ours` says whether traffic may fly it, `air` where it may be while traffic does not."""

    def __init__(self, name: str, drone: ManagedDrone, floor: FleetFloor, uncertainty_m: float) -> None:
        self.name = name
        self.drone = drone
        self._floor = floor
        self._uncertainty_m = uncertainty_m
        self._base: deque[_Step] = deque()
        self._done = 0
        self._orders: BaseOrders | None = None
        self._refused = ""
        self._paused = self._astray = False
        self._called_off_s = -math.inf
        self._stands_since_s = 0.0
        self._air: tuple[int, frozenset[int]] = (floor.pad(name), frozenset())
        self._levels = sorted({level for node in floor.nodes for level in node.levels})
        self._sides = {(rack.aisle, rack.side) for rack in floor.racks}
        self._faces = {node.id: node.aisle for node in floor.nodes if node.levels}
        drone.on_decided = self._hear_decided

    # what it tells

    @property
    def is_ours(self) -> bool:
        """Traffic flies it: it is heard, no person has it, and it is where it was released to."""
        status = self.drone.status
        if status is None or not self.drone.is_heard or not self.drone.is_automatic or self._refused:
            return False
        return status.phase not in FLYING or status.phase is Phase.RELOCATE or self._is_on_base(status)

    @property
    def why(self) -> str:
        """Why traffic does not fly it, in words."""
        status, floor = self.drone.status, self.drone.floor
        if status is None or floor is None or not self.drone.is_heard:
            return "it is not heard"
        if not self._floor.is_of(floor):
            return f"it flies by another map: {floor.name}"
        if self._astray:
            return "it landed beside its pad; give it back once it stands there again"
        if self.drone.is_taken:
            return "a person has it"
        if not self.drone.is_automatic:
            return f"it takes no orders now: {status.phase}, {status.reason}".removesuffix(", ")
        return self._refused or "it is not where traffic could fly it on from"

    def _is_on_base(self, status: StatusReport) -> bool:
        vehicle, home = self.drone.vehicle, self._floor.pads[self.name].node
        return not status.way or status.way[0] in {vehicle.last_node, *vehicle.ahead, home}

    @property
    def waits(self) -> bool:
        """It stands on its pad, disarmed, and may be given a flight."""
        status = self.drone.status
        return status is not None and status.phase is Phase.PREFLIGHT and self.drone.is_automatic

    @property
    def rests_at(self) -> int | None:
        """The vertex from which traffic may fly it on: it waits on its pad, or holds over a node."""
        status, floor = self.drone.status, self.drone.floor
        fits = floor is not None and self._floor.is_of(floor)
        if status is None or not fits or not self.drone.is_heard or not self.drone.is_automatic:
            return None
        if self.waits:
            return self._floor.pad(self.name)
        if status.phase is not Phase.HOLD or not self.drone.vehicle.is_idle or status.position is None:
            return None
        node = self._floor.node_at((status.position.x_m, status.position.y_m))
        is_there = node is not None and node == self.drone.vehicle.last_node
        # whose leg leads on to another node cannot be turned round
        return self._floor.lanes.over(node) if node and is_there and status.way[:1] == (node,) else None

    def report(self) -> DroneReport:
        """What traffic is told."""
        self._see_done()
        standing, status = self.drone.standing, self.drone.status
        left_s = None if status is None else status.battery_left_s
        if left_s is None:
            left_s = _FULL_S
        charge = RESERVE + left_s / FLIGHT_S
        ready = status is not None and CommandKind.START in status.possible and standing is not None
        if self.waits and not self._base and not ready:
            charge = 0.0  # nobody sends it anywhere
        return DroneReport(self.name, self._done, charge, self._doubt_m(status))

    def _doubt_m(self, status: StatusReport | None) -> float:
        if status is None or status.phase not in FLYING:
            return 0.0
        if status.phase is Phase.RELOCATE:
            return _DOUBTS_M
        at = status.position
        sigmas = () if at is None else (at.sigma_x_m, at.sigma_y_m)
        worst_m = _SIGMAS * max((sigma for sigma in sigmas if sigma is not None), default=0.0)
        return max(worst_m - self._uncertainty_m, 0.0) if status.phase not in _CLIMBS else 0.0

    def _see_done(self) -> None:
        while self._base and self._is_done(self._base[0]):
            self._base.popleft()
            self._done += 1

    def _is_done(self, step: _Step) -> bool:
        if step.action.act is Act.TAKE_OFF:
            status = self.drone.status
            return status is not None and status.phase in FLYING and status.phase not in _CLIMBS
        vehicle = self.drone.vehicle
        reached = step.sequence is not None and vehicle.last_sequence >= step.sequence
        return reached and (not step.count or vehicle.is_over(step.count))

    def _note_astray(self, status: StatusReport) -> None:
        """It has landed elsewhere than on its pad, and its daemon may be started anew there, believing to be
        on the pad: it is a person's then, and lies where it is until he gives it back."""
        at = status.position
        if not self._astray and status.phase in OVER and at is not None:
            self._astray = not self._floor.is_pad(self.name, (at.x_m, at.y_m))
            if self._astray:
                self.drone.taken_by_person()

    @property
    def air(self) -> tuple[int, frozenset[int]]:
        """A vertex near it, and all where it may be while somebody else flies it: on its way, and home."""
        status, pad = self.drone.status, self._floor.pad(self.name)
        if status is None:
            return self._air
        at = None if status.position is None else (status.position.x_m, status.position.y_m)
        armed = status.vehicle is None or status.vehicle.armed
        if self._astray and not armed:
            return self._air
        if not armed and at is not None and self._floor.is_pad(self.name, at):
            self._air = pad, frozenset()
        elif at is not None and self.drone.is_heard:
            here = self._floor.nearest(at)
            ahead = (*self.drone.vehicle.ahead, *status.way) if armed else ()
            air = self._floor.way(self.name, (here, *ahead)) if armed else frozenset[int]()
            self._air = self._floor.lanes.over(here), air | self._floor.around(at)
        elif not self.drone.is_heard:
            here = self._floor.lanes.vertices[self._air[0]].node
            ordered = [self._node_of(step) for step in self._base]
            gone = self._floor.way(self.name, (here, *status.way, *ordered))
            self._air = self._air[0], self._air[1] | gone
        self._note_astray(status)
        return self._air

    def _node_of(self, step: _Step) -> str:
        return self._floor.lanes.vertices[step.action.vertex].node

    # what it is told

    def begin(self) -> None:
        """Traffic flies it from now on, from where it rests; nothing of before is left."""
        self._base.clear()
        self._done, self._orders, self._refused, self._astray = 0, None, "", False
        self.drone.flies = self.drone.lands = False
        self.drone.has_more = True
        if self._paused:
            self._pause(paused=False)

    def call_off(self, now_s: float) -> None:
        """Traffic does not fly it any more: what it was ordered ends at the next node."""
        self._base.clear()
        self._orders = None
        self.drone.flies = self.drone.lands = self.drone.has_more = False
        if self.drone.is_automatic and now_s - self._called_off_s >= _CALLED_OFF_EVERY_S:
            self._called_off_s = now_s
            self._refused = ""
            if not self.drone.vehicle.is_idle:
                self.drone.hear(instant("cancelOrder"))

    def fly(self, released: Sequence[Action], now_s: float, *, paused: bool) -> None:
        """Fly on so far; stand where it is while `paused`."""
        if not self._base or not self.waits:
            self._stands_since_s = now_s
        elif now_s - self._stands_since_s >= _STARTS_WITHIN_S:
            self._refused = "it does not start"
        self._base.extend(_Step(action) for action in released)
        if paused is not self._paused:
            self._pause(paused=paused)
        self._order()
        lands = bool(self._base) and self._base[0].action.act is Act.LAND
        self.drone.lands = lands and not paused
        self.drone.flies = self._orders is not None and not paused

    def _pause(self, *, paused: bool) -> None:
        self._paused = paused
        self.drone.hear(instant("startPause" if paused else "stopPause"))

    def _order(self) -> None:
        """Order what was released.  On the ground that is only to take off: a drone takes a plan only there,
        and would fly the whole of one whatever became of the station."""
        status = self.drone.status
        if not self._base or status is None or (status.phase in WAITS and self._orders is not None):
            return
        if self._orders is None:
            here = self._floor.pads[self.name].node if self.waits else self.drone.vehicle.last_node
            self._orders = BaseOrders(here)
        if not any(step.action.act is Act.TAKE_OFF for step in self._base):
            for step in self._base:
                if step.sequence is None and step.action.act is not Act.LAND:
                    self._order_step(step, self._orders)
        order = self._orders.take()
        if order is not None:
            self.drone.hear(order)

    def _order_step(self, step: _Step, orders: BaseOrders) -> None:
        node = self._node_of(step)
        aisle = self._faces.get(node)
        sides = [side for side in Side if (aisle, side.value) in self._sides]
        counts = self.drone.standing is not None and self.drone.standing.counts
        if step.action.act is Act.FLY:
            step.sequence = orders.node(node)
        elif step.action.act is Act.COUNT and counts and sides:
            action = scan(sides[0], self._levels)
            step.sequence, step.count = orders.do_at_end([action]), action.action_id
        else:
            step.sequence = orders.end[1]

    def _hear_decided(self, decided: Decided) -> None:
        if decided.refusal is not None and isinstance(decided.about, Order):
            self._refused = decided.refusal.what
