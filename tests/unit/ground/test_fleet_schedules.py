"""Schedules of a drone that the station's fleet flies: what is due is work of the whole fleet, given once."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import msgspec
import pytest

from flightd.adapters.ground_link.floor_status import floor_status
from flightd.adapters.ground_link.messages.answers import Welcome
from flightd.adapters.ground_link.messages.base import Role
from flightd.adapters.ground_link.messages.counts import NodeCount
from flightd.adapters.ground_link.messages.published import StatusReport
from flightd.core.errors import UnavailableError
from flightd.core.types import Phase
from flightd.fleet.traffic.valued_work import PlaceFacts
from flightd.fleet.traffic.work_queue import HOURS_UNKNOWN, Value
from flightd.ground.fleet.fleet_memory import TOO_OLD, FleetMemory
from flightd.ground.missions.mission_book import Mission, MissionBook
from flightd.ground.schedules.kept import CountAisles, CountByValue, CountMission, Kept, QuietHours
from flightd.ground.schedules.night_shift import NightShift, StationClock
from flightd.ground.schedules.schedule_book import Run, RunState, ScheduleBook
from tests.rigs.paper_drones import PaperDrone
from tests.rigs.paper_fleet import PaperFleet, fly, until

NIGHTLY = Kept("hall", "Aisle A", "a", CountAisles(("A",)), "22:00", "UTC")
AISLE = {"A1", "A2", "A3", "A4", "A5"}
FACTS = (
    *(PlaceFacts(node, 60.0) for node in ("A1", "A2", "A4", "A5", "B1", "B2", "B4", "B5")),
    PlaceFacts("A3", 9e5),
    PlaceFacts("B3", 5.0, contradicted=True),
)
DUE = datetime(2026, 3, 1, 22, 0, tzinfo=UTC)


@dataclass
class Link:
    """What of `DroneLink` a schedule of a fleet's drone needs."""

    drone: PaperDrone
    attends_run: bool = False
    by_person_at_s: float = -1e9

    @property
    def name(self) -> str:
        return self.drone.name

    @property
    def welcome(self) -> Welcome:
        floor = floor_status(self.drone.site)
        return Welcome(version=1, request="", flightd="", session="", role=Role.OPERATOR, client="",
                       picture_fps=0.0, floor=floor, events=())  # fmt: skip

    @property
    def heard(self) -> StatusReport | None:
        return self.drone.status if self.drone.heard else None

    async def act(self, *_: Any, **__: Any) -> Any:
        pytest.fail("the fleet flies it")

    plan_flight = act


class Station:
    """A night shift beside a fleet; each station that follows has the same folder."""

    def __init__(self, fleet: PaperFleet, folder: Path, kept: Kept = NIGHTLY) -> None:
        self.fleet, self.folder, self.now = fleet, folder, DUE - timedelta(minutes=1)
        self.book = ScheduleBook(folder)
        self.book.keep("schedule-1", kept, self.utc_ns())
        self.lines: list[str] = []
        self.knows = True
        """What is known of the places can be read."""
        self.begin()

    def begin(self) -> None:
        """Another station."""
        links = {name: Link(drone) for name, drone in self.fleet.drones.items()}
        clock, own = StationClock(self.utc_ns, rest_s=0.0), self.fleet.own
        missions = MissionBook(self.folder)
        self.shift = NightShift(self.book, missions, None, self, links, self, None, clock, own)  # type: ignore[arg-type]

    async def of(self, site: str) -> tuple[PlaceFacts, ...]:
        """What is known of the places."""
        assert site == "hall"
        if not self.knows:
            raise UnavailableError("the ground store is locked")
        return FACTS

    def utc_ns(self) -> int:
        return int(self.now.timestamp()) * 10**9

    def write_down(self, who: Any, address: str, act: str, target: str, **outcome: str) -> None:
        del who, address, act, target
        self.lines.append(outcome["outcome"])

    async def look(self, at: datetime = DUE) -> Run | None:
        self.now = at
        await self.shift.step()
        runs = self.book.runs("schedule-1")
        return runs[0] if runs else None


