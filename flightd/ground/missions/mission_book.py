"""Missions under names, and what is left of each after its newest flight: a file of the station's own."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from flightd.core.errors import InputError, RunError, UnavailableError
from flightd.ground.own_database import OwnDatabase

FILE = "missions.db"
_APPLICATION, _VERSION = 0x666C746D, 1
"""`fltm`: SQLite's application id, so that another program's file is told apart."""
MOST_MISSIONS = 2000
SCHEMA = """
CREATE TABLE mission (
    id TEXT PRIMARY KEY,
    site TEXT NOT NULL,
    name TEXT NOT NULL,
    nodes TEXT NOT NULL,
    levels TEXT NOT NULL,
    changed_ns INTEGER NOT NULL,
    plan TEXT NOT NULL,
    flown_ns INTEGER NOT NULL,
    remaining TEXT NOT NULL,
    UNIQUE (site, name)
) STRICT
"""
_ALL = """SELECT id, site, name, nodes, levels, changed_ns, plan, flown_ns, remaining FROM mission
WHERE site = ? ORDER BY name COLLATE NOCASE"""
_ONE = """SELECT id, site, name, nodes, levels, changed_ns, plan, flown_ns, remaining FROM mission
WHERE id = ?"""


@dataclass(frozen=True, slots=True)
class Mission:
    """A mission over `nodes` of a site (by its name) that counts the shelf `levels` (none: all).

    `plan` is the id with which it was handed to a drone last, at `flown_ns` (UTC; 0: never), `remaining` the
    nodes that were still to be visited when that flight was heard last."""

    id: str
    site: str
    name: str
    nodes: tuple[str, ...]
    levels: tuple[int, ...] = ()
    changed_ns: int = 0
    plan: str = ""
    flown_ns: int = 0
    remaining: tuple[str, ...] = ()


class MissionBook:
    """The file in `folder`, made with the first mission.  Safe from any thread; each change is whole or none.

    UnavailableError where the disk refuses, InputError for a file that is another program's."""

    def __init__(self, folder: Path) -> None:
        self._database = OwnDatabase(
            file=folder / FILE,
            holds="the missions",
            application=_APPLICATION,
            version=_VERSION,
            schema=SCHEMA,
        )

    def missions(self, site: str) -> list[Mission]:
        """All of a site, by their names."""
        if not self._database.is_there:
            return []
        with self._database.opened() as book:
            rows = book.execute(_ALL, (site,)).fetchall()
            return [_mission(row) for row in rows]

    def mission(self, mission_id: str) -> Mission:
        """InputError where there is none."""
        found = None
        if self._database.is_there:
            with self._database.opened() as book:
                found = _found(book, mission_id)
        if found is None:
            raise InputError("there is no such mission any more")
        return found

    def keep(self, mission: Mission) -> Mission:
        """Keep a mission, in place of the one with its id; where its nodes change, nothing is left of the
        flight before.  RunError for a name that the site's missions have already."""
        with self._database.changed() as book:
            known = _found(book, mission.id)
            if known is None and book.execute("SELECT count(*) FROM mission").fetchone()[0] >= MOST_MISSIONS:
                raise UnavailableError(f"{MOST_MISSIONS} missions are kept already", remedy="delete some")
            taken = book.execute(
                "SELECT 1 FROM mission WHERE site = ? AND name = ? AND id != ?",
                (mission.site, mission.name, mission.id),
            ).fetchone()
            if taken:
                raise RunError(f"there is a mission {mission.name!r} already", remedy="give another name")
            same = known is not None and (known.nodes, known.levels) == (mission.nodes, mission.levels)
            flown = (known.plan, known.flown_ns, known.remaining) if known and same else ("", 0, ())
            kept = Mission(
                mission.id,
                mission.site,
                mission.name,
                mission.nodes,
                mission.levels,
                mission.changed_ns,
                *flown,
            )
            _put(book, kept)
        return kept

    def delete(self, mission_id: str) -> None:
        """Forget a mission.  InputError where there is none."""
        with self._database.opened() as book:
            if not book.execute("DELETE FROM mission WHERE id = ?", (mission_id,)).rowcount:
                raise InputError("there is no such mission any more")

    def handed_over(self, mission_id: str, plan: str, nodes: Sequence[str], utc_ns: int) -> None:
        """A drone has taken these nodes of a mission as the plan of its next flight."""
        with self._database.changed() as book:
            book.execute(
                "UPDATE mission SET plan = ?, flown_ns = ?, remaining = ? WHERE id = ?",
                (plan, utc_ns, json.dumps(list(nodes)), mission_id),
            )

    def left(self, plan: str, remaining: Sequence[str]) -> None:
        """What a drone tells that is left of a plan; that of no mission changes nothing."""
        if not self._database.is_there:
            return
        with self._database.opened() as book:
            book.execute(
                "UPDATE mission SET remaining = ? WHERE plan = ?", (json.dumps(list(remaining)), plan)
            )


def _found(book: sqlite3.Connection, mission_id: str) -> Mission | None:
    row = book.execute(_ONE, (mission_id,)).fetchone()
    return None if row is None else _mission(row)


def _put(book: sqlite3.Connection, mission: Mission) -> None:
    row = (
        mission.id, mission.site, mission.name, json.dumps(mission.nodes), json.dumps(mission.levels),
        mission.changed_ns, mission.plan, mission.flown_ns, json.dumps(mission.remaining),
    )  # fmt: skip
    book.execute("INSERT OR REPLACE INTO mission VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)", row)


def _mission(row: Sequence[str | int]) -> Mission:
    identity, site, name, nodes, levels, changed_ns, plan, flown_ns, remaining = row
    return Mission(
        str(identity), str(site), str(name), tuple(json.loads(str(nodes))), tuple(json.loads(str(levels))),
        int(changed_ns), str(plan), int(flown_ns), tuple(json.loads(str(remaining))),
    )  # fmt: skip
