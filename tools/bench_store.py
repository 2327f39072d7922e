"""How long the ground store's questions take: `python -m tools.bench_store NEWSTORE --looks 10000000`.

NEWSTORE is a file, or the URL of a PostgreSQL database without a store.  A site of 20,000 places is counted
every second day; a fiftieth of its places changes between two runs.  The looks are loaded in bulk; then some
hundred questions of each kind are asked at random, and batches delivered as a drone's are.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import random
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from flightd.core.inventory import LocationState, Observation, PlaceFill, Standing
from flightd.core.types import CodeRead
from flightd.ground.ground_store.batch import MOST_LOOKS, Batch, SentLook
from flightd.ground.ground_store.engine import Engine, Session
from flightd.ground.ground_store.evidence import FolderEvidence
from flightd.ground.ground_store.fill_text import fill_text
from flightd.ground.ground_store.pages import Mark
from flightd.ground.ground_store.postgres_engine import PostgresEngine, PostgresSession
from flightd.ground.ground_store.sqlite_engine import SqliteEngine
from flightd.ground.ground_store.store import GroundStore

SITE = "bench"
PLACES = 20_000
PAGE = 200
_BEGIN_NS = 1_672_531_200_000_000_000
_RUN_NS = 2 * 86_400 * 1_000_000_000
_LOOK_NS = 1_400_000_000
_CHANGES_EACH = 50
_LABEL = """'[["Code 128","' || text || '",1,2,1.0,[["00","' || text || '"]]]]'"""
_READS = f"CASE WHEN text = '' THEN '[]' ELSE {_LABEL} END"
_NOTHING, _GOODS = fill_text(PlaceFill(0.0)), fill_text(PlaceFill(0.62, None, 0.02))
_FILL = f"CASE WHEN text = '' THEN '{_NOTHING}' ELSE '{_GOODS}' END"
_COLUMNS = (
    "id, utc_ns, place, run, state, confidence, standing, node, x_m, y_m, height_m, yaw_rad, evidence, reads,"
    " fill"
)
_STANDS = ("utc_ns", "run", "state", "confidence", "fill")
_DELIVERED = 20
"""Batches."""


def main() -> None:
    """Load, ask, and print one JSON document."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("store")
    arguments.add_argument("--looks", type=int, default=1_000_000)
    arguments.add_argument("--asked", type=int, default=300)
    told = arguments.parse_args()
    is_url = "://" in told.store
    engine: Engine = PostgresEngine(told.store) if is_url else SqliteEngine(Path(told.store))
    print(json.dumps(measured(engine, told.looks, told.asked), indent=1))


