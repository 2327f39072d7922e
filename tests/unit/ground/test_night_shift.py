"""Who starts what is due: what speaks against a start, and that each run is ordered once, whatever breaks."""

from __future__ import annotations

import math
import sqlite3
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, date, datetime, timedelta
from itertools import count
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.adapters.ground_link.floor_status import floor_status
from flightd.adapters.ground_link.messages.answers import Accepted, Planned, Welcome
from flightd.adapters.ground_link.messages.base import Role
from flightd.adapters.ground_link.messages.published import StatusReport
from flightd.core.errors import InputError, RunError, UnavailableError
from flightd.core.types import CommandKind, Phase
from flightd.fleet.schedule.rolling import NodeCount, run_nodes
from flightd.fleet.traffic.valued_work import PlaceFacts
from flightd.ground.access.roles import Identity
from flightd.ground.ground_store.open_store import opened_store
from flightd.ground.ground_store.store import GroundStore
from flightd.ground.messages import Act
from flightd.ground.missions.mission_book import Mission, MissionBook
from flightd.ground.schedules.kept import CountAisles, CountAll, CountByValue, CountMission, Kept
from flightd.ground.schedules.night_shift import NightShift, StationClock
from flightd.ground.schedules.schedule_book import FILE, Run, RunState, ScheduleBook
from flightd.ground.schedules.start_rules import Cause, objection
from flightd.site.site_file import load_site
from tests.rigs.event_loops import real
from tests.unit.ground.request_handler_rig import report

SITE = load_site(Path(__file__).parents[3] / "configs" / "site-demo.toml")
FLOOR = floor_status(replace(SITE, unattended_start=True))
READY = msgspec.structs.replace(
    report(Phase.PREFLIGHT), session="s-0", possible=(CommandKind.PLAN, CommandKind.START)
)
WELCOME = Welcome(
    request="",
    flightd="",
    session="s-0",
    role=Role.OPERATOR,
    client="",
    picture_fps=0.0,
    floor=FLOOR,
    events=(),
)
NIGHTLY = Kept(
    site="demo",
    name="Nightly",
    drone="demo",
    count=CountAisles(("A",)),
    at="22:00",
    zone="UTC",
    late_minutes=90,
)
T0 = datetime(2026, 3, 1, 12, tzinfo=UTC)


class Drone:
    """Stands there and does each order once, by its id; its answers may be lost, it may refuse, and its
    flightd may be started anew."""

    def __init__(self, book: ScheduleBook) -> None:
        self.name = "demo"
        self.attends_run = False
        self.by_person_at_s = -math.inf
        self.mode = "well"
        self.starts: list[date] = []
        self._book = book
        self._sessions = count(1)
        self._done: set[str] = set()
        self.welcome: Welcome | None = WELCOME
        self.status: StatusReport = READY

    @property
    def heard(self) -> StatusReport | None:
        return None if self.mode == "unheard" else self.status

    def begin_anew(self) -> None:
        session = f"s-{next(self._sessions)}"
        self._done.clear()
        self.welcome = msgspec.structs.replace(WELCOME, session=session)
        self.status = msgspec.structs.replace(READY, session=session)

    async def plan_flight(
        self, nodes: Sequence[str], levels: Sequence[int], order_id: str = "", *, best_order: bool = False,
        dry: bool = False, session: str = "", seen_ns: int = 0, by_person: bool = True,
    ) -> Planned:  # fmt: skip
        assert (best_order, dry, by_person) == (False, False, False)
        del seen_ns
        if self._is_new(order_id, session):
            self.status = msgspec.structs.replace(self.status, plan=order_id)
        self._answer()
        return Planned(
            request="", nodes=tuple(nodes), levels=tuple(levels), way=(), places=0, way_m=0.0, seconds=0.0,
            batteries=1, charge=1.0, battery_s=1.0,
        )  # fmt: skip

    async def act(self, act: Act, *, by_person: bool = True) -> Accepted:
        assert (act.command, by_person) == (CommandKind.START, False)
        if self._is_new(act.id, act.session):
            runs = self._book.runs("schedule-1")
            (run,) = [one for one in runs if (one.plan, one.state) == (act.plan, RunState.ORDERED)]
            self.starts.append(run.day)
            self.status = msgspec.structs.replace(self.status, phase=Phase.FOLLOW)
        self._answer()
        return Accepted(request="")

    def _is_new(self, order_id: str, session: str) -> bool:
        if self.mode == "lost before":
            raise UnavailableError("no answer")
        if self.mode in {"anew at its start", "anew"} and (self.mode == "anew" or order_id.endswith("-go")):
            self.begin_anew()
        if session != self.status.session:
            raise RunError("refused: flightd was started anew")
        if order_id in self._done:
            return False
        if self.mode == "refuses":
            raise RunError("refused: not now")
        self._done.add(order_id)
        return True

    def _answer(self) -> None:
        if self.mode == "lost after":
            raise UnavailableError("no answer")


