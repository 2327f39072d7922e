"""Starts what is due: each run once, and only where nobody and nothing speaks against it.

A run stands in the book before anything is ordered.  Its plan and its start have ids of their own, so that a
station that died in between sends the same orders again, which the drone does once; where the drone's flightd
was started anew meanwhile nobody knows what it did, and nothing is sent again.
"""

from __future__ import annotations

import asyncio
import logging
import time
import uuid
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Final, Protocol

from flightd.adapters.ground_link.messages.answers import Accepted, Planned, Welcome
from flightd.adapters.ground_link.messages.floor import FloorStatus
from flightd.adapters.ground_link.messages.published import StatusReport
from flightd.core.errors import FlightdError, InputError, RunError
from flightd.core.types import CommandKind, Phase
from flightd.core.utc_time import utc_time
from flightd.fleet.schedule.due import LOOK_BACK, decide
from flightd.fleet.schedule.rule import MOST_WINDOW, Occurrence
from flightd.fleet.traffic.valued_work import UNKNOWN, PlaceFacts, Worth, worth_of
from flightd.fleet.traffic.work_queue import Value
from flightd.ground.access.roles import Identity, Role
from flightd.ground.bounded import Threads
from flightd.ground.ground_store.store import GroundStore
from flightd.ground.manager_routes import Managers
from flightd.ground.messages import Act
from flightd.ground.missions.mission_book import MissionBook
from flightd.ground.schedules.fleet_runs import ScheduledFleet, fleet_objection
from flightd.ground.schedules.kept import CountAll, CountByValue, CountMission, Schedule
from flightd.ground.schedules.run_hours import hours_of_runs, until_s
from flightd.ground.schedules.schedule_book import MOST_RUNS, ORDERED, Run, RunState, ScheduleBook
from flightd.ground.schedules.start_rules import (
    CHANGED,
    OFF,
    PLAN,
    QUIET,
    SUSPENDED,
    Cause,
    Objection,
    is_flying_plan,
    objection,
)
from flightd.ground.schedules.work import Work, valued_work, work_of
from flightd.ground.valued_nodes import valued_nodes

_LOG = logging.getLogger(__name__)
_AT_ONCE, _MOST_WAITING = 1, 8
_MOST_WORDS = 300
_GIVEN_UP_S: Final = 3600.0
"""So long after the end of its time a run that was ordered waits for the drone to be heard."""
_NO_ANSWER: Final = "the drone did not answer in time"


@dataclass(frozen=True, slots=True)
class StationClock:
    """The time of day, UTC; how often the schedules are looked at; and after how long a drone that refused a
    run is asked again."""

    utc_ns: Callable[[], int] = time.time_ns
    step_s: float = 2.0
    rest_s: float = 30.0


THIS_MACHINE: Final = StationClock()


class ScheduledDrone(Protocol):
    """What `DroneLink` is to a schedule."""

    name: str
    attends_run: bool
    by_person_at_s: float

    @property
    def welcome(self) -> Welcome | None: ...

    @property
    def heard(self) -> StatusReport | None: ...

    async def act(self, act: Act, *, by_person: bool = True) -> Accepted: ...

    async def plan_flight(
        self,
        nodes: Sequence[str],
        levels: Sequence[int],
        order_id: str = "",
        *,
        best_order: bool = False,
        dry: bool = False,
        session: str = "",
        seen_ns: int = 0,
        by_person: bool = True,
    ) -> Planned: ...


class Audit(Protocol):
    """Where it is written down what a schedule did."""

    def write_down(self, who: Identity | None, address: str, act: str, target: str, **outcome: str) -> None:
        """A line of it."""
        ...


class Facts(Protocol):
    """What `SiteFacts` is to a schedule."""

    async def of(self, site: str) -> Sequence[PlaceFacts]:
        """Every place that is known.  FlightdError where that cannot be read."""
        ...