def night(
    tmp_path: Path,
    go: Callable[[Station], Coroutine[Any, Any, None]],
    kept: Kept = NIGHTLY,
    *,
    counts: bool = False,
) -> None:
    async def with_station(fleet: PaperFleet) -> None:
        await go(Station(fleet, tmp_path, kept))

    fly(with_station, "ab", memory=FleetMemory(tmp_path), unattended=True, counts=counts)


def open_or_given(fleet: PaperFleet) -> set[str]:
    return {*fleet.state["open"], *fleet.state["given"]}


def test_what_is_due_is_flown_by_whichever_drones_have_the_time_and_once(tmp_path: Path) -> None:
    async def go(station: Station) -> None:
        run = await station.look()
        assert run is not None
        assert run.state is RunState.ORDERED, "nothing is written down yet"
        await until(lambda: bool(station.fleet.state["given"]), 30)
        run = await station.look()
        assert run is not None
        assert (run.state, {*run.nodes}, station.lines) == (
            RunState.STARTED,
            AISLE,
            ["accepted"],
        )
        await until(lambda: {*station.fleet.state["done"]} == AISLE, 200)
        await station.look(DUE + timedelta(minutes=30))
        await asyncio.sleep(5.0)
        assert open_or_given(station.fleet) == set()

    night(tmp_path, go)


@pytest.mark.parametrize("written", [False, True])
def test_a_station_that_is_killed_as_it_gives_it_gives_it_once(tmp_path: Path, written: bool) -> None:
    async def go(station: Station) -> None:
        fleet = station.fleet
        await station.look()
        if written:
            await until(lambda: len(fleet.state["done"]) == 1, 100)
        await fleet.kill()
        await asyncio.sleep(5.0)
        fleet.start_again()
        station.begin()
        await until(lambda: fleet.state["flies"], 60)
        done = {*fleet.state["done"]}
        assert bool(done) is written
        for minute in range(5):
            run = await station.look(DUE + timedelta(minutes=minute))
            await asyncio.sleep(1.0)
        assert run is not None
        assert run.state is RunState.STARTED
        assert not done & open_or_given(fleet), "what is done is not asked for again"
        await until(lambda: {*fleet.state["done"]} == AISLE, 300)

    night(tmp_path, go)


def test_what_is_given_and_not_written_down_yet_is_given_once_whatever_is_known_of_it(tmp_path: Path) -> None:
    async def go(station: Station) -> None:
        fleet = station.fleet
        fleet.deciding = asyncio.Event()  # nothing is written down before it is decided
        run = await station.look()
        assert run is not None
        station.knows = False
        for minute in range(3):
            await station.look(DUE + timedelta(minutes=minute))
        assert not fleet.own.knows_run(run.plan)
        fleet.deciding.set()
        fleet.deciding = None
        await until(lambda: fleet.own.knows_run(run.plan), 30)
        station.knows = True
        again = await station.look(DUE + timedelta(minutes=5))
        assert again is not None
        assert (again.plan, again.state, station.lines) == (run.plan, RunState.STARTED, ["accepted"])
        assert open_or_given(fleet) | {*fleet.state["done"]} == {*run.nodes}

    night(tmp_path, go, Kept("hall", "Most valuable", "a", CountByValue(nodes=2), "22:00", "UTC"))


def test_what_keeps_all_drones_on_the_ground_is_told_and_the_run_is_caught_up(tmp_path: Path) -> None:
    async def go(station: Station) -> None:
        for drone in station.fleet.drones.values():
            drone.obstacles = ("the aisle is not closed",)
        run = await station.look()
        assert run is not None
        assert (run.state, run.cause, run.why) == (RunState.WAITING, "not_ready", "the aisle is not closed")
        assert open_or_given(station.fleet) == set()
        station.fleet.drones["b"].obstacles = ()
        await station.look(DUE + timedelta(minutes=20))
        await until(lambda: {*station.fleet.state["given"].values()} == {"b"}, 100)
        run = await station.look(DUE + timedelta(minutes=21))
        assert run is not None
        assert run.state is RunState.STARTED

    night(tmp_path, go)