class Facts:
    """What is known of places; without any there is no ground store."""

    def __init__(self, *places: PlaceFacts) -> None:
        self._places = places
        self.asked = 0

    async def of(self, site: str) -> Sequence[PlaceFacts]:
        assert site == "demo"
        self.asked += 1
        if not self._places:
            raise InputError("there is no ground store")
        return self._places


class Station:
    """A night shift over a file, with a clock that a test sets."""

    def __init__(
        self,
        folder: Path,
        kept: Kept = NIGHTLY,
        rest_s: float = 30.0,
        facts: Facts | None = None,
        store: GroundStore | None = None,
    ) -> None:
        self.store = store
        self.rest_s = rest_s
        self.facts = facts or Facts()
        self.folder = folder
        self.now = T0
        self.book = ScheduleBook(folder)
        self.drone = Drone(self.book)
        self.lines: list[tuple[str, str]] = []
        self.book.keep("schedule-1", kept, self._ns())
        self.reboot()

    def _ns(self) -> int:
        return int(self.now.timestamp()) * 10**9

    def write_down(self, who: Identity | None, address: str, act: str, target: str, **outcome: str) -> None:
        del who, address, act, target
        self.lines.append((outcome["outcome"], outcome["text"]))

    def keep(self, kept: Kept, schedule: str = "schedule-1") -> None:
        """A schedule, as of now."""
        self.book.keep(schedule, kept, self._ns())

    def reboot(self) -> None:
        clock = StationClock(self._ns, rest_s=self.rest_s)
        drones, missions = {"demo": self.drone}, MissionBook(self.folder)
        self._shift = NightShift(self.book, missions, self.store, self.facts, drones, self, clock=clock)

    def at(self, text: str) -> Station:
        self.now = datetime.fromisoformat(f"2026-03-{text}").replace(tzinfo=UTC)
        return self

    def attends(self) -> bool:
        return self.drone.attends_run

    def look(self) -> Run | None:
        """Look at the schedules once; the newest run."""
        real(self._shift.step())
        runs = self.book.runs("schedule-1")
        return runs[0] if runs else None


@pytest.fixture
def station(tmp_path: Path) -> Station:
    return Station(tmp_path)


def test_the_station_attends_what_it_started_until_the_drone_has_landed(station: Station) -> None:
    station.at("01T21:59").look()
    assert not station.attends()
    run = station.at("01T22:00").look()
    assert run is not None
    assert (run.state, run.nodes[0], station.attends()) == (RunState.STARTED, "A1", True)
    station.at("02T01:00").look()
    assert station.attends(), "it flies on"
    station.drone.begin_anew()
    station.look()
    assert not station.attends()


def test_a_start_whose_answer_was_lost_is_asked_for_again_and_done_once(station: Station) -> None:
    station.drone.mode = "lost after"
    run = station.at("01T22:00").look()
    assert [one.state for one in station.book.runs("schedule-1")] == ["ordered"]
    station.reboot()
    station.drone.mode = "well"
    run = station.at("01T22:10").look()
    assert run is not None
    assert (run.state, station.drone.starts) == (RunState.STARTED, [date(2026, 3, 1)])


def test_where_the_drones_flightd_was_started_anew_before_it_answered_nothing_is_sent_again(
    station: Station,
) -> None:
    station.drone.mode = "lost after"
    station.at("01T22:00").look()
    station.drone.begin_anew()
    station.drone.mode = "well"
    run = station.at("01T22:10").look()
    assert run is not None
    assert (run.state, run.why) == (RunState.UNKNOWN, "its flightd was started anew before it answered")
    station.look()
    assert station.drone.starts == []


@pytest.mark.parametrize(
    ("mode", "state"), [("anew", RunState.WAITING), ("anew at its start", RunState.UNKNOWN)]
)
def test_a_flightd_that_begins_anew_in_between_is_asked_again_only_if_nobody_can_have_started_it(
    station: Station, mode: str, state: RunState
) -> None:
    station.drone.mode = mode
    run = station.at("01T22:00").look()
    assert run is not None
    assert run.state is state


