"""The calendar of schedules: runs to come by their own clocks, also where these change, and what was."""

from __future__ import annotations

from datetime import UTC, date, datetime
from typing import Any

import pytest

from flightd.core.errors import InputError
from flightd.ground.schedules.kept import CountAisles, Kept, QuietHours, Schedule
from flightd.ground.schedules.run_calendar import MOST_DAYS, calendar_of, read_days
from flightd.ground.schedules.schedule_book import Run, RunState

SATURDAY = date(2026, 3, 28)
"""The clocks of Berlin go forward in the night to Sunday, at two."""


def ns(text: str) -> int:
    return int(datetime.fromisoformat(text).replace(tzinfo=UTC).timestamp()) * 10**9


def schedule(at: str = "02:30", since: str = "2026-03-01 00:00", **other: Any) -> Schedule:
    kept = Kept("hall", "Aisle A", "north", CountAisles(("A",)), at, "Europe/Berlin", **other)
    return Schedule("schedule-1", kept, ns(since))


def told(
    one: Schedule, *runs: Run, now: str = "2026-03-28 12:00", first: date = SATURDAY, days: int = 3
) -> list[dict[str, Any]]:
    at = datetime.fromisoformat(now).replace(tzinfo=UTC)
    return calendar_of(one, runs, first, days, at)


def states(found: list[dict[str, Any]]) -> list[tuple[int, str, str]]:
    return [(one["day"].day, one["clock"], one["state"]) for one in found]


def run(day: int, state: RunState, cause: str = "", why: str = "") -> Run:
    return Run(
        schedule="schedule-1", day=date(2026, 3, day), state=state, due_ns=ns(f"2026-03-{day} 01:30"),
        changed_ns=0, drone="south", cause=cause, why=why, plan="plan-7",
    )  # fmt: skip


def test_each_day_has_its_run_by_the_clocks_there_also_when_they_skip_its_time() -> None:
    found = told(schedule(), now="2026-03-27 12:00")
    assert states(found) == [(28, "02:30", "due"), (29, "03:00", "due"), (30, "02:30", "due")]
    assert [one["at"].hour for one in found] == [1, 1, 0]  # UTC
    autumn = told(schedule(), now="2026-10-24 00:00", first=date(2026, 10, 24))
    assert states(autumn) == [(24, "02:30", "due"), (25, "02:30", "due"), (26, "02:30", "due")]
    assert [one["at"].hour for one in autumn] == [0, 0, 1]


def test_what_was_stands_as_the_book_has_it_and_what_was_before_the_schedule_was_kept_does_not() -> None:
    quiet = run(29, RunState.WAITING, "quiet", "these are quiet hours")
    found = told(schedule(), run(28, RunState.STARTED), quiet, now="2026-03-29 02:00")
    assert states(found) == [(28, "02:30", "started"), (29, "03:30", "waiting"), (30, "02:30", "due")]
    assert (found[0]["drone"], found[0]["plan"]) == ("south", "plan-7")
    assert (found[1]["cause"], found[1]["why"]) == ("quiet", "these are quiet hours")
    found = told(schedule(since="2026-03-29 12:00"), now="2026-03-29 13:00")
    assert states(found) == [(30, "02:30", "due")]


def test_what_nobody_wrote_down_was_missed_once_its_time_is_over() -> None:
    assert states(told(schedule(), now="2026-03-28 02:00"))[0] == (28, "02:30", "due")
    assert states(told(schedule(), now="2026-03-28 12:00"))[0] == (28, "02:30", "missed")


def test_of_a_schedule_that_is_suspended_nothing_was_missed() -> None:
    found = told(schedule(enabled=False), run(28, RunState.MISSED), now="2026-03-29 12:00")
    assert states(found) == [(28, "02:30", "missed"), (30, "02:30", "suspended")]


def test_quiet_hours_are_told_ahead() -> None:
    found = told(schedule("22:00", quiet=(QuietHours("21:00", "23:00"),), weekdays=(6,)))
    assert [(one["day"].day, one["quiet"]) for one in found] == [(28, True)]
    assert not told(schedule("22:00"))[0]["quiet"]


@pytest.mark.parametrize(
    ("first", "days"),
    [("", "7"), ("today", "7"), ("9999-12-30", "7"), ("2026-03-28", "x"), ("2026-03-28", "0"),
     ("2026-03-28", str(MOST_DAYS + 1))],
)  # fmt: skip
def test_what_is_no_calendar_is_refused_in_one_line(first: str, days: str) -> None:
    with pytest.raises(InputError, match=r"^a calendar (is of|has)"):
        read_days(first, days)


def test_a_week_is_read() -> None:
    assert read_days("2026-03-28", "7") == (SATURDAY, 7)
