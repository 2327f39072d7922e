"""Who starts what is due: what speaks against a start, and that each run is ordered once, whatever breaks."""

from __future__ import annotations

import math
import sqlite3
from datetime import date, timedelta
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.adapters.ground_link.messages.answers import Welcome
from flightd.adapters.ground_link.messages.base import Role
from flightd.core.errors import InputError
from flightd.core.types import CommandKind, Phase
from flightd.ground.schedules.kept import CountAisles, Kept
from flightd.ground.schedules.schedule_book import FILE, RunState
from flightd.ground.schedules.start_rules import Cause, objection
from tests.unit.ground.night_shift_rig import FLOOR, NIGHTLY, READY, T0, WELCOME, Station


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
