"""One drone of the station's own fleet, between traffic and the vehicle side that a manager's orders go to:
what is released to it becomes an order, and what it tells becomes actions that are done."""

from __future__ import annotations

import logging
import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

from flightd.adapters.ground_link.messages.floor import FloorStatus
from flightd.adapters.ground_link.messages.published import StatusReport
from flightd.core.types import CommandKind, Phase
from flightd.fleet.traffic.dispatcher import DroneReport
from flightd.fleet.traffic.motions import Act
from flightd.fleet.traffic.plan import Action
from flightd.fleet.traffic.traffic_control import UNKNOWN_M
from flightd.fleet.vda5050.order import Order
from flightd.fleet.vehicle.signals import Decided
from flightd.ground.fleet.base_orders import BaseOrders, instant, scan
from flightd.ground.fleet.drone_air import DroneAir
from flightd.ground.fleet.fleet_floor import FleetFloor, OwnPad
from flightd.ground.fleet.fleet_memory import KeptDrone
from flightd.ground.mqtt.managed_drone import ManagedDrone
from flightd.ground.mqtt.order_flight import WAITS
from flightd.ground.mqtt.safe_return import Standing
from flightd.mission.machine import FLYING

_LOG = logging.getLogger(__name__)
RESERVE: Final = 0.15
FLIGHT_S: Final = 3600.0
"""The charge that traffic is told is the time that the drone itself expects to have left, in such flights."""
_FULL_S: Final = 600.0
"""Of a drone that tells no charge: its own rules bring it home."""
_IS_OVER: Final = "its flight is over: it flies the next one once its flightd was started anew"
_SIGMAS: Final = 3.0
_CALLED_OFF_EVERY_S: Final = 2.0
_STARTS_WITHIN_S: Final = 60.0
_REFUSES_S: Final = 5.0
"""What keeps a drone from going on for so long is told to traffic."""
_IN_AIR: Final = frozenset({*FLYING, Phase.LAND, Phase.RECOVER})
_CLIMBS: Final = frozenset({Phase.TAKE_OFF, Phase.ACQUIRE})


@dataclass(slots=True)
class _Step:
    """Released and not done; at `sequence` of the order, None: not ordered yet; `count` is the id of its
    scan."""

    action: Action
    sequence: int | None = None
    count: str = ""