def test_what_keeps_a_run_is_told_and_once_it_is_gone_the_run_is_caught_up(station: Station) -> None:
    closed = ("the aisle is not closed",)
    station.drone.status = msgspec.structs.replace(READY, obstacles=closed)
    run = station.at("01T22:00").look()
    assert run is not None
    assert (run.state, run.cause, run.why) == (RunState.WAITING, "not_ready", closed[0])
    station.drone.status = READY
    run = station.at("01T23:00").look()
    assert run is not None
    assert (run.state, run.why, station.drone.starts) == (RunState.STARTED, "", [date(2026, 3, 1)])
    station.drone.begin_anew()
    station.drone.mode = "unheard"
    station.at("02T22:30").look()
    station.at("02T23:30").look()
    assert station.lines[1:] == [("missed", "2026-03-02: the drone is not heard")]
    station.at("05T12:00").look()
    assert station.lines[2:] == [
        ("missed", f"2026-03-0{day}: the station was off, or its clock jumped") for day in (3, 4)
    ]


def test_a_drone_that_refuses_is_not_asked_at_every_look(station: Station) -> None:
    station.drone.mode = "refuses"
    run = station.at("01T22:00").look()
    assert run is not None
    assert (run.state, run.cause, run.why) == (RunState.WAITING, "refused", "not now")
    assert station.lines == [("refused", "not now")]


def test_in_quiet_hours_and_while_it_is_not_enabled_nothing_starts(tmp_path: Path) -> None:
    quiet = msgspec.json.decode(b'[{"begin": "22:00", "end": "23:00"}]', type=list[Any])
    kept = msgspec.convert({**msgspec.to_builtins(NIGHTLY), "quiet": quiet}, Kept)
    station = Station(tmp_path, kept)
    run = station.at("01T22:30").look()
    assert run is not None
    assert (run.state, run.cause, station.attends()) == (RunState.WAITING, "quiet", False)
    station.book.keep("schedule-1", msgspec.structs.replace(kept, enabled=False), 0)
    station.at("01T23:10").look()
    assert station.drone.starts == []


def waiting(station: Station) -> None:
    """Its run is due, and the drone is not ready."""
    station.drone.status = msgspec.structs.replace(READY, obstacles=("low battery",))
    run = station.at("01T22:00").look()
    assert run is not None
    assert run.state is RunState.WAITING
    station.drone.status = READY
    station.at("01T22:05")


@pytest.mark.parametrize(
    "change", [{"name": "Every night"}, {"late_minutes": 30}, {"count": CountAisles(("B",))}]
)
def test_a_run_that_waits_stays_due_where_its_schedule_is_mended(
    station: Station, change: dict[str, Any]
) -> None:
    waiting(station)
    station.keep(msgspec.structs.replace(NIGHTLY, **change))
    run = station.look()
    assert run is not None
    assert (run.state, station.drone.starts) == (RunState.STARTED, [date(2026, 3, 1)])


@pytest.mark.parametrize(
    ("change", "why", "starts_later"),
    [
        ({"at": "22:30"}, "the schedule was changed", True),
        ({"at": "21:30"}, "the schedule was changed", False),
        ({"zone": "Europe/Berlin"}, "the schedule was changed", False),
        ({"weekdays": (1,)}, "the schedule was changed", False),
        ({"enabled": False}, "the schedule was suspended", False),
    ],
)
def test_a_run_that_is_due_no_more_is_told_as_missed(
    station: Station, change: dict[str, Any], why: str, starts_later: bool
) -> None:
    waiting(station)
    station.keep(msgspec.structs.replace(NIGHTLY, **change))
    for _ in range(2):
        run = station.look()
        assert run is not None
        assert (run.state, run.cause, run.why) == (RunState.MISSED, "changed", why)
    assert station.lines == [("missed", f"2026-03-01: {why}")]
    if not msgspec.structs.replace(NIGHTLY, **change).enabled:
        station.keep(NIGHTLY)
    station.at("01T22:35").look()
    assert bool(station.drone.starts) is starts_later


def test_a_schedule_that_cannot_be_read_keeps_no_other_from_starting(
    station: Station, caplog: pytest.LogCaptureFixture
) -> None:
    station.keep(msgspec.structs.replace(NIGHTLY, name="Damaged"), "schedule-2")
    with sqlite3.connect(station.folder / FILE) as file:
        file.execute("UPDATE schedule SET kept = '{}' WHERE id = 'schedule-2'")
    run = station.at("01T22:00").look()
    assert run is not None
    assert run.state is RunState.STARTED
    assert [one.name for one in station.book.schedules()[1]] == ["Damaged"]
    (line,) = caplog.messages
    assert line.startswith("schedule Damaged: cannot be read: Object missing required field")
    station.keep(msgspec.structs.replace(NIGHTLY, name="Damaged"), "schedule-2")
    assert station.book.schedules()[1] == []


