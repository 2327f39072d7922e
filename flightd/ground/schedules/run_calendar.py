"""The runs of schedules as a calendar: those that were, as the book has them, and those to come."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import date, datetime, timedelta
from typing import Any

from flightd.core.errors import InputError
from flightd.core.utc_time import utc_time
from flightd.fleet.schedule.rule import Occurrence, Rule
from flightd.ground.schedules.kept import Schedule
from flightd.ground.schedules.schedule_book import Run

MOST_DAYS = 31
_DUE, _MISSED = "due", "missed"


def read_days(first: str, days: str) -> tuple[date, int]:
    """The first day and how many.  InputError for what is none."""
    try:
        day, number = date.fromisoformat(first), int(days)
        day + timedelta(days=MOST_DAYS)
    except (ValueError, OverflowError):
        raise InputError("a calendar is of a first day as 2026-11-26 and a number of days") from None
    if not 1 <= number <= MOST_DAYS:
        raise InputError(f"a calendar has 1 to {MOST_DAYS} days")
    return day, number


def calendar_of(
    schedule: Schedule, runs: Sequence[Run], first: date, days: int, now: datetime
) -> list[dict[str, Any]]:
    """Its runs of so many days by its own local time, `runs` being those in the book.  InputError where this
    machine does not know its zone any more."""
    rule = schedule.rule
    last = first + timedelta(days=days - 1)
    known = {run.day: run for run in runs if first <= run.day <= last}
    told = [_told(schedule, rule, run.day, utc_time(run.due_ns), run) for run in known.values()]
    told += [
        _told(schedule, rule, one.day, one.at, None, _MISSED if one.until <= now else _DUE)
        for one in _unknown(schedule, rule, first, days, now)
        if one.day not in known
    ]
    return sorted(told, key=lambda one: (one["day"], one["at"]))


def _unknown(schedule: Schedule, rule: Rule, first: date, days: int, now: datetime) -> Iterator[Occurrence]:
    """What comes by the rule, but for what was before the schedule was kept; of one that is suspended nothing
    is missed."""
    since = utc_time(schedule.since_ns)
    for one in rule.of_days(first, days):
        if one.at >= since and (schedule.kept.enabled or one.at >= now):
            yield one


def _told(
    schedule: Schedule, rule: Rule, day: date, at: datetime, run: Run | None, state: str = ""
) -> dict[str, Any]:
    kept = schedule.kept
    return {
        "schedule": schedule.id,
        "site": kept.site,
        "name": kept.name,
        "drone": kept.drone if run is None else run.drone,
        "zone": kept.zone,
        "day": day,
        "clock": rule.clock(at).strftime("%H:%M"),
        "at": at,
        "state": (state if kept.enabled else "suspended") if run is None else run.state,
        "quiet": rule.is_quiet(at),
        "cause": "" if run is None else run.cause,
        "why": "" if run is None else run.why,
        "plan": "" if run is None else run.plan,
    }
