"""Traffic control over the drones of a station: hears what they tell, and flies those that it may.

A drone that is silent, that a person took, that comes home by itself, that landed anywhere or went astray is
flown by somebody else: the air of its way is closed until it rests where traffic can fly it on.
"""

from __future__ import annotations

import logging
from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, Protocol, TypeAlias, TypeVar

from flightd.adapters.ground_link.messages.floor import FloorStatus
from flightd.core.errors import InputError
from flightd.fleet.traffic.cells import CellSize
from flightd.fleet.traffic.closures import Closure
from flightd.fleet.traffic.dispatcher import Dispatcher, DroneReport
from flightd.fleet.traffic.endurance import Endurance
from flightd.fleet.traffic.plan import Action
from flightd.fleet.traffic.traffic_control import TrafficControl
from flightd.fleet.traffic.valued_work import Worth
from flightd.fleet.traffic.work_queue import NodeWork, Value, WorkQueue
from flightd.ground.fleet.fleet_drone import FLIGHT_S, RESERVE, FleetDrone
from flightd.ground.fleet.fleet_floor import HEIGHT_M, FleetFloor
from flightd.ground.fleet.fleet_memory import KeptDrone
from flightd.ground.fleet.traffic_view import TrafficView
from flightd.ground.mqtt.safe_return import Standing
from flightd.ground.valued_nodes import ByValue, valued_nodes
from flightd.mission.plan.leg_times import Pace

_LOG = logging.getLogger(__name__)
_LEAST_S: Final = 60.0
"""A drone with less time left in the air is given nothing."""
_ENDURANCE: Final = Endurance(FLIGHT_S, FLIGHT_S, RESERVE, RESERVE + _LEAST_S / FLIGHT_S)
_READ_MS: Final = 10_000
"""For so long after somebody read how traffic is, all that takes a while to tell is kept ready for him."""
Air: TypeAlias = tuple[int, frozenset[int], float]
"""A place of a drone, all that it may be on, and by how much beside."""
_T = TypeVar("_T")
_SLOWEST_MPS, _FASTEST_MPS = 0.1, 1.0


def pace_of(standings: Iterable[Standing]) -> Pace:
    """That of the slowest drone, with all that it stops for on its own plan."""
    slowest_s = max(standing.pace_s for standing in standings)
    speed_mps = min(max(1.0 / max(slowest_s, 1e-3), _SLOWEST_MPS), _FASTEST_MPS)
    return Pace(HEIGHT_M, 0.5, 0.5, speed_mps, 0.5, 0.8, 1.5, 0.5, 3.0, 6.0, 6.0)


@dataclass(frozen=True, slots=True)
class _Seen:
    """A drone as a step begins: its `report` where traffic flies it, the rest where it does not."""

    report: DroneReport | None
    air: Air = (0, frozenset(), 0.0)
    rests_at: int | None = None
    way_home: frozenset[int] = frozenset()
    here: frozenset[int] = frozenset()
    refused: str = ""


@dataclass(frozen=True, slots=True)
class _Decided:
    """What follows: the released, who stands, who may fly home, who is flown on."""

    base: Mapping[str, Sequence[Action]]
    paused: frozenset[str]
    clear: Mapping[str, bool]
    back: frozenset[str]


Keep: TypeAlias = Callable[[Mapping[str, KeptDrone], WorkQueue], Awaitable[None]]
"""Writes down how drones and work are, before anything is ordered by it."""


class Aside(Protocol):
    """Does a piece of work that takes a while, beside the loop."""

    def __call__(self, work: Callable[[], _T], /) -> Awaitable[_T]: ...


class Closures(Protocol):
    """What people closed."""

    def on(self, floor: FloorStatus) -> Sequence[Closure]:
        """All of it, now, as that map calls it; raises nothing, for who flies is to leave it."""
        ...


