"""The inventory in one SQLite file: write-ahead log, every commit through to the disk.

One observation is one transaction, so a power cut loses at most the location in work.  Observations are
named by their content and only ever added; a location's state is that of its newest confirmed one.  One
that is pending (the place it was seen at is not proven yet) counts for nothing; it is confirmed or
withdrawn.  A confirmed one is withdrawn where something contradicts it, and withdrawn wins.  So writing the
same again, or merging another drone's file in any order, ends in the same inventory.
"""

from __future__ import annotations

import json
import sqlite3
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self

from flightd.adapters.store.evidence_pictures import EvidenceFolder
from flightd.adapters.store.label_texts import (
    TEXT_TABLES,
    all_searches,
    keep_texts,
    kept_texts,
    merge_texts,
    was_searched,
)
from flightd.adapters.store.place_fills import CASE_COLUMNS, FILL_TABLES, LEAN_COLUMN, keep_fill, kept_fills
from flightd.adapters.store.read_only import connect_read_only
from flightd.adapters.store.undecided_codes import UNDECIDED_TABLES, keep_undecided, kept_undecided
from flightd.core.errors import InputError, UnavailableError
from flightd.core.inventory import (
    CountPose,
    LocationRecord,
    LocationState,
    Observation,
    PlaceFill,
    PlannedLocation,
    Standing,
    UndecidedCode,
)
from flightd.core.label_values import LabelValue
from flightd.core.scanning import CountedPlace
from flightd.core.types import CodeRead

_VERSION = 8
_WITH_TEXTS = 3
"""The first format with module sizes and printed text."""
_WITH_FILLS = 4
"""The first that says how full places are."""
_WITH_AGAIN = 6
"""The first that says which looks are second ones."""
_WITH_DEPTHS = 7
"""The first that says how many pallets stand behind one another."""
_WITH_UNDECIDED = 8
"""The first that has codes which stayed undecided."""
_READABLE = (2, 3, 4, 5, 6, 7, _VERSION)
"""Formats that are read as they are: what they lack is not known, and places are one pallet deep."""
_APPLICATION = 0x666C7464
"""`fltd`: SQLite's application id, so that another program's file is told apart."""
_TAKEN_OVER = {
    1: ("ALTER TABLE observation ADD COLUMN standing INTEGER NOT NULL DEFAULT 1",),
    2: ("ALTER TABLE code_read ADD COLUMN module_px REAL", *TEXT_TABLES),
    3: FILL_TABLES,
    4: LEAN_COLUMN,
    5: ("ALTER TABLE observation ADD COLUMN again INTEGER NOT NULL DEFAULT 0",),
    6: (*CASE_COLUMNS, "ALTER TABLE location ADD COLUMN pallets_deep INTEGER NOT NULL DEFAULT 1"),
    7: UNDECIDED_TABLES,
}
"""What makes a file of each earlier format one of the next."""
_SCHEMA = """
CREATE TABLE location (
    code TEXT PRIMARY KEY,
    node TEXT NOT NULL,
    pallets_deep INTEGER NOT NULL DEFAULT 1
) STRICT, WITHOUT ROWID;
CREATE TABLE observation (
    id TEXT PRIMARY KEY,
    run TEXT NOT NULL,
    location TEXT NOT NULL REFERENCES location (code),
    utc_ns INTEGER NOT NULL,
    state TEXT NOT NULL CHECK (state IN ('read', 'several', 'empty', 'unreadable', 'occluded')),
    confidence REAL NOT NULL CHECK (confidence BETWEEN 0 AND 1),
    node TEXT, x_m REAL, y_m REAL, height_m REAL, yaw_rad REAL,
    evidence TEXT NOT NULL,
    standing INTEGER NOT NULL DEFAULT 1,
    again INTEGER NOT NULL DEFAULT 0
) STRICT, WITHOUT ROWID;
CREATE INDEX newest ON observation (location, utc_ns, id);
CREATE TABLE code_read (
    observation TEXT NOT NULL REFERENCES observation (id),
    number INTEGER NOT NULL,
    symbology TEXT NOT NULL,
    text TEXT NOT NULL,
    sure INTEGER NOT NULL,
    agreeing INTEGER NOT NULL,
    quality REAL NOT NULL,
    gs1 TEXT NOT NULL,
    module_px REAL,
    PRIMARY KEY (observation, number)
) STRICT, WITHOUT ROWID;
""" + "".join(
    f"{table};\n" for table in (*TEXT_TABLES, *FILL_TABLES, *LEAN_COLUMN, *CASE_COLUMNS, *UNDECIDED_TABLES)
)


