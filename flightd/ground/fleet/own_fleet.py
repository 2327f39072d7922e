"""The fleet that the station flies itself: it keeps each drone's vehicle side, and steps traffic control over
them once all have told where they stand."""

from __future__ import annotations

import asyncio
import logging
import math
import uuid
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import partial
from typing import Any, Final

from flightd.adapters.ground_link.messages.floor import FloorStatus
from flightd.core.errors import FlightdError, InputError, UnavailableError
from flightd.core.types import CommandKind
from flightd.fleet.traffic.cells import CellSize
from flightd.fleet.traffic.valued_work import UNKNOWN, Worth
from flightd.fleet.traffic.work_queue import WorkQueue
from flightd.fleet.vehicle.drone_factsheet import Measures
from flightd.ground.access.roles import Identity, Role
from flightd.ground.fleet.base_orders import VERSION
from flightd.ground.fleet.closed_ways import aisle_closure, closure_between
from flightd.ground.fleet.closure_book import ClosureBook
from flightd.ground.fleet.fleet_drone import FleetDrone
from flightd.ground.fleet.fleet_floor import WHOLE_AIR_M, FleetFloor, with_all_pads
from flightd.ground.fleet.fleet_memory import FleetMemory, KeptDrone, KeptFleet, KeptFloor, KeptRun
from flightd.ground.fleet.station_traffic import Aside, StationTraffic, pace_of
from flightd.ground.hub import Hub
from flightd.ground.messages import Act
from flightd.ground.mqtt.managed_drone import ManagedDrone, OrderRules
from flightd.ground.mqtt.safe_return import Standing
from flightd.ground.mqtt.vehicle_sides import VehicleSides, kept_on
from flightd.ground.valued_nodes import ByValue
from flightd.mission.plan.leg_times import Pace
from flightd.site.site import SAME_NODE_M

TRAFFIC: Final = Identity("fleet traffic", Role.OPERATOR, "local")
"""Whose orders they are, in the audit."""
_LOG = logging.getLogger(__name__)
_STEP_S: Final = 0.25
_AGAIN_S: Final = 5.0
_MOST_RUNS: Final = 1000
_CHARGED_FRAC: Final = 0.8
"""Up to which batteries are filled on shared pads, where nothing else is said."""
_FAILS_AGAIN_S: Final = 60.0
"""If traffic fails so soon after it failed before, it does so over the work that waits."""