def measured(engine: Engine, looks: int, times: int) -> dict[str, object]:
    """Load a new store, ask each question so many times, and deliver; SystemExit for a store that is not
    empty."""
    after_ns = at_ns(looks // PLACES + 5, 0)
    with GroundStore(engine, FolderEvidence(Path("unused")), lambda: after_ns) as store:
        if store.counts()["sites"]:
            raise SystemExit("this store is not empty: give a new one")
        began_s = time.perf_counter()
        runs = Bulk(engine).load(looks)
        return {
            "engine": engine.kind,
            "looks": store.counts()["looks"],
            "runs": runs,
            "loaded_s": round(time.perf_counter() - began_s, 1),
            "ms": {name: asked(engine, ask, times) for name, ask in questions(store, runs).items()},
            "delivered": delivered(engine, store, runs + 1),
        }


def code_of(place: int) -> str:
    """Twenty aisles of a thousand."""
    return f"A{place // 1000:02}-{place // 8 % 125:03}-{place % 8}"


def at_ns(run: int, place: int) -> int:
    """When a run looks at a place."""
    return _BEGIN_NS + run * _RUN_NS + place * _LOOK_NS


def read(text: str) -> CodeRead:
    """A pallet's label."""
    return CodeRead("Code 128", text, (), True, 2, 1.0, (("00", text[2:]),))


class Bulk:
    """Loads looks run by run, each run in a transaction, with what the store derives of them; the database
    makes them up itself."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._id = "randomblob(32)"
        if engine.kind == "postgres":
            self._id = "uuid_send(gen_random_uuid()) || uuid_send(gen_random_uuid())"

    def load(self, looks: int) -> int:
        """How many runs it took."""
        runs = max(looks // PLACES, 2)
        with self._engine.writing() as session:
            session.run("INSERT INTO site (id, name) VALUES (1, ?)", SITE)
            session.run_many(
                "INSERT INTO place (id, site, code, node) VALUES (?, 1, ?, ?)",
                [(place, code_of(place), f"A{place // 8}") for place in range(PLACES)],
            )
            session.run("CREATE TABLE lies (place BIGINT PRIMARY KEY, text TEXT NOT NULL, was TEXT NOT NULL)")
            session.run("INSERT INTO lies SELECT id, '', '' FROM place")
            indexes = _without_indexes(session)
        for run in range(1, runs + 1):
            with self._engine.writing() as session:
                self._load_run(session, run)
            if run % 25 == 0:
                print(f"{run} of {runs} runs", file=sys.stderr, flush=True)
        with self._engine.writing() as session:
            for index in indexes:
                session.run(index)
            newest = f"place = place.id AND utc_ns = {at_ns(runs, 0)} + place.id * {_LOOK_NS}"
            for column, value in (("look", "id"), *((name, name) for name in _STANDS)):
                session.run(f"UPDATE place SET {column} = (SELECT {value} FROM observation WHERE {newest})")  # noqa: S608
            texts = f"SELECT {_texts('text')} FROM lies WHERE lies.place = place.id"  # noqa: S608
            session.run(f"UPDATE place SET texts = ({texts})")  # noqa: S608
            session.run("DROP TABLE lies")
            if isinstance(session, PostgresSession):
                for table in ("place", "run"):  # the numbers given here were not drawn from its sequence
                    session.run(f"SELECT setval('{table}_id_seq', {10**6})")
            session.run("ANALYZE")
        return runs

    def _load_run(self, session: Session, run: int) -> None:
        began_ns, ended_ns = at_ns(run, 0), at_ns(run, PLACES - 1)
        session.run(
            "INSERT INTO run (id, site, name, began_ns, ended_ns, looks) VALUES (?, 1, ?, ?, ?, ?)",
            run, f"run {run}", began_ns, ended_ns, PLACES,
        )  # fmt: skip
        self._engine.make_room(session, (began_ns, ended_ns))
        texts = f"CASE WHEN place % 7 = {run % 7} THEN '' ELSE '00' || (1000 * place + {10**17 + run}) END"
        changes = f"{run} = 1 OR (place * 7919 + {run * 104_729}) % {_CHANGES_EACH} = 0"
        session.run("UPDATE lies SET was = text")
        session.run(f"UPDATE lies SET text = {texts} WHERE {changes}")  # noqa: S608
        time_ns = f"{began_ns} + place * {_LOOK_NS}"
        session.run(
            f"INSERT INTO observation ({_COLUMNS})"  # noqa: S608
            f" SELECT {self._id}, {time_ns}, place, {run}, {_state('text')}, 0.95, 1,"
            f" 'A1', 0.1, 0.2, 1.5, 0.0, NULL, {_READS}, {_FILL} FROM lies"
        )
        if run > 1:
            session.run(
                f"INSERT INTO difference SELECT {run}, code, 'replaced', {time_ns}, {self._id},"  # noqa: S608
                f" {_state('text')}, {_texts('text')}, {run - 1}, {time_ns} - {_RUN_NS}, {_state('was')},"
                f" {_texts('was')} FROM lies JOIN place ON place.id = lies.place WHERE text <> was"
            )


def _state(text: str) -> str:
    return f"CASE WHEN {text} = '' THEN 'empty' ELSE 'read' END"


def _texts(text: str) -> str:
    return f"""CASE WHEN {text} = '' THEN '[]' ELSE '["' || {text} || '"]' END"""


def _without_indexes(session: Session) -> list[str]:
    """Drop what SQLite makes anew faster than it keeps it up; the statements that do so."""
    if isinstance(session, PostgresSession):
        return []
    found = session.rows("SELECT name, sql FROM sqlite_schema WHERE name LIKE 'observation_by_%'")
    for name, _ in found:
        session.run(f"DROP INDEX {name}")
    return [sql for _, sql in found]


def questions(store: GroundStore, runs: int) -> dict[str, Callable[[random.Random], object]]:
    """By name."""

    def code(draw: random.Random) -> str:
        return code_of(draw.randrange(PLACES))

    def run(draw: random.Random) -> str:
        return f"run {draw.randint(2, runs)}"

    def mark(draw: random.Random) -> Mark:
        return Mark(at_ns(draw.randint(1, runs), draw.randrange(PLACES)), b"")

    def looks(draw: random.Random) -> object:
        number = draw.randint(2, runs)
        return store.looks(SITE, f"run {number}", Mark(at_ns(number, draw.randrange(PLACES)), b""), PAGE)

    return {
        "a page of the stock": lambda d: store.stock(SITE, code(d), PAGE),
        "a page of the empty places": lambda d: store.stock(SITE, code(d), PAGE, LocationState.EMPTY),
        "a place's newest looks": lambda d: store.history(SITE, code(d), None, PAGE),
        "a place's older looks": lambda d: store.history(SITE, code(d), mark(d), PAGE),
        "a run's differences": lambda d: store.differences(SITE, run(d), "", 1000),
        "a later page of them": lambda d: store.differences(SITE, run(d), code(d), PAGE),
        "a page of a run's looks": looks,
        "the newest runs": lambda _: store.runs(SITE, "", PAGE),
    }


def asked(engine: Engine, ask: Callable[[random.Random], object], times: int) -> dict[str, float]:
    """How long it takes, ms: by the clock, and on a processor here and in the database together."""
    draw = random.Random(2)
    took_ms: list[float] = []
    busy_ms: list[float] = []
    for _ in range(times):
        began_s, cpu_s = time.perf_counter(), busy_s(engine)
        ask(draw)
        took_ms.append(1000.0 * (time.perf_counter() - began_s))
        busy_ms.append(1000.0 * (busy_s(engine) - cpu_s))
    return {**_figures("clock", took_ms), **_figures("cpu", busy_ms)}


def _figures(name: str, values_ms: list[float]) -> dict[str, float]:
    ordered = sorted(values_ms)
    return {
        f"{name}_median": round(statistics.median(ordered), 2),
        f"{name}_p95": round(ordered[int(0.95 * len(ordered))], 2),
        f"{name}_most": round(ordered[-1], 2),
    }


def busy_s(engine: Engine) -> float:
    """What this thread and, on this machine, its server in PostgreSQL have spent on a processor."""
    spent_s = time.thread_time()
    if engine.kind == "postgres":
        with engine.reading() as session:
            server = session.rows("SELECT pg_backend_pid()")[0][0]
        with contextlib.suppress(OSError):
            spent_s += int(Path(f"/proc/{server}/schedstat").read_text(encoding="ascii").split()[0]) * 1e-9
    return spent_s


def delivered(engine: Engine, store: GroundStore, run: int) -> dict[str, float]:
    """Batches of a new run, each taken before the next is sent."""
    began_s, cpu_s = time.perf_counter(), busy_s(engine)
    for batch in _batches(run):
        store.take(batch)
    looks = _DELIVERED * MOST_LOOKS
    return {
        "looks_per_s": round(looks / (time.perf_counter() - began_s)),
        "looks_per_cpu_s": round(looks / (busy_s(engine) - cpu_s)),
    }


def _batches(run: int) -> Iterator[Batch]:
    for first in range(0, _DELIVERED * MOST_LOOKS, MOST_LOOKS):
        looks = (
            Observation(
                f"run {run}", code_of(p), at_ns(run, p), LocationState.READ, 0.95, (read(f"{p:020}"),)
            )
            for p in range(first, first + MOST_LOOKS)
        )
        yield Batch(SITE, "bench", looks=tuple(SentLook(seen, Standing.CONFIRMED) for seen in looks))


if __name__ == "__main__":
    main()