class FleetDrone:
    """`look` at it first.  `is_ours` says whether traffic may fly it, `air` where it may be while traffic
    does not."""

    def __init__(
        self,
        name: str,
        drone: ManagedDrone,
        floor: FleetFloor,
        uncertainty_m: float,
        charged_frac: float = 0.0,
    ) -> None:
        """On a pad that charges it takes new work from a battery of `charged_frac` on."""
        self.name = name
        self._charged_frac = charged_frac
        self.drone = drone
        self._floor = floor
        self._uncertainty_m = uncertainty_m
        self._base: deque[_Step] = deque()
        self._done = 0
        self._orders: BaseOrders | None = None
        self._refused = ""
        self._refuses_since_s: float | None = None
        self._not_counted: dict[str, str] = {}
        self._checked: tuple[FloorStatus | None, Standing | None] = None, None
        self.objection = ""
        """Why it is not flown on this floor, by its map and where it stands."""
        self._paused, self._was_taken = drone.vehicle.is_paused, False
        self._called_off_s = -math.inf
        self._stands_since_s = 0.0
        self.air = DroneAir(name, floor, drone.stands_on)
        self._faces = {node.id: node.levels for node in floor.nodes}
        self.levels_of: Callable[[str], Sequence[int]] = lambda _node: ()
        """Which are to be counted at a node; none: all."""
        drone.on_decided = self._hear_decided
        self._recalled: KeptDrone | None = None
        self.may_start = True
        """Whether it may leave the ground for what waits."""

    # what it tells

    @property
    def is_ours(self) -> bool:
        """Traffic flies it: it is heard, no person has it, and it is where it was released to."""
        status = self.drone.status
        if status is None or not self.drone.is_heard or not self.drone.is_automatic or self._refused:
            return False
        is_down = self.waits and self._lands  # it flies on from there
        if self.objection or self.air.is_astray or self.air.is_believed is False or is_down:
            return False
        return status.phase not in FLYING or status.phase is Phase.RELOCATE or self._is_on_base(status)

    @property
    def pad(self) -> OwnPad:
        """Where it comes home to."""
        return self._floor.pads[self.name]

    @property
    def refused(self) -> str:
        """Why it does not fly on as it was released; empty where it does."""
        return self._refused

    @property
    def why(self) -> str:
        """Why traffic does not fly it, in words."""
        status, floor = self.drone.status, self.drone.floor
        if status is None or floor is None or not self.drone.is_heard:
            return "it is not heard"
        if self.objection:
            return self.objection
        if self.air.is_astray:
            return "nothing shows that it stands on its pad; give it back once it does"
        if self.drone.is_taken or self.air.is_believed is False:
            return "a person has it" if self.drone.is_taken else "it was started anew in flight"
        if not self.drone.is_automatic:
            is_over = status.phase is Phase.DONE and self.air.rests
            why = f"it takes no orders now: {status.phase}, {status.reason}".removesuffix(", ")
            return _IS_OVER if is_over else why
        return self._refused or "it is not where traffic could fly it on from"

    def _is_on_base(self, status: StatusReport) -> bool:
        """By what traffic released: who is paused on a lane has nothing ahead as a vehicle."""
        base = {self._node_of(step) for step in self._base}
        vehicle = self.drone.vehicle
        return not status.way or status.way[0] in base | {vehicle.last_node, *vehicle.ahead}

    @property
    def waits(self) -> bool:
        """It stands on its pad, disarmed, and may be given a flight."""
        status = self.drone.status
        return status is not None and status.phase is Phase.PREFLIGHT and self.drone.is_automatic

    @property
    def charges_to(self) -> float | None:
        """The charge (0..1) up to which it is filled where it stands before it takes new work; None: it may
        take some."""
        vehicle = None if self.drone.status is None else self.drone.status.vehicle
        if vehicle is None or vehicle.battery_frac is None or not self.waits or self._base:
            return None
        charges = self.pad.charges or self.air.stand != self._floor.pad(self.name)
        return self._charged_frac if charges and vehicle.battery_frac < self._charged_frac else None

    @property
    def _level(self) -> float:
        """How full its battery is, for shared pads: who is charged on its own pad, or takes no other, is
        full."""
        status = self.drone.status
        vehicle = None if status is None else status.vehicle
        if status is None or vehicle is None or status.lands_at is None or self.pad.charges:
            return 1.0
        return 1.0 if vehicle.battery_frac is None else vehicle.battery_frac

    @property
    def stands(self) -> bool:
        """It waits on its pad, and has told where that is."""
        return self.drone.is_heard and self.waits and self.air.rests and self.drone.standing is not None

    @property
    def rests_at(self) -> int | None:
        """The vertex from which traffic may fly it on: it waits on its pad, or holds over a node."""
        status = self.drone.status
        if status is None or self.objection or not self.drone.is_heard or not self.drone.is_automatic:
            return None
        if self.waits:
            return self.air.stand if self.air.rests else None
        if not self.air.is_believed or self._doubt_m(status) > 0.0:
            return None
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
        ready &= self.may_start and self.charges_to is None
        may_start = ready or bool(self._base) or not self.waits
        self.air.doubt_m = self._doubt_m(status)
        failed = dict(self._not_counted)
        return DroneReport(
            self.name,
            self._done,
            charge,
            self.air.doubt_m,
            not_counted=failed,
            level=self._level,
            may_start=may_start,
        )

    def _doubt_m(self, status: StatusReport | None) -> float:
        if status is None or status.phase in _CLIMBS or status.phase not in _IN_AIR:
            return 0.0
        at = status.position
        if at is None or status.phase in {Phase.RELOCATE, Phase.RECOVER}:
            return UNKNOWN_M
        told = [sigma_m for sigma_m in (at.sigma_x_m, at.sigma_y_m) if sigma_m is not None]
        worst_m = _SIGMAS * max(told, default=0.0) - self._uncertainty_m
        return max(worst_m, 0.0 if len(told) == 2 else UNKNOWN_M)

    def _see_done(self) -> None:
        while self._base and self._is_done(self._base[0]):
            step = self._base.popleft()
            self._done += 1
            failure = self.drone.vehicle.failure_of(step.count)
            if failure is not None:
                self._not_counted[self._node_of(step)] = failure or "the count failed"

    def _is_done(self, step: _Step) -> bool:
        if step.action.act is Act.TAKE_OFF:
            status = self.drone.status
            return status is not None and status.phase in FLYING and status.phase not in _CLIMBS
        vehicle = self.drone.vehicle
        reached = step.sequence is not None and vehicle.last_sequence >= step.sequence
        return reached and (not step.count or vehicle.is_over(step.count))

    def look(self) -> None:
        """See what it told, as often as anything is decided by it."""
        drone = self.drone
        if self._was_taken and not drone.is_taken:
            self.air.give_back()
        ordered = not drone.is_heard and bool(self._base or drone.vehicle.ahead)
        was_astray = self.air.is_astray
        self.air.see(drone.status, stands_on=drone.stands_on, ordered=ordered)
        if self.air.is_astray and not was_astray:
            drone.taken_by_person()  # it lies where it is until he gives it back
        self._was_taken = drone.is_taken
        self._check()

    def _check(self) -> None:
        """Its map and pad, whenever it may have others: after each start of its daemon."""
        told = self.drone.floor, self.drone.standing
        floor, standing = told
        if floor is None or (floor is self._checked[0] and standing is self._checked[1]):
            return
        self._checked = told
        objection = self._floor.objection(self.name, floor, self.drone.stands_on)
        before, self.objection = self.objection, objection
        if self.objection and self.objection != before:
            _LOG.warning("%s is not flown: %s", self.name, self.objection)

    @property
    def closed_air(self) -> tuple[int, frozenset[int], float]:
        """A place of it, what it may be on, and by how much beside: near its own pad and another one that it
        tells."""
        air, floor = self.air, self.drone.floor
        if self.drone.status is None:  # not heard by this station yet: it may be anywhere
            return air.place, self._floor.everywhere, air.doubt_m
        if not self.objection or floor is None or not self._floor.is_of(floor):
            return air.place, air.closed, air.doubt_m
        over, beside_m = self._floor.beside(floor)
        stands = (
            () if self.drone.standing is None else self._floor.way(self.name, (self.drone.standing.node,))
        )
        return air.place, air.closed.union([over], stands), max(air.doubt_m, beside_m)

    def close_air(self) -> None:
        """Traffic does not fly it: it may be on all that it was released to, ordered, or tells, and near."""
        status, vehicle = self.drone.status, self.drone.vehicle
        told = () if status is None else status.way
        base = [self._node_of(step) for step in self._base]
        is_held = status is not None and status.phase is Phase.HOLD and status.position is not None
        holds = self.drone.is_heard and is_held
        lands = {step.action.vertex for step in self._base if step.action.act is Act.LAND}
        dock = self._floor.dock_at(None if status is None else status.lands_at)
        pads = lands if dock is None else {*lands, dock}
        ways = [(vehicle.last_node, *vehicle.ahead), told, base]
        self.air.close(ways, self._doubt_m(status), pads=pads, holds=holds)

    @property
    def way_home(self) -> frozenset[int]:
        """The air of the way that it would fly home from where it holds."""
        status = self.drone.status
        here = () if status is None else status.way[:1]
        return self._floor.way(self.name, here)

    def _node_of(self, step: _Step) -> str:
        return self._floor.lanes.vertices[step.action.vertex].node

    # what outlives the station

    def kept(self, released: Sequence[Action] = (), *, paused: bool = False) -> KeptDrone:
        """What the next station has to know, with what the drone is about to be ordered."""
        status, vehicle = self.drone.status, self.drone.vehicle
        if self._recalled is not None and status is None:
            return replace(self._recalled, session=self.drone.kept())
        base = [self._node_of(step) for step in (*self._base, *map(_Step, released))]
        told = () if status is None else status.way
        ways = (base, (vehicle.last_node, *vehicle.ahead), told) if base or not self.air.rests else ()
        known = tuple(tuple(node for node in way if node) for way in ways)
        ordered = [f"{CommandKind.GOTO} {node}" for node in (vehicle.last_node, *vehicle.ahead, *base)]
        if self.waits or status is None:
            ordered += [CommandKind.PLAN, CommandKind.START]
        if paused is not self._paused:
            ordered.append(CommandKind.PAUSE if paused else CommandKind.RESUME)
        return KeptDrone(
            self.drone.kept(), self.air.kept(), tuple(way for way in known if way), tuple(ordered)
        )

    def recall(self, kept: KeptDrone) -> None:
        """Go on with what the station before knew."""
        self._recalled = kept
        self.drone.recall(kept.session, kept.ordered)
        self.air.recall(kept.session.session, kept.air, kept.ways)
        self._was_taken = kept.session.taken

    # what it is told

    def begin(self) -> None:
        """Traffic flies it from now on, from where it rests; nothing of before is left."""
        self._base.clear()
        self._done, self._orders, self._refused, self._refuses_since_s = 0, None, "", None
        self._not_counted.clear()
        self.air.begin()
        self.drone.flies = self.drone.lands = self.drone.docks = False
        self.drone.has_more = True
        if self._paused:
            self._pause(paused=False)

    def call_off(self, now_s: float) -> None:
        """Traffic does not fly it any more: what it was ordered ends at the next node."""
        self._base.clear()
        self._orders = None
        self.drone.flies = self.drone.lands = self.drone.docks = self.drone.has_more = False
        takes_it = self.drone.is_heard and self.drone.is_automatic
        if takes_it and now_s - self._called_off_s >= _CALLED_OFF_EVERY_S:
            self._called_off_s = now_s
            self._refused = ""
            if not self.drone.vehicle.is_idle:
                self.drone.hear(instant("cancelOrder"))

    def fly(self, released: Sequence[Action], now_s: float, *, paused: bool) -> None:
        """Fly on so far; stand where it is while `paused`."""
        if not self._base or not self.waits:
            self._stands_since_s = now_s
        elif now_s - self._stands_since_s >= _STARTS_WITHIN_S:
            self._refused = f"it does not start: {self.drone.trouble}".removesuffix(": ")
        self._see_refusal(now_s)
        self._base.extend(_Step(action) for action in released)
        if paused is not self._paused:
            self._pause(paused=paused)
        self._order()
        lands = self._lands
        self.drone.lands = lands and not paused
        self.drone.docks = lands and self._base[0].action.vertex != self._floor.pad(self.name)
        self.drone.flies = self._orders is not None and not paused

    @property
    def _lands(self) -> bool:
        """All that is left of what it was released to is to come down."""
        return bool(self._base) and self._base[0].action.act is Act.LAND

    def _see_refusal(self, now_s: float) -> None:
        """In the air; on the ground it may be ready a little later."""
        if not self.drone.trouble or not self._base or self.waits:
            self._refuses_since_s = None
        elif self._refuses_since_s is None:
            self._refuses_since_s = now_s
        elif now_s - self._refuses_since_s >= _REFUSES_S:
            self._refused = self.drone.trouble

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
            stand = self._floor.lanes.vertices[self.air.stand].node
            here = stand if self.waits else self.drone.vehicle.last_node
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
        levels, faces = self.levels_of(node), {*self._faces.get(node, ())}
        counts = self.drone.standing is not None and self.drone.standing.counts
        counts &= bool(faces) and not (levels and faces.isdisjoint(levels))
        if step.action.act is Act.FLY:
            step.sequence = orders.node(node)
        elif step.action.act is Act.COUNT and counts:
            action = scan(levels)
            step.sequence, step.count = orders.do_at_end([action]), action.action_id
        else:
            step.sequence = orders.end[1]

    def _hear_decided(self, decided: Decided) -> None:
        if decided.refusal is not None and isinstance(decided.about, Order):
            self._refused = decided.refusal.what
