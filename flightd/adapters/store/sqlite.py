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
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Self

from flightd.adapters.store.evidence_pictures import EvidenceFolder
from flightd.adapters.store.kept_looks import (
    NEWEST_CONFIRMED,
    KeptLook,
    elements,
    ids_and_texts,
    kept_look,
    kept_looks,
)
from flightd.adapters.store.label_texts import all_searches, keep_texts, merge_texts, was_searched
from flightd.adapters.store.place_fills import keep_fill
from flightd.adapters.store.read_only import connect_read_only
from flightd.adapters.store.schema import (
    APPLICATION,
    READABLE,
    SCHEMA,
    TAKEN_OVER,
    VERSION,
    WITH_DEPTHS,
    WITH_SITE,
    WITH_TEXTS,
)
from flightd.adapters.store.unavailable import InventoryUnavailableError
from flightd.adapters.store.undecided_codes import keep_undecided
from flightd.core.errors import InputError
from flightd.core.inventory import LocationRecord, Observation, PlannedLocation, Standing
from flightd.core.label_values import LabelValue
from flightd.core.scanning import CountedPlace
from flightd.core.types import CodeRead

_PART = 500
"""Looks that are read at a time, where there may be many."""


class SqliteStore:
    """A `ports.Store` in FOLDER: `inventory.db` and the pictures beside it in `evidence`.

    Safe from any thread of one process; a second process may read meanwhile.
    """

    def __init__(self, folder: Path, *, create: bool = True, read_only: bool = False) -> None:
        """Open the store, making it when `create`.  Raises InputError for what is no inventory (or is
        missing), InventoryUnavailableError when the disk refuses.

        `read_only` never makes one and leaves no trace of its own beside it, whoever writes it meanwhile;
        InventoryUnavailableError, too, for one that a writer has to open first."""
        self.folder = folder
        create = create and not read_only
        self._file = folder / "inventory.db"
        if not create and not self._file.exists():
            raise InputError(f"{folder}: holds no inventory.db; give the folder of an inventory")
        self._version = VERSION
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
            raise InventoryUnavailableError(f"{self._file}: cannot be opened: {err}") from err
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
            if application != APPLICATION:
                raise InputError(f"{self._file}: a database, but no inventory; choose another folder")
            self._version = version
            if version not in READABLE:
                older = version in TAKEN_OVER
                remedy = f"flightd inventory show {self.folder}" if older else "the flightd that wrote it"
                kind = InventoryUnavailableError if older else InputError
                problem = f"{self._file}: format {version}, known here is {VERSION}"
                raise kind(problem, remedy=f"open it once with {remedy}")

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
                raise InventoryUnavailableError(f"{self._file}: {err}") from err
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
                    for statement in SCHEMA:
                        self._db.execute(statement)
                    self._db.execute(f"PRAGMA user_version = {VERSION}")
                    self._db.execute(f"PRAGMA application_id = {APPLICATION}")
                elif application != APPLICATION:
                    raise InputError(f"{self._file}: a database, but no inventory; choose another folder")
                elif version in TAKEN_OVER:
                    for statement in (s for v in range(version, VERSION) for s in TAKEN_OVER[v]):
                        self._db.execute(statement)
                    self._db.execute(f"PRAGMA user_version = {VERSION}")
                elif version != VERSION:
                    problem = f"format {version}, known here is {VERSION}"
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
                raise InventoryUnavailableError(f"{self._file}: cannot be written: {err}") from err

    @contextmanager
    def _reading(self) -> Iterator[None]:
        with self._lock:
            try:
                yield
            except sqlite3.Error as err:
                raise InventoryUnavailableError(f"{self._file}: cannot be read: {err}") from err
            except (TypeError, ValueError) as err:  # of a row that is none of ours
                raise InputError(f"{self._file}: no inventory, or a damaged one: {err}") from err

    @property
    def site(self) -> str:
        """The name of the site that was planned last; "" where that is not known."""
        if self._version < WITH_SITE:
            return ""
        with self._reading():
            row = self._db.execute("SELECT name FROM site").fetchone()
        return str(row[0]) if row else ""

    def plan(self, locations: Iterable[PlannedLocation], site: str = "") -> None:
        """Make locations known, of the site of that name; node and depth of a known one follow the newest
        plan, as the site does."""
        rows = [(location.code, location.node, location.pallets_deep) for location in locations]
        with self._transaction():
            self._db.executemany(
                "INSERT INTO location VALUES (?, ?, ?) ON CONFLICT (code)"
                " DO UPDATE SET node = excluded.node, pallets_deep = excluded.pallets_deep",
                rows,
            )
            if site:
                self._db.execute(
                    "INSERT INTO site VALUES (1, ?)"
                    " ON CONFLICT (only_one) DO UPDATE SET name = excluded.name",
                    (site,),
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
                    read = CodeRead(symbology, text, (), bool(sure), agreeing, quality, elements(gs1))
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
            looks = kept_looks(self._db, self._version, f"id IN ({NEWEST_CONFIRMED})")
            newest = {seen.location: seen for seen, _ in looks}
            return [
                LocationRecord(code, node, newest.get(code), deep) for code, node, deep in self._planned()
            ]

    def planned(self) -> list[PlannedLocation]:
        """Every location by its code, whatever was seen there."""
        with self._reading():
            return [PlannedLocation(*row) for row in self._planned()]

    def _planned(self) -> list[tuple[str, str, int]]:
        deep = "pallets_deep" if self._version >= WITH_DEPTHS else "1"
        return self._db.execute(f"SELECT code, node, {deep} FROM location ORDER BY code").fetchall()  # noqa: S608

    def history(self, location: str) -> list[Observation]:
        """Every look at one location, oldest first, pending and withdrawn ones too."""
        return [seen for seen, _ in self.looks(location)]

    def looks(self, location: str | None = None) -> list[tuple[Observation, Standing]]:
        """All looks, or those at one location, each with its standing, oldest first."""
        with self._reading():
            if location is None:
                return kept_looks(self._db, self._version)
            return kept_looks(self._db, self._version, "location = ?", (location,))

    def looks_of_run(self, run: str) -> list[tuple[Observation, Standing]]:
        """Those of one run, oldest first."""
        with self._reading():
            return kept_looks(self._db, self._version, "run = ?", (run,))

    def parts(self, most: int) -> Iterator[list[KeptLook]]:
        """All looks, oldest first, at most so many at a time: they may be more than fit into memory.  What is
        written meanwhile is not among them."""
        with self._reading():
            rows = ids_and_texts(self._db, self._version)
        while True:
            with self._reading():
                part = [kept_look(row) for row in rows.fetchmany(most)]
            if not part:
                return
            yield part

    def loaded(self, looks: Sequence[KeptLook]) -> list[tuple[Observation, Standing]]:
        """All that is known of them, oldest first."""
        marks = ", ".join("?" * len(looks))
        with self._reading():
            return kept_looks(self._db, self._version, f"id IN ({marks})", [look.id for look in looks])

    def newest_run(self) -> str:
        """The run of the newest look, "" without one."""
        with self._reading():
            row = self._db.execute(
                "SELECT run FROM observation ORDER BY utc_ns DESC, id DESC LIMIT 1"
            ).fetchone()
        return str(row[0]) if row else ""

    def newest_ns(self) -> int:
        """When the newest look was taken, UTC; 0 without one."""
        with self._reading():
            return int(self._db.execute("SELECT coalesce(max(utc_ns), 0) FROM observation").fetchone()[0])

    def standing_looks(self) -> set[str]:
        """The ids of the looks by which the locations stand."""
        with self._reading():
            return {row[0] for row in self._db.execute(NEWEST_CONFIRMED) if row[0] is not None}

    def merge(self, other: SqliteStore) -> int:
        """Take in everything of another store, pictures included; returns how many looks were new."""
        for part in other.parts(_PART):
            for name in {look.evidence for look in part if look.evidence}:
                if other.evidence.path(name).exists():
                    self.evidence.keep(other.evidence.path(name).read_bytes())
        with self._transaction():
            before = self._db.execute("SELECT count(*) FROM observation").fetchone()[0]
            self._db.executemany(
                "INSERT INTO location VALUES (?, ?, ?) ON CONFLICT (code) DO UPDATE"
                " SET pallets_deep = max(pallets_deep, excluded.pallets_deep)",  # 1 may be: not known
                [(location.code, location.node, location.pallets_deep) for location in other.planned()],
            )
            if other.site:
                self._db.execute("INSERT OR IGNORE INTO site VALUES (1, ?)", (other.site,))
            for part in other.parts(_PART):
                for observation, standing in other.loaded(part):
                    self._insert(observation, standing)
            with other._reading():
                searched = all_searches(other._db) if other._version >= WITH_TEXTS else []
            merge_texts(self._db, searched)
            after = self._db.execute("SELECT count(*) FROM observation").fetchone()[0]
        return int(after - before)