class OwnFleet(VehicleSides):
    """The manager of the station's own drones; `run` is a task beside the hub's, `leave` ends it with
    everybody holding where he is."""

    def __init__(
        self,
        drones: Iterable[str],
        measures: Measures,
        rules: OrderRules,
        aside: Aside = asyncio.to_thread,
        memory: FleetMemory | None = None,
        charged_frac: float = 0.0,
    ) -> None:
        """Who stands on a pad that charges takes new work from a battery of `charged_frac` on."""
        self._charged_frac = charged_frac
        self._memory = memory
        self._closures = ClosureBook(memory, aside)
        self._forgets = False
        """What it should write down cannot be written: told once."""
        self._cell = CellSize(body_m=max(measures.length_m, measures.width_m), upright_m=WHOLE_AIR_M)
        super().__init__({name: ManagedDrone(name, VERSION, measures, rules) for name in drones})
        for drone in self._drones.values():
            drone.at_broker = True  # who gives the orders is always there
            drone.may_go_home = False  # until it is known who is in its way
        self._aside = aside
        self._fleet: tuple[FleetFloor, Mapping[str, FleetDrone], Pace] | None = None
        self._traffic: StationTraffic | None = None
        self._queue = WorkQueue(())
        self._runs: dict[str, float] = {}
        """Of schedules, whose work it was given, and until when (UTC) each may be begun."""
        self._may_leave = True
        """Drones may leave the ground for what waits: somebody asked, or the site starts without a person."""
        self._untold_runs: frozenset[str] = frozenset()
        """Of the station before, by hours that may have changed since: nobody leaves the ground until they
        are told again, or a person asks."""
        self._over: Mapping[str, str] = {}
        """Those of which nothing more is begun, and why."""
        self._kept_runs: frozenset[str] = frozenset()
        self._failed_s = -math.inf
        self._compared: dict[str, FloorStatus] = {}
        """The maps by which it was last tried to fly them."""
        self._trouble = ""
        self._hub: Hub | None = None
        self._told: dict[tuple[str, str], Any] | None = {}
        """What drones tell before it is known what the station before knew of them; newest of each topic."""

    def tell(self, drone: str, topic: str, value: Any) -> None:
        """As `hub.Viewer`."""
        if self._told is None:
            super().tell(drone, topic, value)
        else:
            self._told[drone, topic] = value

    def _hear_all(self) -> None:
        """What they told meanwhile: who they are first, then what they did, then how they are."""
        told, self._told = self._told or {}, None
        for wanted in ("welcome", "events", "status", "link"):
            for (drone, topic), value in told.items():
                if topic == wanted:
                    self.tell(drone, topic, value)

    async def run(self, hub: Hub) -> None:
        """Fly them until cancelled."""
        self._hub = hub
        self.follow(hub)
        async with asyncio.TaskGroup() as tasks:
            for name, drone in self._drones.items():
                tasks.create_task(kept_on(name, drone, hub), name=f"{name} as a vehicle")
            tasks.create_task(self._control(), name="traffic")

    async def leave(self) -> None:
        """Have everybody who flies, and whom no person has, hold where he is.  Call it when `run` has ended,
        before the links do."""
        hub = self._hub
        if hub is not None:
            ours = (hub.drones[name] for name, drone in self._drones.items() if drone.is_automatic)
            flying = [drone for drone in ours if drone.flies]
            await self._keep_halts({drone.name for drone in flying})
            halts = [drone.act(_act(CommandKind.PAUSE), by_person=False) for drone in flying]
            for drone, came in zip(flying, await asyncio.gather(*halts, return_exceptions=True), strict=True):
                if isinstance(came, BaseException):
                    _LOG.warning("%s: it was not halted: %s", drone.name, came)

    async def _keep_halts(self, halted: Collection[str]) -> None:
        if self._fleet is not None and self._told is None:
            drones = self._fleet[1]
            kept = {name: drone.kept(paused=name in halted) for name, drone in drones.items()}
            await self._keep_in_mind(kept, self._queue)

    async def _control(self) -> None:
        loop = asyncio.get_running_loop()
        try:
            await self._recall_closures()
            await self._recall()
        finally:
            self._hear_all()
        while True:
            try:
                self._end_runs()
                await self._assemble()
                if self._traffic is not None:
                    await self._traffic.step(int(loop.time() * 1000), self._aside)
            except Exception as err:  # noqa: BLE001 - the station goes on; nobody is released to more
                _LOG.error("the traffic of the fleet failed, and begins anew", exc_info=True)
                self._traffic, self._trouble = None, f"it failed: {err}"
                if loop.time() - self._failed_s < _FAILS_AGAIN_S:
                    self._queue.hand_back([*self._queue.given, *self._queue.open], "traffic failed over it")
                self._failed_s = loop.time()
                for drone in self._drones.values():
                    drone.may_go_home = False  # nobody knows who is in its way
                await asyncio.sleep(_AGAIN_S)
            await asyncio.sleep(_STEP_S)

    async def _assemble(self) -> None:
        """Once every drone has told its map and where it stands: nobody flies before, for each may be
        anywhere.  Where each may be is known on when traffic has failed."""
        if self._traffic is None and self._fleet is not None:
            await self._begin(*self._fleet)
        elif self._traffic is None or (self._traffic.is_outdated and self._is_told_anew):
            await self._compare()
        elif not self._traffic.is_outdated:
            self._trouble = ""

    async def _recall_closures(self) -> None:
        """Nobody is flown before it is known what people closed: they may be in there."""
        while True:
            try:
                await self._closures.recall()
            except FlightdError as err:
                trouble = f"what people closed cannot be read: {err}"
            else:
                return
            if self._trouble != trouble:
                _LOG.error("the fleet does not fly: %s", trouble)
            self._trouble = trouble
            await asyncio.sleep(_AGAIN_S)

    async def _recall(self) -> None:
        """Go on where the station before was ended, if it flew the same drones."""
        try:
            known = None if self._memory is None else await self._aside(self._memory.read)
            if known is not None:
                await self._begin_as_before(*known)
        except FlightdError as err:
            _LOG.warning("what the station before knew of its fleet is not used: %s", err)
        except Exception:  # noqa: BLE001 - the fleet begins when all stand on the ground
            _LOG.error("what the station before knew of its fleet is not used", exc_info=True)

    async def _begin_as_before(self, floor: KeptFloor, fleet: KeptFleet) -> None:
        """Nobody leaves the ground for what that station was asked for, unless the site starts without a
        person; who is in the air flies on to it.  Where what is closed is not on their map, that is closed
        everywhere, as it was before: nobody is left hanging in the air."""
        if {*fleet.drones} != {*self._drones} or {*floor.floors} != {*self._drones}:
            _LOG.warning("the fleet had other drones before: it flies once all told where they stand")
            return
        stands = {name: standing.node for name, standing in floor.standings.items()}
        made = await self._made(floor.floors, stands)
        drones = self._drones_on(made)
        for name, drone in drones.items():
            drone.recall(fleet.drones[name])
        self._compared, self._queue = dict(floor.floors), WorkQueue.of(fleet.work)
        self._runs = {run: given.until_s for run, given in fleet.given.items()}
        self._kept_runs = frozenset(self._runs)
        self._queue.runs = {run: given.held for run, given in fleet.given.items()}
        self._untold_runs = self._queue.runs_left
        self._may_leave = all(told.unattended_start for told in floor.floors.values())
        await self._begin(made, drones, pace_of(floor.standings.values()))

    async def _made(self, floors: Mapping[str, FloorStatus], stands: Mapping[str, str]) -> FleetFloor:
        """InputError where they cannot be flown on it."""
        return await self._aside(partial(FleetFloor, floors, stands, self._cell))

    def _drones_on(self, floor: FleetFloor) -> dict[str, FleetDrone]:
        return {
            name: FleetDrone(name, drone, floor, self._cell.uncertainty_m, self._charged_on(floor))
            for name, drone in self._drones.items()
        }

    def _charged_on(self, floor: FleetFloor) -> float:
        return self._charged_frac or (_CHARGED_FRAC if floor.docks else 0.0)

    async def _keep_in_mind(self, drones: Mapping[str, KeptDrone], queue: WorkQueue) -> None:
        # as it is now: more may be asked for while it is written down beside the loop
        work, waits, runs = queue.kept(), bool(queue.open or queue.given), self._given_runs
        if await self._write(lambda memory: memory.keep(drones, work, waits=waits, runs=runs)):
            self._kept_runs = frozenset(runs)

    async def _write(self, what: Callable[[FleetMemory], None]) -> bool:
        """Whether it was written, as far as anything is.  Flights go on where the disk refuses: what is lost
        then is lost with the station alone."""
        if self._memory is None:
            return True
        try:
            await self._aside(partial(what, self._memory))
            self._forgets = False
        except FlightdError as err:
            if not self._forgets:
                _LOG.warning("the fleet's flights are not written down: %s", err)
            self._forgets = True
        return not self._forgets

    async def _begin(self, floor: FleetFloor, drones: Mapping[str, FleetDrone], pace: Pace) -> None:
        self._traffic, self._fleet = None, (floor, drones, pace)
        self._let_start()
        closed = self._closures
        made = partial(
            StationTraffic,
            floor,
            drones,
            pace,
            self._cell,
            self._queue,
            self._keep_in_mind,
            closed,
            self._charged_on(floor),
        )
        self._traffic, self._trouble = await self._aside(made), ""

    @property
    def _is_told_anew(self) -> bool:
        return any(drone.floor is not self._compared.get(name) for name, drone in self._drones.items())

    async def _compare(self) -> None:
        """Fly them by their maps and pads as they are told now; as before where that cannot be."""
        floors: dict[str, FloorStatus] = {}
        standings: dict[str, Standing] = {}
        for name, drone in self._drones.items():
            if drone.floor is not None and drone.standing is not None and drone.is_heard:
                floors[name], standings[name] = drone.floor, drone.standing
        if missing := [name for name in self._drones if name not in floors]:
            self._trouble = f"{', '.join(missing)} did not tell yet where it stands on the ground"
            return
        self._compared = floors
        stands = {name: standing.node for name, standing in standings.items()}
        try:
            floor = await self._made(floors, stands)
            self._closures.check(floor.map)
        except InputError as err:
            if self._trouble != str(err):
                _LOG.warning(
                    "the fleet %s: %s", "does not fly" if self._traffic is None else "flies on as before", err
                )
            self._trouble = str(err)
            return
        if self._fleet is not None:
            self._give_up_moved(self._fleet[0].map, floor.map)
        drones = self._drones_on(floor)
        await self._keep_begun(KeptFloor(floors, standings), drones)
        await self._begin(floor, drones, pace_of(standings.values()))

    async def _keep_begun(self, floor: KeptFloor, drones: Mapping[str, FleetDrone]) -> None:
        """With the work: a station that dies before it has decided anything loses none."""
        for drone in drones.values():
            drone.look()
        kept = {name: drone.kept() for name, drone in drones.items()}
        work, runs = self._queue.kept(), self._given_runs
        if await self._write(lambda memory: memory.begin(floor, kept, work, runs=runs)):
            self._kept_runs = frozenset(runs)

    def _give_up_moved(self, before: FloorStatus, after: FloorStatus) -> None:
        """A node that is called as another one was is none that somebody asked for."""
        was = {node.id: (node.x_m, node.y_m) for node in before.nodes}
        wanted = {*self._queue.open, *self._queue.given} & was.keys()
        for node in after.nodes:
            if node.id in wanted and math.dist((node.x_m, node.y_m), was[node.id]) > SAME_NODE_M:
                self._queue.give_up(node.id, "the drones' map has it no more")

    # what is asked of it

    def ask(self, nodes: Sequence[str], drone: str = "") -> None:
        """Have these nodes visited, by that drone or by whichever.  InputError for one that is not there,
        UnavailableError where the fleet does not fly yet."""
        if drone and drone not in self._drones:
            raise InputError(f"no drone of the fleet is called {drone}")
        self._flying().ask(nodes, drone)
        self._let_leave()

    def ask_by_value(self, worth: Mapping[str, Worth], asked: ByValue) -> tuple[str, ...]:
        """Have the most valuable visited; which.  UnavailableError where the fleet does not fly yet."""
        chosen = self.valued(worth, asked)
        self._flying().ask_worth({node: worth.get(node, UNKNOWN) for node in chosen})
        self._let_leave()
        return chosen

    # what schedules ask of it

    @property
    def names(self) -> frozenset[str]:
        """Of its drones."""
        return frozenset(self._drones)

    @property
    def map(self) -> FloorStatus:
        """By which they fly.  UnavailableError where none told it yet."""
        return self._floor

    @property
    def trouble(self) -> str:
        """Why it does not fly; empty where it does."""
        return "" if self._traffic is not None else self._trouble or "no drone told its map yet"

    def valued(self, worth: Mapping[str, Worth], asked: ByValue) -> tuple[str, ...]:
        """The most valuable nodes that may be asked for now.  UnavailableError where the fleet does not
        fly."""
        return self._flying().valued(worth, asked)

    def has_run(self, run: str) -> bool:
        """It was given the work of a run, which may not be written down yet."""
        return run in self._runs

    def knows_run(self, run: str) -> bool:
        """The work of a run is written down as given, with the run's id."""
        return run in self._kept_runs

    def take_run(
        self, run: str, worth: Mapping[str, Worth], *, until_s: float = 0.0, levels: Sequence[int] = ()
    ) -> None:
        """Have the nodes of a schedule's run visited, once, and these levels counted there (none: all);
        `knows_run` says when that is written down.  Until `until_s` (UTC) it outlives a station that ends.
        InputError for a node that is not there, UnavailableError where the fleet does not fly."""
        traffic = self._flying()
        if not self.has_run(run):
            traffic.ask_worth(worth, levels=levels, run=run)
            self._runs = dict([*self._runs.items(), (run, until_s)][-_MOST_RUNS:])
            self._queue.runs = {**self._queue.runs, run: ""}
        self._let_leave()

    @property
    def runs_left(self) -> frozenset[str]:
        """Those of which something waits, or is given to a drone."""
        return self._queue.runs_left

    def has_begun(self, nodes: Sequence[str]) -> bool:
        """Whether one of these was visited, or a drone is to visit it, since they were asked for."""
        return not {*nodes}.isdisjoint((*self._queue.done, *self._queue.given))

    def let_runs(self, why_not: Mapping[str, str], over: Mapping[str, str]) -> None:
        """Of these runs why nothing is begun now, empty where it may be; what waits of those that are `over`
        is given up, for these reasons."""
        known = {**self._queue.runs, **why_not}
        self._queue.runs = {run: known[run] for run in known if run in self._runs}
        self._over = dict(over)
        self._untold_runs &= self.runs_left - why_not.keys() - over.keys()
        self._let_start()

    @property
    def _given_runs(self) -> dict[str, KeptRun]:
        held = self._queue.runs
        return {run: KeptRun(until_s, held.get(run, "")) for run, until_s in self._runs.items()}

    def _end_runs(self) -> None:
        if self._over:
            for node in self._queue.open:
                if why := self._over.get(self._queue.work(node).run):
                    self._queue.give_up(node, why)

    def left_of(self, nodes: Sequence[str]) -> tuple[str, ...]:
        """Which of these it has not visited, or was asked for since."""
        done = {*self._queue.done}
        return tuple(node for node in nodes if node not in done)

    def _let_leave(self) -> None:
        """Once something was asked that is not refused: drones may leave the ground, and begin nothing of a
        run whose hours are not told again."""
        untold = self._untold_runs
        self._queue.runs = {run: why for run, why in self._queue.runs.items() if run not in untold}
        self._may_leave, self._untold_runs = True, frozenset()
        self._let_start()

    def _let_start(self) -> None:
        for each in self._fleet[1].values() if self._fleet is not None else ():
            each.may_start = self._may_leave and not self._untold_runs

    def _flying(self) -> StationTraffic:
        if self._traffic is None:
            raise UnavailableError(f"the fleet does not fly: {self._trouble}")
        return self._traffic

    @property
    def site(self) -> str:
        """The name of the drones' map.  UnavailableError where none has told one yet."""
        return self._floor.name

    @property
    def _floor(self) -> FloorStatus:
        """By which they are flown, or will be."""
        if self._fleet is not None:
            return self._fleet[0].map
        told = [drone.floor for drone in self._drones.values() if drone.floor is not None]
        if not told:
            raise UnavailableError("no drone told its map yet")
        return with_all_pads(told)

    async def close(self, by: str, *, aisle: str = "", nodes: Sequence[str] = ()) -> str:
        """Have nobody fly in an aisle, or between these nodes, until somebody opens that by the name that is
        returned.  InputError for what is not there, UnavailableError where no drone told its map yet, or it
        is closed and not written down."""
        floor = self._floor
        closure = aisle_closure(floor, aisle) if aisle else closure_between(floor, nodes)
        await self._closures.close(closure, floor, by)
        return closure.name

    async def open(self, name: str) -> None:
        """Have them fly there again.  InputError where nothing is closed by that name."""
        try:
            await self._closures.open(name)
        finally:
            self._compared = {}  # it may have kept them from flying by their maps

    def document(self) -> dict[str, Any]:
        """How it is, as JSON has it."""
        told = {} if self._traffic is None else self._traffic.document()
        asked = () if self._traffic is None else self._traffic.asked
        held: Mapping[str, str] = {**self._queue.held, **told.get("held_back", {})}
        work = {
            "open": [*(node for node in self._queue.open if node not in held), *asked],
            "given": dict(self._queue.given),
            "done": list(self._queue.done),
            "not_done": {**self._queue.reasons, **held},
        }
        flown = {} if self._traffic is None else self._traffic.closed
        closed = self._closures.document(told.get("inside", {}), flown)
        flies = {"flies": self._traffic is not None, "trouble": self._trouble}
        docks = told.get("docks", [])
        return {**flies, "drones": told.get("drones", {}), **work, "closed": closed, "docks": docks}


async def stop_all(hub: Hub) -> dict[str, FlightdError | None]:
    """STOP to every drone of the station; for each why not, or nothing."""
    drones = list(hub.drones.values())
    answers = await asyncio.gather(
        *(drone.act(_act(CommandKind.STOP)) for drone in drones), return_exceptions=True
    )
    found: dict[str, FlightdError | None] = {}
    for drone, answer in zip(drones, answers, strict=True):
        if isinstance(answer, BaseException) and not isinstance(answer, FlightdError):
            raise answer
        found[drone.name] = answer if isinstance(answer, FlightdError) else None
    return found


def _act(kind: CommandKind) -> Act:
    return Act(f"fleet-{uuid.uuid4().hex}", kind)