class StationTraffic:
    """`step` it often.  It takes the drones one by one, where each rests; what the `queue` has given before
    waits again."""

    def __init__(
        self,
        floor: FleetFloor,
        drones: Mapping[str, FleetDrone],
        pace: Pace,
        cell: CellSize,
        queue: WorkQueue,
        keep: Keep,
        closures: Closures,
        charged_frac: float = 0.0,
    ) -> None:
        """On the pads that the drones share batteries are filled up to `charged_frac`."""
        self._closures = closures
        self._closed: Sequence[Closure] = ()
        self._keep = keep
        self._floor = floor
        self._drones = drones
        self._control = TrafficControl(floor.lanes, pace, cell)
        self._queue = queue
        queue.hand_back([*queue.given])
        gone = [node for node in queue.open if node not in floor.lanes.column_of]
        queue.hand_back(gone, "the drones' map has it no more")
        self._dispatcher = Dispatcher(
            self._control,
            self._queue,
            _ENDURANCE,
            shares=True,
            docks=floor.docks,
            full_at=charged_frac,
            keep_home=True,
        )
        self._docks_told = 0
        self._dwell_ms = int(pace.dwell_s * 1000)
        self._flown: set[str] = set()
        self._called_back: set[str] = set()
        self._airs: dict[str, Air] = {}
        self._asked: list[NodeWork] = []
        self._decides = False
        self._view = TrafficView(self._control, drones)
        self._told: dict[str, Any] = {}
        self._now_ms = self._read_ms = 0
        for name, drone in drones.items():
            drone.levels_of = queue.levels_of
            pad = floor.pad(name)
            self._control.enter(name, drone.air.stand if drone.air.rests else pad, ends=(pad,))

    @property
    def is_outdated(self) -> bool:
        """A drone has another map or pad than before, and all rest: who was told what it flies by begins
        anew."""
        drones = self._drones.values()
        return any(drone.objection for drone in drones) and all(drone.stands for drone in drones)

    @property
    def closed(self) -> dict[str, Closure]:
        """What it keeps closed, by name."""
        return {one.name: one for one in self._closed}

    @property
    def flown(self) -> frozenset[str]:
        """The drones that traffic flies now."""
        return frozenset(self._flown)

    def ask(self, nodes: Sequence[str], drone: str = "") -> None:
        """Have these nodes visited, by that drone or by whichever.  InputError for one that the floor
        lacks."""
        self.ask_worth(dict.fromkeys(nodes, Worth(Value.ASKED)), drone)

    def ask_worth(
        self, worth: Mapping[str, Worth], drone: str = "", *, levels: Sequence[int] = (), run: str = ""
    ) -> None:
        """The same, for nodes that are worth more or less, of which these shelf levels are counted (none:
        all), for a schedule's run."""
        if unknown := [node for node in worth if node not in self._floor.lanes.column_of]:
            raise InputError(f"no node is called {unknown[0]}")
        for i, node in enumerate(self._floor.nodes):
            its = worth.get(node.id)
            if its is not None:
                work = NodeWork(
                    node.id, node.aisle, i, (), self._dwell_ms, its.value, its.age_s, drone, (*levels,), run
                )
                self._asked.append(work)
        if not self._decides:
            self._take_asked()

    def valued(self, worth: Mapping[str, Worth], asked: ByValue) -> tuple[str, ...]:
        """The most valuable nodes (`valued_nodes`) that do not wait yet, and are not closed."""
        closed = {node for one in self._closures.on(self._floor.map) for node in one.nodes}
        known = {*self._queue.open, *self._queue.given, *self.asked, *closed}
        return valued_nodes(self._floor.map, worth, asked, known)

    def _take_asked(self) -> None:
        self._queue.ask(self._asked)
        self._asked.clear()

    async def step(self, now_ms: int, aside: Aside) -> None:
        """Once round.  Whatever plans is done `aside`, by how the drones were before; who is not any more as
        he was then is left to the next step."""
        called = self._call_back()
        seen = {name: self._see(name, drone) for name, drone in self._drones.items()}
        for name in called:  # what is decided, the way home as well, may take seconds
            self._drones[name].call_off(now_ms / 1000)
            self._drones[name].drone.may_go_home = False
        self._now_ms, is_read = now_ms, now_ms - self._read_ms < _READ_MS
        self._told, self._decides = self._document(in_full=is_read), True
        try:
            decided = await aside(partial(self._decide, seen, now_ms))
        finally:
            self._decides = False
            self._take_asked()
        await self._keep_what(decided)
        for name, drone in self._drones.items():
            self._act(name, drone, seen[name], decided, now_ms / 1000)

    def _call_back(self) -> set[str]:
        """Who was released into what is closed since then, and is to be called off: as soon as it flies.  It
        ends at its next node, and is flown out of there."""
        closed, before = self._closures.on(self._floor.map), self._closed
        self._closed, lanes = closed, self._control.lanes
        air = lanes.lanes_between(way for one in closed if one not in before for way in one.ways)
        self._called_back |= {n for n in self._flown if not air.isdisjoint(self._control.drones[n].air)}
        self._called_back &= self._flown
        called = {name for name in self._called_back if not self._drones[name].waits}
        self._called_back -= called
        self._flown -= called
        return called

    async def _keep_what(self, decided: _Decided) -> None:
        """Before it is ordered."""
        kept = {
            name: drone.kept(decided.base.get(name, ()), paused=name in decided.paused)
            for name, drone in self._drones.items()
        }
        await self._keep(kept, self._queue)

    def _see(self, name: str, drone: FleetDrone) -> _Seen:
        drone.look()
        refused = drone.refused if name in self._flown else ""
        if not drone.is_ours:
            self._flown.discard(name)
        if name in self._flown:
            return _Seen(report=drone.report())
        drone.close_air()
        return _Seen(None, drone.closed_air, drone.rests_at, drone.way_home, drone.air.here, refused)

    def _decide(self, seen: Mapping[str, _Seen], now_ms: int) -> _Decided:
        """Keep others out of the air of those that traffic does not fly until each rests, and fly it on
        then; send on the others."""
        self._dispatcher.close(self._closed, now_ms)
        holding = {name: one.rests_at for name, one in seen.items() if one.rests_at is not None}
        clear: dict[str, bool] = {}
        back: set[str] = set()
        for name, one in seen.items():
            if one.report is not None:
                continue
            if self._airs.get(name) != one.air:
                self._airs[name] = one.air
                self._dispatcher.withdraw(name, *one.air, now_ms, one.refused)
            clear[name] = self._control.is_clear(name, one.way_home, one.here)
            pad = self._floor.pad(name)
            if one.rests_at is not None and self._dispatcher.readmit(
                name, one.rests_at, pad, now_ms, holding
            ):
                del self._airs[name]
                back.add(name)
        reports = [seen[name].report for name in sorted(seen)]
        told = [report for report in reports if report is not None]
        commands = self._dispatcher.step(now_ms, told)
        self._view.see(now_ms)
        self._tell_of_docks()
        doubting = {report.drone for report in told if report.doubt_m > 0.0}
        # who looks for his place stands by himself
        return _Decided(commands.base, commands.paused - doubting, clear, frozenset(back))

    def _act(self, name: str, drone: FleetDrone, seen: _Seen, decided: _Decided, now_s: float) -> None:
        drone.look()
        if seen.report is None:
            drone.call_off(now_s)
            drone.drone.may_go_home = decided.clear[name]
        if name in decided.back and drone.rests_at == seen.rests_at:
            drone.begin()
            self._flown.add(name)
        if name in self._flown and (seen.report is None or drone.is_ours):
            drone.fly(decided.base.get(name, ()), now_s, paused=name in decided.paused)
        elif decided.base.get(name):  # not told of it, it would never do what traffic waits for
            self._flown.discard(name)

    def _tell_of_docks(self) -> None:
        docks = self._dispatcher.docks
        new, self._docks_told = docks.told_count - self._docks_told, docks.told_count
        for line in [*docks.told][len(docks.told) - new :]:
            _LOG.warning("%s", line)

    def document(self) -> dict[str, Any]:
        """As JSON has it; while a step is decided, as it was before."""
        self._read_ms = self._now_ms
        return self._told if self._decides else self._document(in_full=True)

    def _document(self, *, in_full: bool) -> dict[str, Any]:
        return {
            "drones": self._view.drones(self.flown, in_full=in_full),
            "inside": self._control.inside(),
            "held_back": self._dispatcher.held_back(),
            "docks": self._view.docks(self._dispatcher.docks),
        }

    @property
    def asked(self) -> tuple[str, ...]:
        """What was asked for since the step in hand began."""
        return tuple(dict.fromkeys(work.node for work in self._asked))