def test_a_file_that_cannot_be_written_starts_nothing(station: Station) -> None:
    (station.folder / FILE).write_bytes(b"not a database at all, whatever it is called")
    station.now = T0 + timedelta(hours=10)
    with pytest.raises(InputError, match="not the schedules"):
        station.look()
    assert station.drone.starts == []


def test_a_run_that_cannot_be_read_is_one_clear_line_and_no_start(station: Station) -> None:
    station.at("01T22:00").look()
    with sqlite3.connect(station.folder / FILE) as file:
        file.execute("UPDATE run SET state = 'flown'")
    with pytest.raises(InputError, match=r"schedules.db: not the schedules of a ground station"):
        station.at("02T22:00").look()
    assert station.drone.starts == [date(2026, 3, 1)]


STATUS: list[tuple[dict[str, Any], Cause]] = [
    ({"phase": Phase.FOLLOW}, Cause.BUSY),
    ({"phase": Phase.ARMING}, Cause.BUSY),
    ({"plan": "of-ann"}, Cause.PERSON),
    ({"obstacles": ("low battery",)}, Cause.NOT_READY),
    ({"possible": (CommandKind.START,)}, Cause.NOT_READY),
]


@pytest.mark.parametrize(("change", "cause"), STATUS)
def test_a_drone_that_is_not_free_and_ready_is_not_started(change: dict[str, Any], cause: Cause) -> None:
    status = msgspec.structs.replace(READY, **change)
    found = objection("demo", WELCOME, status, by_manager=False, since_person_s=math.inf)
    assert found is not None
    assert found.cause is cause


def test_sites_keys_managers_and_people_come_before_the_drone() -> None:
    def found(welcome: Welcome | None = WELCOME, site: str = "demo", **who: Any) -> Cause | None:
        asked = {"by_manager": False, "since_person_s": math.inf, **who}
        against = objection(site, welcome, READY, **asked)
        return None if against is None else against.cause

    floor = msgspec.structs.replace(FLOOR, unattended_start=False)
    assert found() is None
    assert found(None) is Cause.UNREACHABLE
    assert found(site="elsewhere") is Cause.SITE
    assert found(msgspec.structs.replace(WELCOME, floor=floor)) is Cause.RULES
    assert found(msgspec.structs.replace(WELCOME, role=Role.VIEWER)) is Cause.ROLE
    assert found(by_manager=True) is Cause.MANAGER
    assert found(since_person_s=60.0) is Cause.PERSON


def test_a_kept_mission_is_flown_as_it_is_then_and_knows_what_is_left(tmp_path: Path) -> None:
    station = Station(tmp_path, msgspec.structs.replace(NIGHTLY, count=CountMission("mission-1")), rest_s=0.0)
    run = station.at("01T22:00").look()
    assert run is not None
    assert (run.cause, run.why) == ("work", "there is no such mission any more")
    MissionBook(tmp_path).keep(Mission("mission-1", "demo", "Two", ("B2", "B1"), (1,)))
    run = station.at("01T22:10").look()
    assert run is not None
    assert (run.nodes, run.levels) == (("B2", "B1"), (1,))
    assert MissionBook(tmp_path).mission("mission-1").plan == run.plan


def test_all_of_a_site_needs_the_ground_store(tmp_path: Path) -> None:
    run = Station(tmp_path, msgspec.structs.replace(NIGHTLY, count=CountAll(7))).at("01T22:00").look()
    assert run is not None
    assert (run.cause, run.why.partition(",")[0]) == ("work", "all of a site is counted by the ground store")


def test_of_all_of_a_site_what_is_asked_for_and_contradicted_goes_first(tmp_path: Path) -> None:
    facts = Facts(PlaceFacts("B6", 5.0, contradicted=True), PlaceFacts("A5", 5.0, asked=True))
    with opened_store(str(tmp_path / "counts.db")) as store:
        kept = msgspec.structs.replace(NIGHTLY, count=CountAll(7))
        run = Station(tmp_path, kept, facts=facts, store=store).at("01T22:00").look()
        assert run is not None
        assert (run.why, run.nodes) == ("", ("A5", "B6", "A1", "A2"))
        kept = msgspec.structs.replace(kept, name="Unread books")
        (tmp_path / "other").mkdir()
        other = Station(tmp_path / "other", kept, store=store).at("01T22:00").look()
        assert other is not None
        assert (other.state, other.nodes) == (RunState.STARTED, ("A1", "A2"))