@pytest.mark.parametrize(
    ("silent", "taken", "cause", "why"),
    [
        ("ab", "", "unreachable", "the drone is not heard"),
        ("ab", "a", "unreachable", "the drone is not heard"),
        ("a", "b", "person", "a person has it"),
        ("", "ab", "person", "a person has it"),
    ],
)
def test_why_no_drone_would_fly_is_told(
    tmp_path: Path, silent: str, taken: str, cause: str, why: str
) -> None:
    async def go(station: Station) -> None:
        fleet = station.fleet
        for name in taken:
            fleet.own.hand_over(name, to_manager=False)
        for name in silent:
            fleet.drones[name].heard = False
        await asyncio.sleep(5.0)
        run = await station.look()
        assert run is not None
        assert (run.state, run.cause, run.why) == (RunState.WAITING, cause, why)

    night(tmp_path, go)


def test_in_quiet_hours_it_waits_and_is_caught_up(tmp_path: Path) -> None:
    quiet = Kept("hall", "A", "a", CountAisles(("A",)), "22:00", "UTC", quiet=(QuietHours("21:30", "22:30"),))

    async def go(station: Station) -> None:
        run = await station.look()
        assert run is not None
        assert (run.state, run.cause) == (RunState.WAITING, "quiet")
        await station.look(DUE + timedelta(minutes=31))
        await until(lambda: bool(station.fleet.state["given"]), 30)

    night(tmp_path, go, quiet)


HELD = Kept("hall", "A", "a", CountAisles(("A",)), "22:00", "UTC", quiet=(QuietHours("22:10", "23:00"),))


async def given_to_nobody(station: Station) -> Run:
    """What is due is handed to the fleet, and no drone has the battery for it."""
    for drone in station.fleet.drones.values():
        drone.left_s = 30.0
    run = await station.look()
    assert run is not None
    plan = run.plan
    await until(lambda: station.fleet.own.knows_run(plan), 30)
    run = await station.look()
    assert run is not None
    assert (run.state, open_or_given(station.fleet)) == (RunState.STARTED, AISLE)
    return run


async def charged(station: Station) -> None:
    """Whoever may fly now has been given something."""
    for drone in station.fleet.drones.values():
        drone.left_s = 900.0
    await asyncio.sleep(20.0)


def test_quiet_hours_keep_drones_from_leaving_for_what_was_handed_over_before(tmp_path: Path) -> None:
    async def go(station: Station) -> None:
        fleet = station.fleet
        await given_to_nobody(station)
        await station.look(DUE + timedelta(minutes=10))
        await charged(station)
        assert fleet.state["not_done"] == dict.fromkeys(AISLE, "these are quiet hours")
        assert {drone.phase for drone in fleet.drones.values()} == {Phase.PREFLIGHT}
        fleet.own.ask(["A3"])
        await until(lambda: {*fleet.state["given"]} == {"A3"}, 30)
        await station.look(DUE + timedelta(minutes=60))
        await until(lambda: {*fleet.state["given"], *fleet.state["done"]} >= {"A2", "A4"}, 100)

    night(tmp_path, go, HELD)


def test_who_asks_as_a_station_begins_lets_nobody_leave_for_a_run_whose_hours_are_not_looked_at_yet(
    tmp_path: Path,
) -> None:
    async def go(station: Station) -> None:
        fleet = station.fleet
        await given_to_nobody(station)
        await fleet.kill()
        fleet.start_again()
        await until(lambda: fleet.state["flies"], 60)
        await charged(station)
        assert (fleet.state["given"], fleet.state["not_done"]) == ({}, {})
        fleet.own.ask(["B3"])
        assert fleet.state["not_done"] == dict.fromkeys(AISLE, HOURS_UNKNOWN)
        await until(lambda: {*fleet.state["given"]} == {"B3"}, 30)
        station.begin()
        await station.look(DUE + timedelta(minutes=10))
        assert fleet.state["not_done"] == dict.fromkeys(AISLE, "these are quiet hours")
        await until(lambda: fleet.state["done"] == ["B3"], 100)
        await station.look(DUE + timedelta(minutes=60))
        await until(lambda: {*fleet.state["given"]} >= {"A2", "A4"}, 100)

    night(tmp_path, go, HELD)


