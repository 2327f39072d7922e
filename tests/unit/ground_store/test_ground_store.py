"""The ground store holds what it promises, on SQLite and on PostgreSQL alike."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from flightd.core.errors import InputError, UnavailableError
from flightd.core.inventory import LocationState, PlaceFill, PlannedLocation, Standing
from flightd.ground.ground_store import migrations
from flightd.ground.ground_store.batch import Batch, SentDecision, SentFlight, SentLine, SentPerson
from flightd.ground.ground_store.engine import Engine
from flightd.ground.ground_store.evidence import FolderEvidence
from flightd.ground.ground_store.migrations import newest_version
from flightd.ground.ground_store.pages import Mark
from flightd.ground.ground_store.postgres_engine import PostgresEngine
from flightd.ground.ground_store.sqlite_engine import SqliteEngine
from flightd.ground.ground_store.store import GroundStore
from tests.unit.ground_store.store_rig import BEGIN, DAY, NS, SITE, batch, look, places_of, rows_of

FLOWN = SentFlight("ab" * 32, "north", BEGIN, 90.0, "every node", "completed", "", "good", 12, 12)

DECIDED = SentDecision("decision-1", "A-1", BEGIN, 0, "put_right", "ann", "label was torn")


def test_what_was_taken_is_there_when_it_is_opened_again(
    engine: Callable[[], Engine], tmp_path: Path
) -> None:
    evidence = FolderEvidence(tmp_path / "evidence")
    with GroundStore(engine(), evidence) as first:
        first.take(batch(look("A-1", "PAL-1"), places=(PlannedLocation("A-2", "A7", 2),)))
    with GroundStore(engine(), evidence) as second:
        assert second.id == first.id
        assert places_of(second) == {"A-1": ("read", ["PAL-1"], "monday"), "A-2": ("not_visited", [], None)}
        assert second.stock(SITE)[1]["node"] == "A7"
        assert [row["pallets_deep"] for row in second.stock(SITE)] == [1, 2]
        second.take(batch(places=(PlannedLocation("A-2", "A7", 3),)))
        second.take(batch(places=(PlannedLocation("A-2", "A7"),)))
        assert second.stock(SITE)[1]["pallets_deep"] == 3, "an older inventory does not know"


def test_pages_follow_one_another_without_gap(store: GroundStore) -> None:
    looks = [
        look(f"A-{n % 5}", f"P{n}", run=f"run {n // 10}", at_ns=BEGIN + n // 3 * 20 * DAY) for n in range(30)
    ]
    store.take(batch(*looks))
    codes: list[str] = []
    while rows := store.stock(SITE, codes[-1] if codes else "", limit=2):
        codes += [row["location"] for row in rows]
    assert codes == [f"A-{n}" for n in range(5)]
    seen: list[str] = []
    mark = None
    while rows := store.history(SITE, "A-3", mark, limit=2):
        seen += [row["id"] for row in rows]
        mark = Mark.read(str(Mark(rows[-1]["utc_ns"], bytes.fromhex(rows[-1]["id"]))))
    at = [one.observation for one in looks if one.observation.location == "A-3"]
    assert seen == [o.id for o in sorted(at, key=lambda o: (o.utc_ns, o.id), reverse=True)]
    of_run, mark = [], None
    while rows := store.looks(SITE, "run 1", mark, limit=3):
        of_run += [row["id"] for row in rows]
        mark = Mark(rows[-1]["utc_ns"], bytes.fromhex(rows[-1]["id"]))
    mine = [one.observation for one in looks if one.observation.run == "run 1"]
    assert of_run == [o.id for o in sorted(mine, key=lambda o: (o.utc_ns, o.id))]
    assert [run["run"] for run in store.runs(SITE, limit=2)] == ["run 2", "run 1"]
    assert [run["run"] for run in store.runs(SITE, after="run 1")] == ["run 0"]
    assert [row["location"] for row in store.stock(SITE, state=LocationState.EMPTY)] == []


def test_sites_do_not_mix(store: GroundStore) -> None:
    store.take(batch(look("A-1", "here")))
    store.take(batch(look("A-1", "there"), site="hall 4"))
    assert [row["site"] for row in store.sites()] == ["hall 3", "hall 4"]
    assert store.stock("hall 4")[0]["texts"] == ["there"]
    assert [row["reads"][0]["text"] for row in store.history(SITE, "A-1")] == ["here"]


def test_flights_decisions_people_and_audit_are_taken_once(
    store: GroundStore, engine: Callable[[], Engine]
) -> None:
    flight = replace(FLOWN, duration_s=61.5, outcome="flying", verdict="", nodes_visited=None)
    lines = [
        SentLine(BEGIN + n, "ann", "start", "north", "accepted", f'{{"time": "…", "n": {n}}}')
        for n in range(2)
    ]
    for n, flown in enumerate((flight, FLOWN, FLOWN)):
        people = (SentPerson("ann", ("observer", "operator", "operator")[n], BEGIN + min(n, 1)),)
        audit = tuple(lines[: n + 1])
        store.take(Batch(SITE, "station", flights=(flown,), decisions=(DECIDED,), people=people, audit=audit))
    store.take(Batch(SITE, "other", people=(SentPerson("ann", "admin", BEGIN),)))
    (row,) = store.flights(SITE)
    assert (row["outcome"], row["duration_s"], row["nodes_visited"]) == ("completed", 90.0, 12)
    assert [one["who"] for one in store.decisions(SITE, "A-1")] == ["ann"]
    assert store.counts()["flights"] == 1
    assert rows_of(engine(), "SELECT station, name, role, seen_ns FROM person ORDER BY station") == [
        ("other", "ann", "admin", BEGIN), ("station", "ann", "operator", BEGIN + 1),
    ]  # fmt: skip
    told = "SELECT station, utc_ns, person, act, target, outcome, line FROM audit ORDER BY utc_ns"
    assert rows_of(engine(), told) == [
        ("station", line.utc_ns, "ann", "start", "north", "accepted", line.line) for line in lines
    ]


def test_an_older_copy_of_a_log_takes_nothing_from_its_flight(store: GroundStore) -> None:
    aborted = replace(FLOWN, outcome="aborted", reason="wind", verdict="poor")
    cut = replace(
        FLOWN, duration_s=40.0, outcome="unfinished", reason="low battery", verdict="", nodes_visited=3
    )
    unjudged = replace(
        aborted, reason="", verdict="", duration_s=None, nodes_planned=None, nodes_visited=None
    )

    def after(*sent: SentFlight) -> tuple[Any, ...]:
        for flight in sent:
            store.take(Batch(SITE, "station", flights=(flight,)))
        (row,) = store.flights(SITE)
        names = ("outcome", "reason", "verdict", "duration_s", "nodes_planned", "nodes_visited")
        return tuple(row[name] for name in names)

    assert after(cut) == ("unfinished", "low battery", "", 40.0, 12, 3)
    whole = ("aborted", "wind", "poor", 90.0, 12, 12)
    assert after(aborted) == whole
    assert after(replace(cut, mission="x"), unjudged) == whole
    assert after(FLOWN) == ("completed", "", "good", 90.0, 12, 12)


def test_a_place_belongs_to_the_node_of_the_newest_plan(store: GroundStore) -> None:
    def after(node: str, planned_ns: int) -> str:
        plan = (PlannedLocation("A-1", node),)
        store.take(Batch(SITE, "north", places=plan, planned_ns=planned_ns))
        return str(store.stock(SITE)[0]["node"])

    assert after("A1", 0) == "A1"
    store.take(batch(look("A-1", "PAL-1")))
    assert after("B7", BEGIN) == "B7"
    assert after("A1", BEGIN - 1) == "B7", "of an inventory from before the look"
    assert after("A1", 0) == "B7", "of who does not say from when it is"
    assert after("A1", BEGIN + DAY) == "A1", "a plan that was there before"
    assert after("", BEGIN + DAY) == "A1"


def test_looks_of_a_clock_that_is_ahead_stay_with_their_sender(
    engine: Callable[[], Engine], tmp_path: Path
) -> None:
    clock = [BEGIN]
    with GroundStore(engine(), FolderEvidence(tmp_path), lambda: clock[0]) as store:
        year_ns = 365 * DAY
        ahead = look("A-1", "PAL-9", run="ahead", at_ns=BEGIN + year_ns)
        sent = batch(look("A-2", at_ns=BEGIN + 60 * NS), ahead)
        assert [store.take(sent).ahead for _ in range(2)] == [1, 1]
        assert store.standings([ahead.observation.id]) == {}
        store.take(batch(look("A-1", "PAL-1")))
        assert places_of(store) == {"A-1": ("read", ["PAL-1"], "monday"), "A-2": ("empty", [], "monday")}
        assert [run["run"] for run in store.runs(SITE)] == ["monday"]
        clock[0] += year_ns  # or the store's clock was behind
        receipt = store.take(sent)
        assert (receipt.new, receipt.already, receipt.ahead) == (1, 1, 0)
        clock[0] -= year_ns
        assert places_of(store)["A-1"] == ("read", ["PAL-9"], "ahead"), "taken by an older flightd, say"
        store.take(batch(replace(ahead, standing=Standing.WITHDRAWN)))
        assert places_of(store)["A-1"] == ("read", ["PAL-1"], "monday")


def test_times_of_clocks_far_off_are_kept(far_store: GroundStore) -> None:
    far_store.take(batch(look("A-1", "early", at_ns=5), look("A-1", "late", at_ns=(1 << 63) - 1)))
    assert [row["reads"][0]["text"] for row in far_store.history(SITE, "A-1")] == ["late", "early"]


def deliver(**parts: Any) -> Callable[[GroundStore], object]:
    return lambda store: store.take(Batch(SITE, "drone-1", **parts))


@pytest.mark.parametrize(
    ("ask", "why"),
    [
        (lambda s: s.stock("hall 9"), "there is no site 'hall 9'"),
        (lambda s: s.history(SITE, "Z-9"), "there is no place 'Z-9'"),
        (lambda s: s.differences(SITE, "sunday"), "there is no run 'sunday'"),
        (lambda s: s.runs(SITE, after="sunday"), "there is no run 'sunday'"),
        (lambda s: s.stock(SITE, limit=1001), "limit=1001: a page has 1 to 1000 rows"),
        (lambda s: s.take(batch(look("A\0"))), "the name 'A\\x00' is no text"),
        (lambda s: s.take(batch(look("A-1"), site="")), "of no site"),
        (lambda s: s.take(batch(look("A-1", at_ns=-1))), "drone-1: A-1: a look at no time"),
        (lambda s: s.take(batch(*[look()] * 501)), "a batch of 501 looks; send at most 500"),
        (lambda s: s.take(batch(look("A" * 301))), "AAA…: a name of 301 characters; give at most 300"),
        (lambda s: s.take(batch(look(evidence="x"))), "the picture 'x' is no SHA-256 in hexadecimal"),
        (deliver(flights=(replace(FLOWN, id="x"),)), "the flight 'x' is no SHA-256"),
        (deliver(flights=(replace(FLOWN, began_ns=1 << 63),)), "drone-1: began_ns is out of range"),
        (deliver(flights=(replace(FLOWN, nodes_visited=10**400),)), "nodes_visited is out of range"),
        (deliver(flights=(replace(FLOWN, duration_s=math.nan),)), "duration_s is out of range"),
        (deliver(decisions=(replace(DECIDED, what="\0"),)), "the name '\\x00' is no text"),
        (deliver(decisions=(replace(DECIDED, seen_ns=-1),)), "seen_ns of a decision is out of range"),
        (deliver(people=(SentPerson("ann", "\ud800", 0),)), "is no text"),
        (deliver(people=(SentPerson("ann\0", "admin", 0),)), "is no text"),
        (deliver(people=(SentPerson("ann", "admin", 1 << 63),)), "seen_ns of a person is out of range"),
        (deliver(audit=(SentLine(1 << 63, "", "", "", "", ""),)), "utc_ns of an audit line is out of range"),
        (deliver(places=(PlannedLocation("A-1", "A1", 1 << 31),)), "pallets_deep is out of range"),
        (lambda s: Mark.read("99999999999999999999-00"), "no mark of a page"),
    ],
)
def test_what_is_asked_wrongly_is_refused_in_a_line(
    store: GroundStore, ask: Callable[[GroundStore], object], why: str
) -> None:
    store.take(batch(look("A-1", "PAL-1")))
    with pytest.raises(InputError) as caught:
        ask(store)
    assert why in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_store_of_a_newer_version_is_refused(engine: Callable[[], Engine], tmp_path: Path) -> None:
    evidence = FolderEvidence(tmp_path / "evidence")
    GroundStore(engine(), evidence).close()
    newer = engine()
    with newer.writing() as session:
        newer.set_version(session, 99)
    newer.close()
    with pytest.raises(InputError) as caught:
        GroundStore(engine(), evidence)
    known = newest_version(newer.kind)
    assert str(caught.value).endswith(
        f"a store of version 99, known here is {known}; use the flightd that made it"
    )


def test_a_store_from_before_places_told_how_full_they_are_is_taken_over(
    engine: Callable[[], Engine], tmp_path: Path
) -> None:
    older = engine()
    files = sorted((Path(migrations.__file__).parent / "migrations" / older.kind).iterdir())
    with older.writing() as session:
        older.version(session)
        for file in files[:3]:
            older.script(session, file.read_text(encoding="utf-8"))
        older.set_version(session, 3)
        session.run("INSERT INTO site (name) VALUES (?)", SITE)
        session.run("INSERT INTO place (site, code, node, state) VALUES (1, ?, ?, ?)", "A-1", "A1", "empty")
    older.close()
    with GroundStore(engine(), FolderEvidence(tmp_path / "evidence")) as store:
        (row,) = store.stock(SITE)
        assert (row["state"], row["fill"], row["pallets_deep"], row["undecided"]) == ("empty", None, 1, [])
        store.take(batch(look("A-1", "PAL-1", fill=PlaceFill(0.5))))
        assert store.stock(SITE)[0]["fill"] == {
            "share": 0.5,
            "overhang_m": None,
            "lean_m": None,
            "cases": None,
        }


def test_a_file_that_the_disk_refuses_is_told_with_what_to_look_at(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"")
    for refused in (tmp_path / "file" / "store.db", Path("/proc/store.db")):
        with pytest.raises(UnavailableError, match=r": the store answers: .*; may flightd write there\?$"):
            GroundStore(SqliteEngine(refused), FolderEvidence(tmp_path))


def test_a_database_that_cannot_be_had_is_told_in_a_line(tmp_path: Path) -> None:
    evidence = FolderEvidence(tmp_path)
    with pytest.raises(UnavailableError) as caught:
        GroundStore(PostgresEngine(f"postgresql://ann:secret@/x?host={tmp_path}"), evidence)
    assert "secret" not in str(caught.value)
    assert "\n" not in str(caught.value)
    (tmp_path / "other.db").write_bytes(b"no database at all, but long enough to be one" * 50)
    with pytest.raises(InputError, match="no ground store, or a damaged one"):
        GroundStore(SqliteEngine(tmp_path / "other.db"), evidence)
    with pytest.raises(InputError, match="not a URL of PostgreSQL"):
        PostgresEngine("postgresql://ann:sec%ret@/x")
