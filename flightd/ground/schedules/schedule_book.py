"""Schedules and their runs: a file of the station's own, in which a run stands before it is ordered."""

from __future__ import annotations

import enum
import json
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path

import msgspec

from flightd.core.errors import InputError, RunError, UnavailableError
from flightd.ground.own_database import OwnDatabase
from flightd.ground.schedules.kept import Kept, Schedule

FILE = "schedules.db"
_APPLICATION, _VERSION = 0x666C7473, 1
"""`flts`: SQLite's application id, so that another program's file is told apart."""
MOST_SCHEDULES = 50
MOST_RUNS = 1000
"""So many are kept of each schedule, the newest."""
SCHEMA = """
CREATE TABLE schedule (
    id TEXT PRIMARY KEY,
    site TEXT NOT NULL,
    name TEXT NOT NULL,
    kept TEXT NOT NULL,
    since_ns INTEGER NOT NULL,
    UNIQUE (site, name)
) STRICT;
CREATE TABLE run (
    schedule TEXT NOT NULL REFERENCES schedule (id) ON DELETE CASCADE,
    day TEXT NOT NULL,
    state TEXT NOT NULL,
    due_ns INTEGER NOT NULL,
    changed_ns INTEGER NOT NULL,
    drone TEXT NOT NULL,
    plan TEXT NOT NULL,
    session TEXT NOT NULL,
    nodes TEXT NOT NULL,
    levels TEXT NOT NULL,
    cause TEXT NOT NULL,
    why TEXT NOT NULL,
    PRIMARY KEY (schedule, day)
) STRICT
"""
_RUNS = """SELECT schedule, day, state, due_ns, changed_ns, drone, plan, session, nodes, levels, cause, why
FROM run WHERE schedule = ? AND day >= ? ORDER BY day DESC LIMIT ?"""
_WRITE = "INSERT OR REPLACE INTO run VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)"
_PRUNE = """DELETE FROM run WHERE schedule = ? AND day < ? AND day NOT IN
(SELECT day FROM run WHERE schedule = ? ORDER BY day DESC LIMIT ?)"""


class RunState(enum.StrEnum):
    """How far a run came.  What was ordered is never ordered anew."""

    WAITING = "waiting"
    """It is due, and something keeps it from being started."""
    ORDERED = "ordered"
    """It is handed to the drone, which has not answered yet."""
    STARTED = "started"
    """The drone has accepted its start."""
    MISSED = "missed"
    """Its time was over before it could be started."""
    UNKNOWN = "unknown"
    """It was ordered, and nobody knows whether the drone took it."""


ORDERED = frozenset({RunState.ORDERED, RunState.STARTED, RunState.UNKNOWN})


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """A run of a schedule by its local `day`, due at `due_ns` (UTC).  `plan` is the id with which `drone` was
    given `nodes` and `levels` while its flightd was in `session`; `cause` and `why` are what it waits for, or
    why it was missed."""

    schedule: str
    day: date
    state: RunState
    due_ns: int
    changed_ns: int
    drone: str = ""
    plan: str = ""
    session: str = ""
    nodes: tuple[str, ...] = ()
    levels: tuple[int, ...] = ()
    cause: str = ""
    why: str = ""


@dataclass(frozen=True, slots=True)
class DamagedSchedule:
    """One that cannot be read, and why: nothing starts by it."""

    id: str
    name: str
    why: str