class NightShift:
    """`run` looks at the schedules of the `book` until cancelled; what a run counts is in the `missions`, in
    the `store` and on the drone's floor, and what is worth most of it by the `facts`."""

    def __init__(
        self,
        book: ScheduleBook,
        missions: MissionBook,
        store: GroundStore | None,
        facts: Facts,
        drones: Mapping[str, ScheduledDrone],
        audit: Audit,
        managers: Managers | None = None,
        clock: StationClock = THIS_MACHINE,
        fleet: ScheduledFleet | None = None,
    ) -> None:
        """What is due for a drone of the `fleet` is work of all its drones."""
        self._fleet = fleet
        self._book = book
        self._missions = missions
        self._store = store
        self._facts = facts
        self._drones = drones
        self._audit = audit
        self._managers = managers
        self._clock = clock
        self._threads = Threads(_AT_ONCE, _MOST_WAITING, "the schedules are being looked at already")
        self._trouble: dict[str, str] = {}
        self._left: dict[str, tuple[str, tuple[str, ...]]] = {}
        """Of each schedule of a mission that the fleet has: the plan of its newest run, and the nodes."""
        self._of_fleet: dict[str, tuple[Schedule, Run]] = {}
        """By their plans the runs that were given to the fleet, as they were read last."""
        self._rests: dict[str, float] = {}
        """Until when nothing is ordered for a schedule, by the loop's clock: its drone has just refused, or
        what it counts could not be known."""

    async def run(self) -> None:
        """Look, and look again."""
        while True:
            try:
                await self.step()
                self._note("step", "")
            except Exception as err:  # noqa: BLE001 - its end would be the station's
                self._note("step", f"the schedules failed: {err!r}")
            await asyncio.sleep(self._clock.step_s)

    async def step(self) -> None:
        """Start what is due, and write down what was missed."""
        wanted: set[str] = set()
        left = frozenset() if self._fleet is None else self._fleet.runs_left
        self._of_fleet.clear()
        try:
            schedules, damaged = await self._threads.run(self._book.schedules)
            self._note("", "")
        except FlightdError as err:
            schedules, damaged = [], []
            self._note("", str(err))
        for one in damaged:
            self._note(one.id, f"schedule {one.name}: {one.why}")
        for schedule in schedules:
            try:
                if await self._look(schedule):
                    wanted.add(schedule.kept.drone)
                self._note(schedule.id, "")
            except FlightdError as err:  # nothing is started that is not written down
                self._note(schedule.id, f"schedule {schedule.kept.name}: {err}")
        noted = {"", "step", *(one.id for one in schedules), *(one.id for one in damaged)}
        self._trouble = {of: text for of, text in self._trouble.items() if text and of in noted}
        if self._fleet is not None:
            self._bind_runs(self._fleet, left, is_whole=not self._trouble.keys() - {"step"})
        for name, drone in self._drones.items():
            drone.attends_run = name in wanted or is_flying_plan(drone.heard)

    def _bind_runs(self, fleet: ScheduledFleet, left: Collection[str], *, is_whole: bool) -> None:
        now_s = self._clock.utc_ns() / 1e9
        fleet.let_runs(*hours_of_runs(left, self._of_fleet, fleet.has_begun, now_s, is_whole=is_whole))

    def _note(self, of: str, trouble: str) -> None:
        if trouble and self._trouble.get(of) != trouble:
            _LOG.warning("%s", trouble)
        self._trouble[of] = trouble

    async def _look(self, schedule: Schedule) -> bool:
        """Whether a run is due, or ordered and unanswered, so that the station attends."""
        now = utc_time(self._clock.utc_ns())
        oldest = (now - LOOK_BACK - 2 * MOST_WINDOW).date()
        runs = {
            run.day: run for run in await self._threads.run(self._book.runs, schedule.id, MOST_RUNS, oldest)
        }
        self._of_fleet |= {run.plan: (schedule, run) for run in runs.values() if run.state in ORDERED}
        started = [run for run in runs.values() if run.state is RunState.STARTED]
        if started and isinstance(schedule.kept.count, CountMission):
            newest = max(started, key=lambda run: run.day)
            await self._note_left(schedule, schedule.kept.count.mission, newest)
        unanswered = [run for run in runs.values() if run.state is RunState.ORDERED]
        for run in unanswered:
            await self._resume(schedule, run, now)
        if not schedule.kept.enabled:
            await self._end_waiting(schedule, runs.values(), SUSPENDED)
            return bool(unanswered)
        since = utc_time(schedule.since_ns)
        ordered = [day for day, run in runs.items() if run.state in ORDERED]
        told = [day for day, run in runs.items() if run.state is RunState.MISSED]
        decision = decide(schedule.rule, since, ordered, told, now)
        for missed in decision.missed:
            await self._miss(schedule, missed, runs.pop(missed.day, None))
        others = [run for day, run in runs.items() if decision.due is None or day != decision.due.day]
        await self._end_waiting(schedule, others, CHANGED)
        if decision.due is None:
            return bool(unanswered)
        known = runs.get(decision.due.day)
        if decision.is_quiet:
            await self._wait(schedule, decision.due, known, QUIET)
            return bool(unanswered)
        await self._begin(schedule, decision.due, known, now)
        return True

    async def _begin(self, schedule: Schedule, due: Occurrence, known: Run | None, now: datetime) -> None:
        """Start a run, or write down what speaks against it."""
        if asyncio.get_running_loop().time() < self._rests.get(schedule.id, 0.0):
            return
        drone = self._drones.get(schedule.kept.drone)
        if drone is None:
            none = Objection(Cause.UNREACHABLE, f"there is no drone {schedule.kept.drone!r}")
            await self._wait(schedule, due, known, none)
            return
        drone.attends_run = True
        fleet = self._fleet_of(drone)
        against = self._objection(schedule, drone)
        status, welcome = drone.heard, drone.welcome
        floor = fleet.map if fleet is not None and against is None else None
        if floor is None and welcome is not None and status is not None:
            floor = welcome.floor
        if against is not None or floor is None:
            await self._wait(schedule, due, known, against or OFF)
            return
        try:
            work = await self._work(schedule, floor, fleet, now)
        except FlightdError as err:
            self._rest(schedule)
            await self._wait(schedule, due, known, Objection(Cause.WORK, str(err)))
            return
        session = "" if fleet is not None or welcome is None else welcome.session
        run = Run(
            schedule=schedule.id,
            day=due.day,
            state=RunState.ORDERED,
            due_ns=_ns(due.at),
            changed_ns=self._clock.utc_ns(),
            drone=drone.name,
            plan=f"{PLAN}{uuid.uuid4().hex}",
            session=session,
            nodes=work.nodes,
            levels=work.levels,
        )
        await self._threads.run(self._book.write, run)
        if fleet is not None:
            await self._hand_over(schedule, run, fleet)
        else:
            await self._order(schedule, run, drone, may_be_started=False)

    async def _work(
        self, schedule: Schedule, floor: FloorStatus, fleet: ScheduledFleet | None, now: datetime
    ) -> Work:
        """FlightdError where that is nothing, or cannot be known."""
        count = schedule.kept.count
        if not isinstance(count, CountByValue):
            first = await self._urgent(schedule) if isinstance(count, CountAll) else {}
            return await self._threads.run(
                work_of, schedule, count, floor, self._missions, self._store, now, first
            )
        worth = worth_of(await self._facts.of(schedule.kept.site))
        chosen = valued_nodes(floor, worth, count) if fleet is None else fleet.valued(worth, count)
        return valued_work(floor, worth, chosen)

    async def _urgent(self, schedule: Schedule) -> dict[str, Worth]:
        """The nodes of its site at which something is asked for, or is not what the books say; none where
        that cannot be known."""
        if self._store is None:
            return {}
        try:
            worth = worth_of(await self._facts.of(schedule.kept.site))
        except FlightdError as err:  # all is counted in its turn, whatever the books are
            _LOG.warning("schedule %s: what goes first is not known: %s", schedule.kept.name, err)
            return {}
        return {node: its for node, its in worth.items() if its.value >= Value.CONTRADICTED}

    def _fleet_of(self, drone: ScheduledDrone) -> ScheduledFleet | None:
        """That of which a drone is one."""
        return self._fleet if self._fleet is not None and drone.name in self._fleet.names else None

    async def _hand_over(self, schedule: Schedule, run: Run, fleet: ScheduledFleet) -> None:
        """Give the fleet what is due, once: it keeps the run's id beside the work.  Until that is written
        down the run is none that was started."""
        if not fleet.has_run(run.plan):
            try:
                worth = await self._worth(schedule, run.nodes)
                fleet.take_run(run.plan, worth, until_s=until_s(schedule, run), levels=run.levels)
            except FlightdError as err:
                await self._refused(schedule, run, RunState.WAITING, str(err))
                return
        if fleet.knows_run(run.plan):
            await self._mark(schedule, run.plan, run.nodes)
            await self._write(replace(run, state=RunState.STARTED, cause="", why=""))
            self._write_down(schedule, run, "accepted", f"{run.day}: {', '.join(run.nodes)}")

    async def _resume(self, schedule: Schedule, run: Run, now: datetime) -> None:
        """Go on with a run that was ordered and not answered: the link was lost, or the station ended."""
        drone = self._drones.get(run.drone)
        status = None if drone is None else drone.heard
        over_s = self._clock.utc_ns() / 1e9 - until_s(schedule, run)
        fleet = None if drone is None or run.session else self._fleet_of(drone)
        if drone is not None and fleet is not None:
            may = over_s < 0 and not schedule.rule.is_quiet(now) and self._objection(schedule, drone) is None
            if may or fleet.has_run(run.plan):
                await self._hand_over(schedule, run, fleet)
            elif over_s >= 0:
                await self._write(replace(run, state=RunState.UNKNOWN, why=_NO_ANSWER))
        elif drone is None or status is None:
            if over_s > _GIVEN_UP_S:
                await self._write(replace(run, state=RunState.UNKNOWN, why="the drone was not heard again"))
        elif status.session != run.session:
            why = "its flightd was started anew before it answered"
            await self._write(replace(run, state=RunState.UNKNOWN, why=why))
        elif status.plan == run.plan and status.phase is not Phase.PREFLIGHT:
            await self._write(replace(run, state=RunState.STARTED))
        elif over_s >= 0:
            await self._write(replace(run, state=RunState.UNKNOWN, why=_NO_ANSWER))
        elif not schedule.rule.is_quiet(now) and self._objection(schedule, drone) is None:
            await self._order(schedule, run, drone, may_be_started=True)

    async def _order(
        self, schedule: Schedule, run: Run, drone: ScheduledDrone, *, may_be_started: bool
    ) -> None:
        """Hand the run's plan to the drone and start it; no answer leaves it as it is.  `may_be_started`: a
        start was sent before, to which nobody answered."""
        status = drone.heard
        seen_ns = 0 if status is None else status.stamp_ns
        try:
            planned = await drone.plan_flight(
                run.nodes, run.levels, run.plan, session=run.session, seen_ns=seen_ns, by_person=False
            )
            start = Act(f"{run.plan}-go", CommandKind.START, "", run.plan, run.session, seen_ns)
            may_be_started = True
            await drone.act(start, by_person=False)
        except (RunError, InputError) as err:
            is_same = drone.welcome is not None and drone.welcome.session == run.session
            state = RunState.WAITING if is_same or not may_be_started else RunState.UNKNOWN
            await self._refused(schedule, run, state, str(err).removeprefix("refused: "))
            return
        except FlightdError as err:
            _LOG.warning("schedule %s: %s does not answer: %s", schedule.kept.name, drone.name, err)
            return
        await self._write(replace(run, state=RunState.STARTED, nodes=planned.nodes, cause="", why=""))
        self._write_down(schedule, run, "accepted", f"{run.day}: {', '.join(planned.nodes)}")
        await self._mark(schedule, run.plan, planned.nodes)

    async def _mark(self, schedule: Schedule, plan: str, nodes: Sequence[str]) -> None:
        """As handed over, where that is a mission."""
        count = schedule.kept.count
        if isinstance(count, CountMission):
            flown = (count.mission, plan, nodes, self._clock.utc_ns())
            await self._threads.run(self._missions.handed_over, *flown)

    async def _note_left(self, schedule: Schedule, mission: str, run: Run) -> None:
        """Of a mission that the fleet has: its drones fly by other plans, and tell nothing of this one.  What
        is asked for anew once nothing was left is none of it."""
        drone = self._drones.get(run.drone)
        fleet = None if drone is None or run.session else self._fleet_of(drone)
        if fleet is None or not fleet.knows_run(run.plan):
            return
        known = self._left.get(schedule.id) or await self._left_before(mission)
        left = known if known == (run.plan, ()) else (run.plan, fleet.left_of(run.nodes))
        if left != known:
            await self._threads.run(self._missions.left, *left)
        self._left[schedule.id] = left

    async def _left_before(self, mission: str) -> tuple[str, tuple[str, ...]]:
        """As the station before wrote it down; of a mission that is kept no more, nothing."""
        try:
            kept = await self._threads.run(self._missions.mission, mission)
        except InputError:
            return "", ()
        return kept.plan, kept.remaining

    async def _refused(self, schedule: Schedule, run: Run, state: RunState, why: str) -> None:
        """The drone does not take it: that may change, unless another flightd answered than may have started
        it."""
        self._rest(schedule)
        await self._write(replace(run, state=state, cause=Cause.REFUSED.value, why=why))
        self._write_down(schedule, run, "refused", why)

    def _rest(self, schedule: Schedule) -> None:
        now_s = asyncio.get_running_loop().time()
        self._rests = {of: until_s for of, until_s in self._rests.items() if until_s > now_s}
        self._rests[schedule.id] = now_s + self._clock.rest_s

    async def _wait(self, schedule: Schedule, due: Occurrence, known: Run | None, why: Objection) -> None:
        if known is not None and (known.state, known.cause, known.why) == (
            RunState.WAITING,
            why.cause,
            why.why,
        ):
            return
        await self._write(_not_ordered(schedule, due, RunState.WAITING, why))

    async def _miss(self, schedule: Schedule, missed: Occurrence, known: Run | None) -> None:
        """Tell once that a run's time is over, with what kept it."""
        kept = known is not None and known.state is RunState.WAITING
        why = Objection(Cause(known.cause), known.why) if known is not None and kept else OFF
        await self._tell_missed(schedule, _not_ordered(schedule, missed, RunState.MISSED, why))

    async def _end_waiting(self, schedule: Schedule, runs: Iterable[Run], changed: Objection) -> None:
        """Tell of what is due no more, and waits in the book: the schedule was `changed` since, or what kept
        it is long ago."""
        for run in runs:
            if run.state is RunState.WAITING and run.due_ns <= self._clock.utc_ns():
                is_old = schedule.since_ns <= run.due_ns and schedule.kept.enabled
                cause, why = (run.cause, run.why) if is_old else (changed.cause.value, changed.why)
                await self._tell_missed(schedule, replace(run, state=RunState.MISSED, cause=cause, why=why))

    async def _tell_missed(self, schedule: Schedule, run: Run) -> None:
        await self._write(run)
        self._write_down(schedule, run, "missed", f"{run.day}: {run.why}")

    async def _worth(self, schedule: Schedule, nodes: Sequence[str]) -> dict[str, Worth]:
        """What a person chose goes before what is only the oldest, which is worth less from one to the next.
        FlightdError where what they are worth cannot be known."""
        match schedule.kept.count:
            case CountByValue():
                worth = worth_of(await self._facts.of(schedule.kept.site))
                return {node: worth.get(node, UNKNOWN) for node in nodes}
            case CountAll():
                first = await self._urgent(schedule)
                old = {node: Worth(Value.OLD, float(len(nodes) - i)) for i, node in enumerate(nodes)}
                return {node: first.get(node, its) for node, its in old.items()}
            case _:
                return dict.fromkeys(nodes, Worth(Value.ASKED))

    def _objection(self, schedule: Schedule, drone: ScheduledDrone) -> Objection | None:
        fleet = self._fleet_of(drone)
        if fleet is not None:
            return fleet_objection(schedule.kept.site, fleet, self._drones)
        return objection(
            schedule.kept.site,
            drone.welcome,
            drone.heard,
            by_manager=self._managers is not None and self._managers.flies(drone.name),
            since_person_s=asyncio.get_running_loop().time() - drone.by_person_at_s,
        )

    async def _write(self, run: Run) -> None:
        await self._threads.run(self._book.write, replace(run, changed_ns=self._clock.utc_ns()))

    def _write_down(self, schedule: Schedule, run: Run, outcome: str, text: str) -> None:
        who = Identity(f"schedule {schedule.kept.name}", Role.OPERATOR, "schedule")
        self._audit.write_down(
            who, "", "start", schedule.kept.drone, outcome=outcome, text=text[:_MOST_WORDS], id=run.plan
        )


def _not_ordered(schedule: Schedule, due: Occurrence, state: RunState, why: Objection) -> Run:
    return Run(
        schedule=schedule.id,
        day=due.day,
        state=state,
        due_ns=_ns(due.at),
        changed_ns=0,
        drone=schedule.kept.drone,
        cause=why.cause.value,
        why=why.why,
    )


def _ns(at: datetime) -> int:
    return round(at.timestamp()) * 1_000_000_000
