"""What a station keeps of its fleet, so that one that is started anew in the middle of flights goes on.

A file of the station's own.  What drones are released to stands in it before they are ordered there, so that
air in which one may be is known as such whatever becomes of the station.
"""

from __future__ import annotations

import sqlite3
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Final, TypeVar

import msgspec

from flightd import __version__
from flightd.adapters.ground_link.messages.floor import FloorStatus
from flightd.core.errors import InputError
from flightd.fleet.traffic.closures import Closure
from flightd.fleet.traffic.work_queue import KeptWork
from flightd.ground.fleet.drone_air import KeptAir
from flightd.ground.mqtt.kept_session import KeptSession
from flightd.ground.mqtt.safe_return import Standing
from flightd.ground.own_database import OwnDatabase

FILE: Final = "fleet.db"
_APPLICATION, _VERSION = 0x666C666C, 1
"""`flfl`: SQLite's application id, so that another program's file is told apart."""
_SCHEMA = "CREATE TABLE kept (name TEXT PRIMARY KEY, json BLOB NOT NULL) STRICT"
_WORK_LASTS_S: Final = 600.0
"""Nobody expects drones to leave for work that was asked for longer before the station began again, but for
that of a schedule's run whose time is not over."""
_TELLS_S: Final = 60.0
_WAITS_S: Final = 0.2
"""For another process that reads it; orders wait so long."""
TOO_OLD: Final = "the station was away for too long: ask for it again"
_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class KeptDrone:
    """One drone: `ways` are those that it may fly, over nodes, by what it was released to and told; `ordered`
    are commands that it may be given by that."""

    session: KeptSession
    air: KeptAir
    ways: tuple[tuple[str, ...], ...] = ()
    ordered: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class KeptFloor:
    """By which maps the fleet flies, and what the drones told where they stood; which flightd wrote it, for
    another one may call the air otherwise."""

    floors: Mapping[str, FloorStatus]
    standings: Mapping[str, Standing]
    version: str = ""


@dataclass(frozen=True, slots=True)
class KeptRun:
    """A schedule's run: `until_s` (UTC) it may be begun; `held`: why nothing of it was just then."""

    until_s: float
    held: str = ""


NO_RUNS: Final[Mapping[str, KeptRun]] = MappingProxyType({})


@dataclass(frozen=True, slots=True)
class KeptFleet:
    """The drones and the work; `utc_s` is when.  `given` are the runs of schedules that gave it some of that,
    by their ids."""

    drones: Mapping[str, KeptDrone]
    work: KeptWork
    utc_s: float = 0.0
    given: Mapping[str, KeptRun] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class KeptClosure:
    """What a person closed: who he is, and when, UTC; `places` are its nodes', x and y in metres (none: a
    flightd of before kept it)."""

    closure: Closure
    by: str
    utc_s: float
    places: Mapping[str, tuple[float, float]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class _KeptClosures:
    closed: tuple[KeptClosure, ...]


class FleetMemory:
    """`fleet.db` in `folder`.  Safe from any thread; each change is whole or none.  UnavailableError where
    the disk refuses, InputError for a file that is none of a station's, or cannot be read."""

    def __init__(self, folder: Path, utc_s: Callable[[], float] = time.time) -> None:
        self._database = OwnDatabase(
            file=folder / FILE,
            holds="the fleet",
            application=_APPLICATION,
            version=_VERSION,
            schema=_SCHEMA,
            timeout_s=_WAITS_S,
        )
        self._utc_s = utc_s
        self._newest: object = None
        self._floor: KeptFloor | None = None
        """By which it began, where that is not written down yet."""

    def begin(
        self,
        floor: KeptFloor,
        drones: Mapping[str, KeptDrone],
        work: KeptWork,
        *,
        runs: Mapping[str, KeptRun] = NO_RUNS,
    ) -> None:
        """The fleet flies by these maps from now on, and is so as it begins; nothing else of before is left
        but what people closed.  Where the disk refuses, the maps go with what is kept next."""
        self._newest, self._floor = None, replace(floor, version=__version__)
        self._put_fleet(KeptFleet(drones, work, self._utc_s(), runs))

    def keep(
        self,
        drones: Mapping[str, KeptDrone],
        work: KeptWork,
        *,
        waits: bool,
        runs: Mapping[str, KeptRun] = NO_RUNS,
    ) -> None:
        """Write down how they are, where that changes what the next station has to know; while work `waits`,
        every minute."""
        utc_s = self._utc_s()
        of_note = {name: _of_note(drone) for name, drone in drones.items()}
        newest = of_note, work, waits and utc_s // _TELLS_S, runs
        if newest != self._newest:
            self._put_fleet(KeptFleet(drones, work, utc_s, runs))
            self._newest = newest

    def _put_fleet(self, fleet: KeptFleet) -> None:
        with self._database.changed() as kept:
            if self._floor is not None:
                _put(kept, "floor", self._floor)
            _put(kept, "fleet", fleet)
        self._floor = None

    def keep_closures(self, closed: tuple[KeptClosure, ...]) -> None:
        """These, and no others, are closed."""
        with self._database.changed() as kept:
            _put(kept, "closed", _KeptClosures(closed))

    def closures(self) -> tuple[KeptClosure, ...]:
        """What was closed last, by whatever flightd and for whichever drones."""
        if not self._database.is_there:
            return ()
        with self._database.opened() as kept:
            found = _get(kept, "closed", _KeptClosures)
        return () if found is None else found.closed

    def read(self) -> tuple[KeptFloor, KeptFleet] | None:
        """What the station before knew; None where none flew a fleet.  Work that waited too long is told as
        not done; that of a run, once its time is over, too."""
        if not self._database.is_there:
            return None
        with self._database.opened() as kept:
            floor, fleet = _get(kept, "floor", KeptFloor), _get(kept, "fleet", KeptFleet)
        if floor is None or fleet is None:
            return None
        if floor.version != __version__:
            raise InputError(f"{self._database.file}: flightd {floor.version} wrote it")
        now_s = self._utc_s()
        if not 0.0 <= now_s - fleet.utc_s <= _WORK_LASTS_S:
            over = {*fleet.work.done, *fleet.work.reasons}
            waits = [work for work in fleet.work.work if work.node not in over]
            lasts = {run for run, given in fleet.given.items() if given.until_s > now_s}
            late = {work.node: TOO_OLD for work in waits if work.run not in lasts}
            reasons, given_up = {**fleet.work.reasons, **late}, (*fleet.work.given_up, *late)
            fleet = replace(fleet, work=replace(fleet.work, reasons=reasons, given_up=given_up))
        return floor, fleet


def _of_note(drone: KeptDrone) -> object:
    """All but what it tells all the time, and tells again."""
    return replace(
        drone,
        session=replace(drone.session, event_seq=0),
        air=replace(drone.air, at=None, doubt_m=float(drone.air.doubt_m > 0.0), place=0),
    )


def _put(kept: sqlite3.Connection, name: str, value: object) -> None:
    kept.execute("INSERT OR REPLACE INTO kept VALUES (?, ?)", (name, msgspec.json.encode(value)))


def _get(kept: sqlite3.Connection, name: str, kind: type[_T]) -> _T | None:
    row = kept.execute("SELECT json FROM kept WHERE name = ?", (name,)).fetchone()
    try:
        return None if row is None else msgspec.json.decode(row[0], type=kind)
    except msgspec.MsgspecError as err:
        raise sqlite3.DatabaseError(str(err)) from None
