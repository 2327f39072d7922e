"""Schedules over HTTP: kept, listed with what comes next, deleted, and what became of each run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import date, datetime
from pathlib import Path
from typing import Any

import msgspec
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from flightd.core.errors import FlightdError, InputError
from flightd.core.utc_time import utc_time
from flightd.ground.access.gate import note_act
from flightd.ground.bounded import Threads
from flightd.ground.json_http import AnswerTo, as_json, or_refused, said
from flightd.ground.schedules.kept import Kept, Schedule
from flightd.ground.schedules.run_calendar import calendar_of, read_days
from flightd.ground.schedules.schedule_book import DamagedSchedule, Run, ScheduleBook

_AT_ONCE, _MOST_WAITING = 1, 32
_MOST_BYTES = 16 << 10
_NEXT = 5


def schedule_routes(folder: Path | None, utc_ns: Callable[[], int]) -> list[BaseRoute]:
    """The answers; without a `folder` no schedules are kept."""
    desk = _Desk(None if folder is None else ScheduleBook(folder), utc_ns)
    ways: list[tuple[str, str, AnswerTo]] = [
        ("", "GET", desk.listed),
        ("/calendar", "GET", desk.calendar),
        ("/{schedule}", "PUT", desk.keep),
        ("/{schedule}", "DELETE", desk.delete),
        ("/{schedule}/runs", "GET", desk.runs),
    ]
    return [Route(f"/api/schedules{way}", or_refused(answer), methods=[verb]) for way, verb, answer in ways]


class _Desk:
    def __init__(self, book: ScheduleBook | None, utc_ns: Callable[[], int]) -> None:
        self._book = book
        self._utc_ns = utc_ns
        self._threads = Threads(_AT_ONCE, _MOST_WAITING, "too many changes to schedules wait already")

    async def listed(self, request: Request) -> Response:
        """The schedules of `?site=NAME` (of all), each with its next runs and the newest one; and what is
        wrong with those that cannot be read."""
        if self._book is None:
            return as_json({"kept": False, "schedules": [], "troubles": []})
        schedules, troubles = await self._threads.run(self._told, request.query_params.get("site", ""))
        return as_json({"kept": True, "schedules": schedules, "troubles": troubles})

    async def keep(self, request: Request) -> Response:
        """Keep a schedule, new or in place of the one with its id, from now on."""
        kept, identity = await said(request, Kept, "a schedule", _MOST_BYTES), request.path_params["schedule"]
        if not 8 <= len(identity) <= 64:
            raise InputError("an id has 8 to 64 characters")
        checked = kept.checked()
        note_act(request, f"{checked.name} of {checked.site}")
        schedule = await self._threads.run(self._kept_in().keep, identity, checked, self._utc_ns())
        return as_json(told(schedule, self._now(), ()))

    async def delete(self, request: Request) -> Response:
        """Forget a schedule, and its runs."""
        await self._threads.run(self._kept_in().delete, request.path_params["schedule"])
        return as_json({})

    async def runs(self, request: Request) -> Response:
        """What became of a schedule's runs, newest first."""
        runs = await self._threads.run(self._kept_in().runs, request.path_params["schedule"])
        return as_json({"runs": [told_run(run) for run in runs]})

    async def calendar(self, request: Request) -> Response:
        """The runs of all schedules of `?days=N` days `from=DAY`, each by its own schedule's clocks."""
        first, days = read_days(request.query_params.get("from", ""), request.query_params.get("days", "7"))
        if self._book is None:
            return as_json({"kept": False, "from": first, "days": days, "runs": [], "troubles": []})
        runs, troubles = await self._threads.run(self._calendar, first, days)
        return as_json({"kept": True, "from": first, "days": days, "runs": runs, "troubles": troubles})

    def _calendar(self, first: date, days: int) -> tuple[list[dict[str, Any]], list[dict[str, str]]]:
        book, now = self._kept_in(), self._now()
        runs: list[dict[str, Any]] = []
        schedules, damaged = book.schedules()
        troubles = _troubles(damaged)
        for schedule in schedules:
            try:
                runs += calendar_of(schedule, book.runs(schedule.id, since=first), first, days, now)
            except FlightdError as err:
                troubles.append({"name": schedule.kept.name, "why": str(err)})
        return runs, troubles

    def _told(self, site: str) -> tuple[list[dict[str, Any]], list[dict[str, str]]]:
        book, now = self._kept_in(), self._now()
        schedules, damaged = book.schedules(site)
        return [told(each, now, book.runs(each.id, 1)) for each in schedules], _troubles(damaged)

    def _now(self) -> datetime:
        return utc_time(self._utc_ns())

    def _kept_in(self) -> ScheduleBook:
        if self._book is None:
            raise InputError(
                "this station has no folder to keep schedules in", remedy="start it with --folder"
            )
        return self._book


def _troubles(damaged: Sequence[DamagedSchedule]) -> list[dict[str, str]]:
    return [{"id": one.id, "name": one.name, "why": one.why} for one in damaged]


def told(schedule: Schedule, now: datetime, newest: list[Run] | tuple[()]) -> dict[str, Any]:
    """A schedule for programs, with its next runs (none while it is not enabled) and its newest one."""
    following, trouble = [], ""
    try:
        if schedule.kept.enabled:
            following = [
                {"day": one.day, "at": one.at, "until": one.until}
                for one in schedule.rule.next_occurrences(now, _NEXT)
            ]
    except FlightdError as err:
        trouble = str(err)
    return {
        "id": schedule.id,
        **msgspec.to_builtins(schedule.kept),
        "since_ns": schedule.since_ns,
        "next": following,
        "trouble": trouble,
        "newest": told_run(newest[0]) if newest else None,
    }


def told_run(run: Run) -> dict[str, Any]:
    """A run for programs."""
    return {
        "day": run.day,
        "state": run.state,
        "due_ns": run.due_ns,
        "changed_ns": run.changed_ns,
        "drone": run.drone,
        "plan": run.plan,
        "nodes": run.nodes,
        "levels": run.levels,
        "cause": run.cause,
        "why": run.why,
    }