@pytest.mark.parametrize(
    ("minutes", "change", "why"),
    [
        (121, {}, "its time is over"),
        (121, {"quiet": (QuietHours("23:30", "06:00"),)}, "these are quiet hours"),
        (5, {"enabled": False}, "the schedule was suspended"),
        (5, None, "there is no such schedule any more"),
    ],
)
def test_what_nobody_leaves_for_in_its_time_is_told_as_not_done(
    tmp_path: Path, minutes: int, change: dict[str, Any] | None, why: str
) -> None:
    async def go(station: Station) -> None:
        await given_to_nobody(station)
        if change is None:
            station.book.delete("schedule-1")
        else:
            station.book.keep("schedule-1", msgspec.structs.replace(NIGHTLY, **change), station.utc_ns())
        await station.look(DUE + timedelta(minutes=minutes))
        await charged(station)
        assert station.fleet.state["not_done"] == dict.fromkeys(AISLE, why)
        assert open_or_given(station.fleet) == set()
        assert {drone.phase for drone in station.fleet.drones.values()} == {Phase.PREFLIGHT}

    night(tmp_path, go)


def test_a_run_that_was_begun_in_its_time_goes_on_after_it(tmp_path: Path) -> None:
    async def go(station: Station) -> None:
        fleet = station.fleet
        fleet.drones["b"].left_s = 30.0
        fleet.drones["a"].left_s = 90.0
        await station.look()
        await until(lambda: bool(fleet.state["given"]), 30)
        await station.look(DUE + timedelta(minutes=121))
        assert fleet.state["open"], "one tour is not enough"
        await charged(station)
        await until(lambda: {*fleet.state["done"]} == AISLE, 300)

    night(tmp_path, go)


@pytest.mark.parametrize(("minutes", "why"), [(60, ""), (121, TOO_OLD)])
def test_the_work_of_a_run_outlives_a_station_until_its_time_is_over(
    tmp_path: Path, minutes: int, why: str
) -> None:
    now_s = DUE.timestamp()

    async def go(fleet: PaperFleet) -> None:
        nonlocal now_s
        station = Station(fleet, tmp_path)
        await given_to_nobody(station)
        await fleet.kill()
        now_s += minutes * 60
        fleet.start_again()
        await until(lambda: fleet.state["flies"], 60)
        station.begin()
        await station.look(DUE + timedelta(minutes=minutes))
        assert fleet.state["not_done"] == (dict.fromkeys(AISLE, why) if why else {})
        await charged(station)
        assert bool(open_or_given(fleet)) is (not why)

    fly(go, "ab", memory=FleetMemory(tmp_path, lambda: now_s), unattended=True)


def test_the_levels_of_a_schedule_are_counted_where_there_are_such(tmp_path: Path) -> None:
    counted: list[NodeCount] = []

    async def go(station: Station) -> None:
        for drone in station.fleet.drones.values():
            for name in ("act", "plan_flight"):
                note_counts(drone, name, counted)
        run = await station.look()
        assert run is not None
        assert run.levels == (1,)
        await until(lambda: {*station.fleet.state["done"]} == AISLE, 300)

    night(tmp_path, go, Kept("hall", "A", "a", CountAisles(("A",), (1,)), "22:00", "UTC"), counts=True)
    assert {one.levels for one in counted} == {(1,)}
    assert {one.node for one in counted} <= AISLE


def note_counts(drone: PaperDrone, name: str, counted: list[NodeCount]) -> None:
    """Note what it is told to count."""
    told = getattr(drone, name)

    async def noted(*of: Any, **how: Any) -> Any:
        counted.extend(how.get("counts") or ())
        return await told(*of, **how)

    setattr(drone, name, noted)


