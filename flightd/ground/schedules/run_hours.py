"""When drones of the fleet may leave for the work of a run: it is many flights, and quiet hours and the end
of its time bind each of them, not only the hand-over of it all."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from datetime import datetime
from typing import Final

from flightd.core.errors import InputError
from flightd.core.utc_time import utc_time
from flightd.ground.schedules.kept import Schedule
from flightd.ground.schedules.schedule_book import FILE, Run
from flightd.ground.schedules.start_rules import QUIET, SUSPENDED

_GONE: Final = "there is no such schedule any more"
_NOT_READ: Final = f"cannot be read: {FILE}"
_LATE: Final = "its time is over"


def until_s(schedule: Schedule, run: Run) -> float:
    """When the time of a run is over, UTC."""
    return run.due_ns / 1e9 + schedule.kept.late_minutes * 60


def hours_of_runs(
    left: Collection[str],
    known: Mapping[str, tuple[Schedule, Run]],
    has_begun: Callable[[Sequence[str]], bool],
    now_s: float,
    *,
    is_whole: bool,
) -> tuple[dict[str, str], dict[str, str]]:
    """Of the runs of which something is `left` why nothing of it is begun now, empty where it may be; and of
    those that are over why.

    A run that was begun in its time goes on after it, until something keeps it.  `known` are those of the
    schedules that could be read, all of them if `is_whole`."""
    why_not: dict[str, str] = {}
    over: dict[str, str] = {}
    for plan in left:
        found = known.get(plan)
        if found is None:
            (over if is_whole else why_not)[plan] = _GONE if is_whole else _NOT_READ
            continue
        schedule, run = found
        why = _kept_by(schedule, utc_time(int(now_s * 1e9)))
        is_late = now_s >= until_s(schedule, run)
        if is_late and (why or not has_begun(run.nodes)):
            over[plan] = why or _LATE
        else:
            why_not[plan] = why
    return why_not, over


def _kept_by(schedule: Schedule, now: datetime) -> str:
    """What keeps everything of a schedule now; empty where nothing does."""
    if not schedule.kept.enabled:
        return SUSPENDED.why
    try:
        return QUIET.why if schedule.rule.is_quiet(now) else ""
    except InputError as err:
        return str(err)