class SqliteStore:
    """A `ports.Store` in FOLDER: `inventory.db` and the pictures beside it in `evidence`.

    Safe from any thread of one process; a second process may read meanwhile.
    """

    def __init__(self, folder: Path, *, create: bool = True, read_only: bool = False) -> None:
        """Open the store, making it when `create`.  Raises InputError for what is no inventory (or is
        missing), UnavailableError when the disk refuses.

        `read_only` never makes one and leaves no trace of its own beside it, whoever writes it meanwhile."""
        self.folder = folder
        create = create and not read_only
        self._file = folder / "inventory.db"
        if not create and not self._file.exists():
            raise InputError(f"{folder}: holds no inventory.db; give the folder of an inventory")
        self._version = _VERSION
        self._lock = threading.RLock()
        self.evidence = EvidenceFolder(folder / "evidence")
        try:
            if read_only:
                self._db = connect_read_only(self._file)
            else:
                folder.mkdir(parents=True, exist_ok=True)
                self._db = sqlite3.connect(
                    self._file, timeout=10.0, isolation_level=None, check_same_thread=False
                )
        except (OSError, sqlite3.Error) as err:
            raise UnavailableError(f"{self._file}: cannot be opened: {err}") from err
        try:
            (self._recognise if read_only else self._prepare)()
        except BaseException:
            self._db.close()
            raise
        if create:
            self.evidence.clean()

    def _recognise(self) -> None:
        """Refuse what this program cannot read as it is."""
        with self._problems_named():
            version, application = self._marks()
            if application != _APPLICATION:
                raise InputError(f"{self._file}: a database, but no inventory; choose another folder")
            self._version = version
            if version not in _READABLE:
                older = version in _TAKEN_OVER
                remedy = f"flightd inventory show {self.folder}" if older else "the flightd that wrote it"
                problem = f"format {version}, known here is {_VERSION}"
                raise InputError(f"{self._file}: {problem}", remedy=f"open it once with {remedy}")

    def _marks(self) -> tuple[int, int]:
        """The format's version and the application id."""
        version, application = (
            int(self._db.execute(f"PRAGMA {name}").fetchone()[0])
            for name in ("user_version", "application_id")
        )
        return version, application

    @contextmanager
    def _problems_named(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.DatabaseError as err:
            if isinstance(err, sqlite3.OperationalError):
                raise UnavailableError(f"{self._file}: {err}") from err
            raise InputError(f"{self._file}: no inventory, or a damaged one: {err}") from err

    def _prepare(self) -> None:
        with self._problems_named():
            self._db.execute("PRAGMA journal_mode = WAL")
            self._db.execute("PRAGMA synchronous = FULL")
            self._db.execute("PRAGMA foreign_keys = ON")
            with self._transaction():
                version, application = self._marks()
                tables = self._db.execute("SELECT count(*) FROM sqlite_schema").fetchone()[0]
                if not tables:
                    # one transaction: a power cut leaves an empty file or a whole one
                    for statement in _SCHEMA.split(";\n"):
                        self._db.execute(statement)
                    self._db.execute(f"PRAGMA user_version = {_VERSION}")
                    self._db.execute(f"PRAGMA application_id = {_APPLICATION}")
                elif application != _APPLICATION:
                    raise InputError(f"{self._file}: a database, but no inventory; choose another folder")
                elif version in _TAKEN_OVER:
                    for statement in (s for v in range(version, _VERSION) for s in _TAKEN_OVER[v]):
                        self._db.execute(statement)
                    self._db.execute(f"PRAGMA user_version = {_VERSION}")
                elif version != _VERSION:
                    problem = f"format {version}, known here is {_VERSION}"
                    raise InputError(f"{self._file}: {problem}; use the flightd that wrote it")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; what was committed stays."""
        with self._lock:
            self._db.close()

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        with self._lock:
            try:
                self._db.execute("BEGIN IMMEDIATE")
                try:
                    yield
                    self._db.execute("COMMIT")
                except BaseException:
                    if self._db.in_transaction:  # a failed commit may leave it open, or have ended it
                        self._db.execute("ROLLBACK")
                    raise
            except sqlite3.Error as err:
                raise UnavailableError(f"{self._file}: cannot be written: {err}") from err

    @contextmanager
    def _reading(self) -> Iterator[None]:
        with self._lock:
            try:
                yield
            except sqlite3.Error as err:
                raise UnavailableError(f"{self._file}: cannot be read: {err}") from err
            except (TypeError, ValueError) as err:  # of a row that is none of ours
                raise InputError(f"{self._file}: no inventory, or a damaged one: {err}") from err

    def plan(self, locations: Iterable[PlannedLocation]) -> None:
        """Make locations known; node and depth of a known one follow the newest plan."""
        rows = [(location.code, location.node, location.pallets_deep) for location in locations]
        with self._transaction():
            self._db.executemany(
                "INSERT INTO location VALUES (?, ?, ?) ON CONFLICT (code)"
                " DO UPDATE SET node = excluded.node, pallets_deep = excluded.pallets_deep",
                rows,
            )

    def keep_evidence(self, jpeg: bytes) -> str:
        """Keep a picture; see `EvidenceFolder.keep`."""
        return self.evidence.keep(jpeg)

    def commit(self, observation: Observation, confirmed: bool = True) -> None:
        """Record one look.  A location never planned becomes known, with the node it was seen from."""
        with self._transaction():
            self._insert(observation, Standing.CONFIRMED if confirmed else Standing.PENDING)

    def settle(self, run: str, locations: Iterable[str], confirmed: bool) -> None:
        """Confirm or withdraw what is pending of a run at these locations."""
        standing = Standing.CONFIRMED if confirmed else Standing.WITHDRAWN
        with self._transaction():
            self._db.executemany(
                "UPDATE observation SET standing = ? WHERE location = ? AND run = ? AND standing = ?",
                [(standing, location, run, Standing.PENDING) for location in locations],
            )

    def contradict(self, run: str, locations: Iterable[str]) -> None:
        """Withdraw every look of a run at these locations, confirmed ones, too: they stay in the history, and
        the run has not counted there."""
        with self._transaction():
            self._db.executemany(
                "UPDATE observation SET standing = ? WHERE location = ? AND run = ?",
                [(Standing.WITHDRAWN, location, run) for location in locations],
            )

    def withdraw_pending(self, run: str) -> None:
        """Withdraw what earlier flights of a run left pending: nobody is left to prove it."""
        with self._transaction():
            self._db.execute(
                "UPDATE observation SET standing = ? WHERE run = ? AND standing = ?",
                (Standing.WITHDRAWN, run, Standing.PENDING),
            )

    def counted(self, run: str) -> tuple[CountedPlace, ...]:
        """The locations with a confirmed look of a run, whatever it told, with what the newest of these read,
        by their codes."""
        newest: dict[str, tuple[str, list[CodeRead]]] = {}
        with self._reading():
            for location, look, symbology, text, sure, agreeing, quality, gs1 in self._db.execute(
                "SELECT location, id, symbology, text, sure, agreeing, quality, gs1 FROM observation"
                " LEFT JOIN code_read ON observation = id WHERE run = ? AND standing = ?"
                " ORDER BY location, utc_ns, id, number",
                (run, Standing.CONFIRMED),
            ):
                if newest.get(location, ("",))[0] != look:
                    newest[location] = look, []
                if text is not None:
                    read = CodeRead(symbology, text, (), bool(sure), agreeing, quality, _elements(gs1))
                    newest[location][1].append(read)
        return tuple(CountedPlace(location, tuple(reads)) for location, (_, reads) in newest.items())

    def keep_texts(self, observation: str, texts: Iterable[LabelValue], asked: str) -> None:
        """What was found printed in the picture of a look (by its id), searched for as `asked` says; in place
        of what an earlier search found."""
        with self._transaction():
            keep_texts(self._db, observation, texts, asked)

    def was_searched(self, observation: str, asked: str) -> bool:
        """Whether the picture of a look was searched for text in this way already."""
        with self._reading():
            return was_searched(self._db, observation, asked)

    def _insert(self, seen: Observation, standing: int) -> None:
        pose = seen.pose
        node = pose.node if pose else ""
        self._db.execute("INSERT OR IGNORE INTO location (code, node) VALUES (?, ?)", (seen.location, node))
        where = (pose.node, pose.x_m, pose.y_m, pose.height_m, pose.yaw_rad) if pose else (None,) * 5
        cursor = self._db.execute(
            "INSERT OR IGNORE INTO observation VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
            (
                seen.id, seen.run, seen.location, seen.utc_ns, seen.state.value, seen.confidence, *where,
                seen.evidence, standing, seen.again,
            ),
        )  # fmt: skip
        if cursor.rowcount == 0:
            self._db.execute(
                "UPDATE observation SET standing = max(standing, ?) WHERE id = ?", (standing, seen.id)
            )
            return
        self._db.executemany(
            "INSERT INTO code_read VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
            [
                (
                    seen.id,
                    i,
                    r.symbology,
                    r.text,
                    r.sure,
                    r.agreeing,
                    r.quality,
                    json.dumps(r.gs1),
                    r.module_px,
                )
                for i, r in enumerate(seen.reads)
            ],
        )
        if seen.fill is not None:
            keep_fill(self._db, seen.id, seen.fill)
        keep_undecided(self._db, seen.id, seen.undecided)

    def forget(self, looks: Iterable[str]) -> None:
        """Take looks out, by their ids: somebody else keeps them."""
        rows = [(look,) for look in looks]
        with self._transaction():
            self._db.executemany("DELETE FROM code_read WHERE observation = ?", rows)
            self._db.executemany("DELETE FROM text_search WHERE observation = ?", rows)
            self._db.executemany("DELETE FROM place_fill WHERE observation = ?", rows)
            self._db.executemany("DELETE FROM undecided_code WHERE observation = ?", rows)
            self._db.executemany("DELETE FROM observation WHERE id = ?", rows)

    def locations(self) -> list[LocationRecord]:
        """Every location by its code, with its newest confirmed observation (of equally new ones, the
        greatest id)."""
        with self._reading():
            looks = self._observations()
            newest = {seen.location: seen for seen, standing in looks if standing == Standing.CONFIRMED}
            deep = "pallets_deep" if self._version >= _WITH_DEPTHS else "1"
            rows = self._db.execute(f"SELECT code, node, {deep} FROM location ORDER BY code").fetchall()  # noqa: S608
        return [LocationRecord(code, node, newest.get(code), depth) for code, node, depth in rows]

    def history(self, location: str) -> list[Observation]:
        """Every look at one location, oldest first, pending and withdrawn ones too."""
        with self._reading():
            return [seen for seen, _ in self._observations(location)]

    def looks(self, location: str | None = None) -> list[tuple[Observation, Standing]]:
        """All looks, or those at one location, each with its standing, oldest first."""
        with self._reading():
            return [(seen, Standing(standing)) for seen, standing in self._observations(location)]

    def _observations(self, location: str | None = None) -> list[tuple[Observation, int]]:
        """All looks, or those at one location, with their standing, oldest first."""
        reads: dict[str, list[CodeRead]] = {}
        module = "module_px" if self._version >= _WITH_TEXTS else "NULL"
        for seen, symbology, text, sure, agreeing, quality, gs1, module_px in self._db.execute(
            f"SELECT observation, symbology, text, sure, agreeing, quality, gs1, {module} FROM code_read "  # noqa: S608
            "ORDER BY observation, number"
        ):
            read = CodeRead(
                symbology, text, (), bool(sure), agreeing, quality, _elements(gs1), module_px=module_px
            )
            reads.setdefault(seen, []).append(read)
        texts = kept_texts(self._db) if self._version >= _WITH_TEXTS else {}
        fills = kept_fills(self._db) if self._version >= _WITH_FILLS else {}
        undecided = kept_undecided(self._db) if self._version >= _WITH_UNDECIDED else {}
        again = "again" if self._version >= _WITH_AGAIN else "0"
        rows = self._db.execute(
            f"SELECT id, run, location, utc_ns, state, confidence, evidence, {again}, "  # noqa: S608
            "node, x_m, y_m, height_m, yaw_rad, standing FROM observation "
            "WHERE ?1 IS NULL OR location = ?1 ORDER BY utc_ns, id",
            (location,),
        )
        return [
            (
                _observation(
                    row[:-1],
                    tuple(reads.get(row[0], ())),
                    texts.get(row[0], ()),
                    fills.get(row[0]),
                    undecided.get(row[0], ()),
                ),
                row[-1],
            )
            for row in rows
        ]

    def merge(self, other: SqliteStore) -> int:
        """Take in everything of another store, pictures included; returns how many looks were new."""
        with other._reading():
            planned = [
                PlannedLocation(record.code, record.node, record.pallets_deep) for record in other.locations()
            ]
            seen = other._observations()
            searched = all_searches(other._db) if other._version >= _WITH_TEXTS else []
        for observation, _ in seen:
            if observation.evidence and other.evidence.path(observation.evidence).exists():
                self.evidence.keep(other.evidence.path(observation.evidence).read_bytes())
        with self._transaction():
            before = self._db.execute("SELECT count(*) FROM observation").fetchone()[0]
            rows = [(location.code, location.node, location.pallets_deep) for location in planned]
            self._db.executemany(
                "INSERT INTO location VALUES (?, ?, ?) ON CONFLICT (code) DO UPDATE"
                " SET pallets_deep = max(pallets_deep, excluded.pallets_deep)",  # 1 may be: not known
                rows,
            )
            for observation, standing in seen:
                self._insert(observation, standing)
            merge_texts(self._db, searched)
            after = self._db.execute("SELECT count(*) FROM observation").fetchone()[0]
        return int(after - before)


def _elements(gs1: str) -> tuple[tuple[str, str], ...]:
    """ValueError, TypeError for what are no GS1 elements."""
    elements = tuple((ai, value) for ai, value in json.loads(gs1))
    for ai, value in elements:
        f"{ai}{value}".encode()  # half a character is no text
        if not (isinstance(ai, str) and isinstance(value, str)):
            raise TypeError("GS1 elements that are no text")
    return elements


def _observation(
    row: tuple[Any, ...],
    reads: tuple[CodeRead, ...],
    texts: tuple[LabelValue, ...],
    fill: PlaceFill | None,
    undecided: tuple[UndecidedCode, ...],
) -> Observation:
    _, run, location, utc_ns, state, confidence, evidence, again, node, *place = row
    pose = None if node is None else CountPose(node, *place)
    seen = LocationState(state)
    looked = run, location, utc_ns, seen, confidence, reads, pose, evidence, texts, fill
    return Observation(*looked, again=bool(again), undecided=undecided)