def test_a_kept_mission_knows_when_the_fleet_had_it_and_what_is_left(tmp_path: Path) -> None:
    missions = MissionBook(tmp_path)
    missions.keep(Mission("mission-1", "hall", "Two", ("B3", "A3")))

    async def go(station: Station) -> None:
        fleet = station.fleet
        fleet.own.hand_over("b", to_manager=False)  # a flies to one after the other
        await asyncio.sleep(5.0)
        run = await station.look()
        assert run is not None
        assert missions.mission("mission-1").flown_ns == 0, "it is not written down as given yet"
        await until(lambda: fleet.own.knows_run(run.plan), 30)
        await station.look()
        told = missions.mission("mission-1")
        assert (told.plan, told.flown_ns, told.remaining) == (run.plan, station.utc_ns(), ("B3", "A3"))
        await until(lambda: len(fleet.state["done"]) == 1, 200)
        (done,) = fleet.state["done"]
        fleet.deciding = asyncio.Event()  # nothing more is done while it is looked at
        await station.look()
        assert missions.mission("mission-1").remaining == tuple({"B3", "A3"} - {done})
        fleet.deciding.set()
        fleet.deciding = None
        await until(lambda: len(fleet.state["done"]) == 2, 200)
        await station.look()
        assert missions.mission("mission-1").remaining == ()
        fleet.own.ask(["B3"])
        await station.look(DUE + timedelta(hours=1))
        assert missions.mission("mission-1").remaining == (), "what is asked for anew is none of the run's"
        station.begin()
        await station.look(DUE + timedelta(hours=1))
        assert "B3" in open_or_given(fleet)
        assert missions.mission("mission-1").remaining == (), "another station knows that, too"

    night(tmp_path, go, Kept("hall", "Two", "a", CountMission("mission-1"), "22:00", "UTC"))


def test_what_is_worth_most_is_given_with_its_value_and_what_waits_or_is_closed_is_left_out(
    tmp_path: Path,
) -> None:
    async def go(station: Station) -> None:
        fleet = station.fleet
        for drone in fleet.drones.values():
            drone.left_s = 30.0  # nobody flies

        async def given(days: int) -> Run:
            run = await station.look(DUE + timedelta(days=days))
            assert run is not None
            if run.nodes:
                await until(lambda: fleet.own.knows_run(run.plan), 30)
                await station.look(DUE + timedelta(days=days))
            return run

        assert (await given(0)).nodes == ("B3", "A3")
        kept = FleetMemory(tmp_path).read()
        assert kept is not None
        values = {work.node: work.value for work in kept[1].work.work}
        assert values == {"B3": Value.CONTRADICTED, "A3": Value.OLD}
        await fleet.own.close("ann", aisle="A")
        later = [(await given(days)).nodes for days in (1, 2, 3)]
        assert later == [("A1", "B1"), ("B2", "B4"), ("B5",)], "what leads to a pad is open"
        run = await given(4)
        assert (run.state, run.cause) == (RunState.WAITING, "work")
        assert run.why == "all nodes wait already, or are closed"

    night(
        tmp_path,
        go,
        Kept("hall", "Most valuable", "a", CountByValue(nodes=2), "22:00", "UTC", late_minutes=8640),
    )


@pytest.mark.parametrize("change", [datetime(2026, 3, 29, tzinfo=UTC), datetime(2026, 10, 25, tzinfo=UTC)])
def test_over_a_change_of_the_clock_each_night_is_given_once(tmp_path: Path, change: datetime) -> None:
    kept = Kept("hall", "A", "a", CountAisles(("A",)), "02:30", "Europe/Berlin")

    async def go(station: Station) -> None:
        station.now = change - timedelta(days=1, hours=12)
        station.book.keep("schedule-1", kept, station.utc_ns())
        for half_hour in range(48 * 3):
            await station.look(change - timedelta(days=1, hours=12) + timedelta(minutes=30 * half_hour))
            await asyncio.sleep(1.0)
            for drone in station.fleet.drones.values():
                if drone.phase is Phase.DONE:
                    drone.begin_anew()
        runs = station.book.runs("schedule-1")
        assert Counter(run.state for run in runs) == {RunState.STARTED: 3}
        assert len({run.day for run in runs}) == 3
        assert station.lines == ["accepted"] * 3

    night(tmp_path, go)