class ScheduleBook:
    """The file in `folder`, made with the first schedule.  Safe from any thread and process; each change is
    whole or none, and on the disk when it is done.

    UnavailableError where the disk refuses, InputError for a file that is another program's."""

    def __init__(self, folder: Path) -> None:
        self._database = OwnDatabase(
            file=folder / FILE,
            holds="the schedules",
            application=_APPLICATION,
            version=_VERSION,
            schema=SCHEMA,
        )

    def schedules(self, site: str = "") -> tuple[list[Schedule], list[DamagedSchedule]]:
        """All, or those of a site, by their names; and those that cannot be read."""
        if not self._database.is_there:
            return [], []
        with self._database.opened() as book:
            rows = book.execute(
                "SELECT id, name, kept, since_ns FROM schedule WHERE ? IN ('', site)"
                " ORDER BY name COLLATE NOCASE",
                (site,),
            ).fetchall()
        schedules: list[Schedule] = []
        damaged: list[DamagedSchedule] = []
        for identity, name, text, since_ns in rows:
            try:
                schedules.append(Schedule(str(identity), _kept(text), int(since_ns)))
            except msgspec.MsgspecError as err:
                damaged.append(DamagedSchedule(str(identity), str(name), f"cannot be read: {err}"))
        return schedules, damaged

    def keep(self, identity: str, kept: Kept, now_ns: int) -> Schedule:
        """Keep a schedule from now on, in place of the one with its id; what that has due stays due where its
        runs have the same times.  RunError for a name that the site's schedules have already."""
        since_ns = now_ns
        with self._database.changed() as book:
            known = book.execute("SELECT kept, since_ns FROM schedule WHERE id = ?", (identity,)).fetchone()
            if known and _has_times_of(kept, str(known[0])):
                since_ns = int(known[1])
            if not known and book.execute("SELECT count(*) FROM schedule").fetchone()[0] >= MOST_SCHEDULES:
                raise UnavailableError(f"{MOST_SCHEDULES} schedules are kept already", remedy="delete some")
            taken = "SELECT 1 FROM schedule WHERE site = ? AND name = ? AND id != ?"
            if book.execute(taken, (kept.site, kept.name, identity)).fetchone():
                raise RunError(f"there is a schedule {kept.name!r} already", remedy="give another name")
            text = msgspec.json.encode(kept).decode()
            book.execute(
                "INSERT INTO schedule VALUES (?, ?, ?, ?, ?) ON CONFLICT (id) DO UPDATE SET"
                " site = excluded.site, name = excluded.name, kept = excluded.kept,"
                " since_ns = excluded.since_ns",
                (identity, kept.site, kept.name, text, since_ns),
            )
        return Schedule(identity, kept, since_ns)

    def delete(self, identity: str) -> None:
        """Forget a schedule and its runs.  InputError where there is none."""
        with self._database.opened() as book:
            if not book.execute("DELETE FROM schedule WHERE id = ?", (identity,)).rowcount:
                raise InputError("there is no such schedule any more")

    def runs(self, schedule: str, most: int = MOST_RUNS, since: date = date.min) -> list[Run]:
        """The newest of a schedule, newest first."""
        if not self._database.is_there:
            return []
        with self._database.opened() as book:
            rows = book.execute(_RUNS, (schedule, since.isoformat(), most)).fetchall()
            return [_run(row) for row in rows]

    def write(self, run: Run) -> None:
        """Write down how far a run is, before anything is done by it.  InputError where its schedule is
        gone."""
        row = (
            run.schedule, run.day.isoformat(), run.state.value, run.due_ns, run.changed_ns, run.drone,
            run.plan, run.session, json.dumps(run.nodes), json.dumps(run.levels), run.cause, run.why,
        )  # fmt: skip
        with self._database.changed() as book:
            if not book.execute("SELECT 1 FROM schedule WHERE id = ?", (run.schedule,)).fetchone():
                raise InputError("there is no such schedule any more")
            book.execute(_WRITE, row)
            book.execute(_PRUNE, (run.schedule, run.day.isoformat(), run.schedule, MOST_RUNS))


def _kept(text: object) -> Kept:
    """MsgspecError for what is none."""
    return msgspec.json.decode(str(text), type=Kept)


def _has_times_of(kept: Kept, before: str) -> bool:
    """Whether a schedule has runs when the one before had some; one that was suspended had none."""
    try:
        known = _kept(before)
    except msgspec.MsgspecError:
        return False
    return known.enabled and _times(known) == _times(kept)


def _times(kept: Kept) -> tuple[object, ...]:
    return kept.at, kept.zone, frozenset(kept.weekdays), kept.every_days, kept.first


def _run(row: Sequence[str | int]) -> Run:
    schedule, day, state, due_ns, changed_ns, drone, plan, session, nodes, levels, cause, why = row
    return Run(
        schedule=str(schedule),
        day=date.fromisoformat(str(day)),
        state=RunState(str(state)),
        due_ns=int(due_ns),
        changed_ns=int(changed_ns),
        drone=str(drone),
        plan=str(plan),
        session=str(session),
        nodes=tuple(json.loads(str(nodes))),
        levels=tuple(json.loads(str(levels))),
        cause=str(cause),
        why=str(why),
    )