@pytest.mark.parametrize(
    ("asked", "nodes"),
    [
        (CountByValue(nodes=4), ("A5", "A2", "B6", "A4")),
        (CountByValue(aisles=1), ("A5", "A2", "A1", "A3", "A4", "A6")),
        (CountByValue(), ("A5", "A2", "B6", "A1", "A3", "A4", "A6", "B1", "B2", "B3", "B4", "B5")),
    ],
)
def test_what_is_worth_most_is_counted_exceptions_first(
    tmp_path: Path, asked: CountByValue, nodes: tuple[str, ...]
) -> None:
    old = [PlaceFacts(node.id, 60.0) for node in FLOOR.nodes if node.id not in {"A2", "A4", "A5", "B6"}]
    exceptions = PlaceFacts("B6", None), PlaceFacts("A2", None), PlaceFacts("A5", 5.0, contradicted=True)
    facts = Facts(*old, *exceptions, PlaceFacts("A4", 9e5))
    station = Station(tmp_path, msgspec.structs.replace(NIGHTLY, count=asked), facts=facts)
    run = station.at("01T22:00").look()
    assert run is not None
    assert (run.state, run.nodes) == (RunState.STARTED, nodes)


def test_what_cannot_be_known_of_value_is_told_and_asked_for_again_after_a_rest(tmp_path: Path) -> None:
    station = Station(tmp_path, msgspec.structs.replace(NIGHTLY, count=CountByValue(nodes=2)))
    for _ in range(3):
        run = station.at("01T22:00").look()
        assert run is not None
        assert (run.state, run.cause, run.why) == (RunState.WAITING, "work", "there is no ground store")
    assert station.facts.asked == 1


def test_how_much_is_worth_most_is_said_once() -> None:
    both = msgspec.structs.replace(NIGHTLY, count=CountByValue(nodes=2, aisles=1))
    with pytest.raises(InputError, match="nodes and aisles are given; leave one out"):
        both.checked()


def test_a_week_of_nights_counts_all_nodes_with_exceptions_first_and_none_gets_older() -> None:
    names, now, week = [f"N{i}" for i in range(20)], T0, timedelta(days=7)
    counted: dict[str, datetime] = {}
    for night in range(21):
        following = [now + timedelta(days=ahead) for ahead in range(1, 30)]
        counts = [NodeCount(name, name == "N13", counted.get(name)) for name in names]
        taken = run_nodes(counts, now, week, following)
        assert taken[0] == "N13"
        assert len(taken) <= 4, "an even share, and the exception"
        counted |= dict.fromkeys(taken, now)
        if night >= 6:
            assert len(counted) == len(names)
            assert min(counted.values()) > now - week
        now += timedelta(days=1)


MOVES = st.lists(
    st.one_of(
        st.tuples(st.just("on"), st.integers(10, 300)),
        st.tuples(st.just("jump"), st.integers(-40 * 60, 40 * 60)),
        st.tuples(st.sampled_from(("reboot", "anew")), st.just(0)),
        st.tuples(st.sampled_from(("well", "lost before", "lost after", "refuses", "unheard")), st.just(0)),
    ),
    min_size=10,
    max_size=20,
)


@settings(max_examples=20)
@given(MOVES)
def test_no_run_is_started_twice_whatever_is_lost_rebooted_or_jumps(
    tmp_path_factory: pytest.TempPathFactory, moves: list[tuple[str, int]]
) -> None:
    station = Station(tmp_path_factory.mktemp("station"), rest_s=0.0)
    for kind, minutes in moves:
        match kind:
            case "on" | "jump":
                station.now += timedelta(minutes=minutes)
            case "reboot":
                station.reboot()
            case "anew":
                station.drone.begin_anew()
            case _:
                station.drone.mode = kind
        station.look()
    starts = station.drone.starts
    assert len(starts) == len(set(starts))
    ordered = {run.day for run in station.book.runs("schedule-1") if run.state is not RunState.MISSED}
    assert set(starts) <= ordered


def test_a_rule_that_never_starts_is_refused_when_it_is_kept() -> None:
    with pytest.raises(InputError, match="no time zone"):
        msgspec.structs.replace(NIGHTLY, zone="Europe/Nowhere").checked()
