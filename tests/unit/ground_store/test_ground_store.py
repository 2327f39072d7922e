"""The ground store holds what it promises, on SQLite and on PostgreSQL alike."""

from __future__ import annotations

import json
import math
import os
import random
import signal
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

import duckdb
import pytest

from flightd.core.errors import InputError, UnavailableError
from flightd.core.inventory import (
    CaseGrid,
    CountPose,
    LocationState,
    Observation,
    PlaceFill,
    PlannedLocation,
    Standing,
    UndecidedCode,
)
from flightd.core.label_values import LabelValue, ValueKind, ValueSource
from flightd.core.types import CodeRead
from flightd.ground.ground_store import derived, migrations, postgres_engine
from flightd.ground.ground_store.batch import Batch, SentDecision, SentFlight, SentLine, SentLook, SentPerson
from flightd.ground.ground_store.engine import Engine, Session
from flightd.ground.ground_store.evidence import FolderEvidence
from flightd.ground.ground_store.migrations import newest_version
from flightd.ground.ground_store.pages import Mark
from flightd.ground.ground_store.postgres_engine import PostgresEngine, PostgresSession
from flightd.ground.ground_store.reads_text import reads_of, reads_text
from flightd.ground.ground_store.sqlite_engine import SqliteEngine
from flightd.ground.ground_store.store import GroundStore

_NS = 1_000_000_000
_DAY = 86_400 * _NS
_BEGIN = 1_760_000_000 * _NS
SITE = "hall 3"


FLOWN = SentFlight("ab" * 32, "north", _BEGIN, 90.0, "every node", "completed", "", "good", 12, 12)

DECIDED = SentDecision("decision-1", "A-1", _BEGIN, 0, "put_right", "ann", "label was torn")


def read(text: str) -> CodeRead:
    return CodeRead("QR Code", text, (), True, 3, 1.0, (("00", "340123450002439853"),))


def look(
    location: str = "A-1",
    *texts: str,
    run: str = "monday",
    at_ns: int = _BEGIN,
    standing: Standing = Standing.CONFIRMED,
    state: LocationState | None = None,
    evidence: str = "",
    fill: PlaceFill | None = None,
    undecided: tuple[UndecidedCode, ...] = (),
) -> SentLook:
    known = (LocationState.EMPTY, LocationState.READ, LocationState.SEVERAL)[min(len(texts), 2)]
    pose = CountPose("A1", 0.25, -1.0, 0.9, -1.57)
    reads = tuple(map(read, texts))
    looked = run, location, at_ns, state or known, 0.875, reads, pose, evidence
    seen = Observation(*looked, fill=fill, undecided=undecided)
    return SentLook(seen, standing)


def batch(*looks: SentLook, places: tuple[PlannedLocation, ...] = (), site: str = SITE) -> Batch:
    return Batch(site, "drone-1", places, looks)


def places_of(store: GroundStore) -> dict[str, tuple[str, list[str], str | None]]:
    return {row["location"]: (row["state"], row["texts"], row["run"]) for row in store.stock(SITE)}


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


def test_a_look_comes_back_as_it_was_seen(store: GroundStore) -> None:
    store.take(batch(look("A-1", 'a"\x1d\N{SNOWMAN}\0', "b", evidence="ab" * 32)))
    (row,) = store.history(SITE, "A-1")
    assert row["id"] == look("A-1", 'a"\x1d\N{SNOWMAN}\0', "b", evidence="ab" * 32).observation.id
    assert [told["text"] for told in row["reads"]] == ['a"\x1d\N{SNOWMAN}\0', "b"]
    assert row["reads"][0]["gs1"] == [["00", "340123450002439853"]]
    assert (row["evidence"], row["confidence"], row["standing"]) == ("ab" * 32, 0.875, "confirmed")
    assert row["pose"] == {"node": "A1", "x_m": 0.25, "y_m": -1.0, "height_m": 0.9, "yaw_rad": -1.57}


def test_how_full_a_place_is_stands_with_its_look_and_its_place(store: GroundStore) -> None:
    fills = {
        PlaceFill(0.625, 0.04, 0.03, CaseGrid(4, 3)): {
            "share": 0.625,
            "overhang_m": 0.04,
            "lean_m": 0.03,
            "cases": {"columns": 4, "rows": 3, "count": 12},
        },
        PlaceFill(None): {"share": None, "overhang_m": None, "lean_m": None, "cases": None},
        None: None,
    }
    for day, fill in enumerate(fills):
        store.take(batch(look("A-1", "PAL-1", run=f"run {day}", at_ns=_BEGIN + day * _DAY, fill=fill)))
        assert store.stock(SITE)[0]["fill"] == fills[fill]
    assert [row["fill"] for row in store.history(SITE, "A-1")] == [*reversed(fills.values())]
    store.take(batch(look("A-1", "PAL-1", run="run 2", at_ns=_BEGIN + 2 * _DAY, standing=Standing.WITHDRAWN)))
    assert store.stock(SITE)[0]["fill"] == fills[PlaceFill(None)]


def test_what_is_printed_grows_with_its_look_and_stands_with_its_place(store: GroundStore) -> None:
    values = [LabelValue(ValueKind.LOT, lot, "", ValueSource.TEXT, 0.95) for lot in ("B1", "B\N{SNOWMAN}2\0")]
    none, one, two = (
        replace(look("A-1", "PAL-1").observation, texts=tuple(values[:count])) for count in range(3)
    )

    def printed() -> list[list[str]]:
        (place,), (row,) = store.stock(SITE), store.history(SITE, "A-1")
        return [[told["value"] for told in of["printed"]] for of in (place, row)]

    store.take(batch(SentLook(one, Standing.PENDING)))
    assert printed() == [[], ["B1"]]
    taken = store.take(batch(SentLook(none, Standing.CONFIRMED)))
    assert (taken.changed, printed()) == (1, [["B1"], ["B1"]])
    taken = store.take(batch(SentLook(two, Standing.PENDING)))
    assert (taken.changed, printed()) == (1, [["B1", "B\N{SNOWMAN}2\0"]] * 2)
    taken = store.take(batch(SentLook(one, Standing.CONFIRMED)))
    assert (taken.changed, printed()) == (0, [["B1", "B\N{SNOWMAN}2\0"]] * 2)
    assert store.take(batch(SentLook(two, Standing.WITHDRAWN))).changed == 1
    assert printed()[0] == []
    assert list(store.printed_texts([two.id, look("A-2").observation.id])) == [two.id]


def test_that_a_look_was_a_second_one_and_how_small_its_codes_were_is_kept(store: GroundStore) -> None:
    seen = look("A-1", "PAL-1").observation
    small = replace(seen.reads[0], module_px=1.75)
    store.take(batch(SentLook(replace(seen, again=True, reads=(small,)), Standing.CONFIRMED)))
    (row,) = store.history(SITE, "A-1")
    assert (row["again"], row["reads"][0]["text"]) == (True, "PAL-1")
    assert reads_of(reads_text((small,))) == (small,)


def test_what_stayed_undecided_stands_with_its_look_and_its_place_and_is_no_code(store: GroundStore) -> None:
    undecided = (UndecidedCode("ITF", "07\0\N{SNOWMAN}", 2),)
    store.take(batch(look("A-1", "PAL-1", undecided=undecided)))
    told = [{"symbology": "ITF", "text": "07\0\N{SNOWMAN}", "looks": 2}]
    (place,), (row,) = store.stock(SITE), store.history(SITE, "A-1")
    assert (place["state"], place["texts"], place["undecided"], row["undecided"]) == (
        "read", ["PAL-1"], told, told,
    )  # fmt: skip
    store.take(batch(look("A-1", "PAL-1", run="tuesday", at_ns=_BEGIN + _DAY)))
    assert store.stock(SITE)[0]["undecided"] == []
    assert store.differences(SITE, "tuesday") == []
    later = look("A-1", "PAL-1", run="tuesday", at_ns=_BEGIN + _DAY, standing=Standing.WITHDRAWN)
    store.take(batch(later))
    assert store.stock(SITE)[0]["undecided"] == told
    first = look("A-1", "PAL-1", undecided=undecided, standing=Standing.WITHDRAWN)
    store.take(batch(first))
    assert store.stock(SITE)[0]["undecided"] == []


def test_the_same_look_counts_once_however_it_comes(store: GroundStore) -> None:
    seen = look("A-1", "PAL-1")
    assert store.take(batch(seen, seen)).new == 1
    again, other = store.take(batch(seen, seen)), store.take(batch(seen, look("A-2")))
    assert (again.new, again.already, other.new, other.already) == (0, 2, 1, 1)
    assert store.counts()["looks"] == 2


def test_a_standing_only_rises(store: GroundStore) -> None:
    def sent(standing: Standing) -> int:
        return store.take(batch(look("A-1", "PAL-1", standing=standing), look(str(standing)))).changed

    assert [sent(s) for s in (Standing.PENDING, Standing.CONFIRMED, Standing.PENDING)] == [0, 1, 0]
    assert places_of(store)["A-1"][0] == "read"
    assert sent(Standing.WITHDRAWN) == 1
    assert places_of(store)["A-1"] == ("not_visited", [], None)
    assert store.history(SITE, "A-1")[0]["standing"] == "withdrawn"
    assert store.standings([look("A-1", "PAL-1").observation.id, "00" * 32]) == {
        look("A-1", "PAL-1").observation.id: Standing.WITHDRAWN
    }


@pytest.mark.parametrize("namesake", [False, True])
def test_a_look_that_comes_again_as_of_another_site_rises_where_it_came_first(
    store: GroundStore, namesake: bool
) -> None:
    """Whether the other site has a place and a run of the same names or not."""
    store.waiting_events("wms", 1)
    lot = LabelValue(ValueKind.LOT, "B1", "", ValueSource.TEXT, 0.95)
    first = look("A-1", "PAL-1", at_ns=_BEGIN - _DAY, run="sunday")
    pending = look("A-1", standing=Standing.PENDING)
    told = replace(pending.observation, texts=(lot,))
    store.take(batch(first, pending))
    if namesake:
        store.take(batch(look("A-1", "PAL-9", at_ns=_BEGIN - _DAY), site="hall 4"))
    theirs = store.take(batch(SentLook(told, Standing.CONFIRMED), look("B-1"), site="hall 4"))
    assert (theirs.new, theirs.changed, theirs.already) == (1, 1, 0)
    assert places_of(store) == {"A-1": ("empty", [], "monday")}
    assert [one["value"] for one in store.stock(SITE)[0]["printed"]] == ["B1"]
    assert [one["change"] for one in store.differences(SITE, "monday")] == ["gone"]
    own = {"A-1": "read"} if namesake else {}
    stands = {row["location"]: row["state"] for row in store.stock("hall 4")}
    assert stands == {"B-1": "empty"} | own
    assert store.differences("hall 4", "monday") == []
    assert store.counts()["looks"] == 3 + namesake
    withdrawn = store.take(batch(SentLook(told, Standing.WITHDRAWN), site="hall 4"))
    assert (withdrawn.new, withdrawn.changed) == (0, 1)
    assert places_of(store) == {"A-1": ("read", ["PAL-1"], "sunday")}
    waiting, _ = store.waiting_events("wms", 20)
    sites = [(one.kind, one.body["site"]) for one in waiting if one.kind.startswith("difference")]
    assert sites == [("difference.found", SITE), ("difference.gone", SITE)]


def test_a_run_differs_where_the_count_before_it_said_otherwise(store: GroundStore) -> None:
    before = [look("A-1", "PAL-1"), look("A-2"), look("A-3", "PAL-3"), look("A-4", "x-4"), look("A-5", "5")]
    after = [
        look("A-1", run="tuesday", at_ns=_BEGIN + _DAY),
        look("A-2", "PAL-2", run="tuesday", at_ns=_BEGIN + _DAY),
        look("A-3", "PAL-33", run="tuesday", at_ns=_BEGIN + _DAY),
        look("A-4", "X-4", run="tuesday", at_ns=_BEGIN + _DAY),  # the same code
        look("A-5", run="tuesday", at_ns=_BEGIN + _DAY, state=LocationState.OCCLUDED),
        look("A-6", "PAL-6", run="tuesday", at_ns=_BEGIN + _DAY),  # never counted before
    ]
    store.take(batch(*after))
    assert store.differences(SITE, "tuesday") == []
    store.take(batch(*before))  # late
    found = {row["location"]: row["change"] for row in store.differences(SITE, "tuesday")}
    assert found == {"A-1": "gone", "A-2": "appeared", "A-3": "replaced", "A-5": "unseen"}
    (third,) = store.differences(SITE, "tuesday", after="A-2", limit=1)
    assert (third["texts"], third["before_texts"], third["before_run"]) == (["PAL-33"], ["PAL-3"], "monday")
    assert store.differences(SITE, "monday") == []


def _simulated(draw: random.Random) -> list[SentLook]:
    """Looks of some runs over three months at few places, in every state and standing."""
    unread = [LocationState.UNREADABLE, LocationState.OCCLUDED]
    looks = []
    for number in range(draw.randint(5, 40)):
        texts = draw.choice([(), ("a",), ("A",), ("b",), ("a", "b")])
        state = draw.choice(unread) if not texts and draw.random() < 0.3 else None
        run = draw.randrange(4)
        at_ns = _BEGIN + (run * 20 + draw.randrange(25)) * _DAY + draw.choice([0, number])
        standing = draw.choices(list(Standing), (1, 4, 1))[0]
        place = f"A-{draw.randrange(3)}"
        looks.append(look(place, *texts, run=f"run {run}", at_ns=at_ns, standing=standing, state=state))
    return looks


def _expected(looks: list[SentLook]) -> tuple[dict[str, object], dict[str, dict[str, object]]]:
    """What stands and what differs, from all looks at once."""
    standing: dict[str, SentLook] = {}
    for one in looks:
        known = standing.setdefault(one.observation.id, one)
        if one.standing > known.standing:
            standing[one.observation.id] = one
    order = sorted(standing.values(), key=lambda one: (one.observation.utc_ns, one.observation.id))
    counting = [one.observation for one in order if one.standing is Standing.CONFIRMED]
    places: dict[str, object] = {one.observation.location: "not_visited" for one in looks}
    places |= {seen.location: (seen.state.value, seen.run) for seen in counting}
    differ: dict[str, dict[str, object]] = {one.observation.run: {} for one in looks}
    for run, differs in differ.items():
        for place in places:
            here = [seen for seen in counting if seen.location == place]
            own = [i for i, seen in enumerate(here) if seen.run == run]
            if own:
                earlier = [s for s in here[: own[-1]] if s.run != run and s.state.is_counted]
                now = here[own[-1]]
                if earlier and _says(earlier[-1]) != _says(now):
                    differs[place] = earlier[-1].run
    return places, differ


def _says(seen: Observation) -> object:
    return {read.text.casefold() for read in seen.reads} if seen.state.is_counted else None


@pytest.mark.parametrize("seed", range(12))
def test_the_order_of_delivery_changes_nothing(store: GroundStore, seed: int) -> None:
    draw = random.Random(seed)
    looks = _simulated(draw)
    sent = looks * 2
    draw.shuffle(sent)
    while sent:
        size = draw.randint(1, 12)
        store.take(batch(*sent[:size]))
        del sent[:size]
    places, differ = _expected(looks)
    stands = {
        row["location"]: (row["state"], row["run"]) if row["run"] else row["state"]
        for row in store.stock(SITE)
    }
    assert stands == places
    told = {
        run["run"]: {row["location"]: row["before_run"] for row in store.differences(SITE, run["run"])}
        for run in store.runs(SITE)
    }
    assert told == differ
    assert store.counts()["looks"] == len({one.observation.id for one in looks})


def test_pages_follow_one_another_without_gap(store: GroundStore) -> None:
    looks = [
        look(f"A-{n % 5}", f"P{n}", run=f"run {n // 10}", at_ns=_BEGIN + n // 3 * 20 * _DAY)
        for n in range(30)
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


def rows_of(opened: Engine, question: str) -> list[tuple[Any, ...]]:
    """What a database says, read past the store."""
    try:
        with opened.reading() as session:
            return [tuple(row) for row in session.rows(question)]
    finally:
        opened.close()


def test_flights_decisions_people_and_audit_are_taken_once(
    store: GroundStore, engine: Callable[[], Engine]
) -> None:
    flight = replace(FLOWN, duration_s=61.5, outcome="flying", verdict="", nodes_visited=None)
    lines = [
        SentLine(_BEGIN + n, "ann", "start", "north", "accepted", f'{{"time": "…", "n": {n}}}')
        for n in range(2)
    ]
    for n, flown in enumerate((flight, FLOWN, FLOWN)):
        people = (SentPerson("ann", ("observer", "operator", "operator")[n], _BEGIN + min(n, 1)),)
        audit = tuple(lines[: n + 1])
        store.take(Batch(SITE, "station", flights=(flown,), decisions=(DECIDED,), people=people, audit=audit))
    store.take(Batch(SITE, "other", people=(SentPerson("ann", "admin", _BEGIN),)))
    (row,) = store.flights(SITE)
    assert (row["outcome"], row["duration_s"], row["nodes_visited"]) == ("completed", 90.0, 12)
    assert [one["who"] for one in store.decisions(SITE, "A-1")] == ["ann"]
    assert store.counts()["flights"] == 1
    assert rows_of(engine(), "SELECT station, name, role, seen_ns FROM person ORDER BY station") == [
        ("other", "ann", "admin", _BEGIN), ("station", "ann", "operator", _BEGIN + 1),
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
    assert after("B7", _BEGIN) == "B7"
    assert after("A1", _BEGIN - 1) == "B7", "of an inventory from before the look"
    assert after("A1", 0) == "B7", "of who does not say from when it is"
    assert after("A1", _BEGIN + _DAY) == "A1", "a plan that was there before"
    assert after("", _BEGIN + _DAY) == "A1"


def test_looks_of_a_clock_that_is_ahead_stay_with_their_sender(
    engine: Callable[[], Engine], tmp_path: Path
) -> None:
    clock = [_BEGIN]
    with GroundStore(engine(), FolderEvidence(tmp_path), lambda: clock[0]) as store:
        year_ns = 365 * _DAY
        ahead = look("A-1", "PAL-9", run="ahead", at_ns=_BEGIN + year_ns)
        sent = batch(look("A-2", at_ns=_BEGIN + 60 * _NS), ahead)
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


def test_a_late_delivery_asks_no_more_the_more_runs_came_after_it(
    store: GroundStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    for run in range(1, 31):
        seen = look("A-1", f"PAL-{run % 3}", run=f"run {run}", at_ns=_BEGIN + run * _DAY)
        store.take(batch(seen))
    asked: list[str] = []
    one = derived._one  # noqa: SLF001

    def noted(session: Session, question: str, *values: object) -> object:
        asked.append(question)
        return one(session, question, *values)

    monkeypatch.setattr(derived, "_one", noted)
    store.take(batch(look("A-1", "PAL-0", run="late")))
    assert len(asked) <= 2
    assert [row["before_run"] for row in store.differences(SITE, "run 1")] == ["late"]


@pytest.mark.parametrize("engine", ["postgres"], indirect=True)
def test_a_host_of_the_database_that_is_gone_is_noticed(
    engine: Callable[[], Engine], cluster: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(postgres_engine, "_READ_S", 0.05)
    opened = engine()
    with pytest.raises(UnavailableError, match="statement timeout"), opened.reading() as session:
        session.rows("SELECT pg_sleep(60)")
    opened.close()
    for url, idle in ((cluster, "10"), (f"{cluster}&keepalives_idle=99", "99")):
        opened = PostgresEngine(url)
        with opened.writing() as session:
            assert isinstance(session, PostgresSession)
            asked = session.connection.info.get_parameters()
        assert (asked["keepalives_idle"], asked["tcp_user_timeout"]) == (idle, "15000")
        opened.close()


def _hangs(session: PostgresSession, statement: Callable[[], object]) -> None:
    """Its server does not run meanwhile."""
    ((server,),) = session.rows("SELECT pg_backend_pid()")
    session.connection.most_s = 0.05
    os.kill(server, signal.SIGSTOP)
    try:
        statement()
    finally:
        os.kill(server, signal.SIGCONT)


@pytest.mark.parametrize("engine", ["postgres"], indirect=True)
@pytest.mark.parametrize("many", [False, True])
def test_a_database_that_hangs_is_given_up(engine: Callable[[], Engine], many: bool) -> None:
    opened = engine()
    hangs = pytest.raises(UnavailableError, match=r"the store answers: nothing for 0 s: it hangs$")
    with hangs, opened.writing() as session:
        assert isinstance(session, PostgresSession)
        assert session.connection.most_s == 75
        one, two = partial(session.rows, "SELECT 1"), partial(session.run_many, "SELECT ?", [(1,), (2,)])
        _hangs(session, two if many else one)
    with opened.writing() as session:
        assert session.rows("SELECT 1") == [(1,)]
    opened.close()


@pytest.mark.parametrize("engine", ["postgres"], indirect=True)
def test_nobody_waits_to_write_for_ever(
    engine: Callable[[], Engine], monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = engine(), engine()
    limits = "statement_timeout", "lock_timeout", "idle_in_transaction_session_timeout"
    asked = "SELECT " + ", ".join(f"current_setting('{name}')" for name in limits)
    with first.writing() as session:
        assert session.rows(asked) == [("1min", "20s", "1min")]
        first.script(session, "SELECT 1")
        assert session.rows(asked) == [("0", "20s", "1min")], "a migration takes what it takes"
        monkeypatch.setattr(postgres_engine, "_TURN_S", 0.05)
        waited = pytest.raises(UnavailableError, match=r"have kept the store locked for 0\.05 s; try again$")
        with waited, second.writing():
            pytest.fail("two write at once")
    with second.writing() as session:
        assert session.rows(asked)[0][0] == "1min"
    first.close()
    second.close()


@pytest.mark.parametrize("engine", ["postgres"], indirect=True)
def test_a_database_that_was_started_anew_is_asked_at_once(engine: Callable[[], Engine]) -> None:
    opened, other = engine(), engine()
    with opened.reading() as first, opened.reading() as second:
        servers = [session.rows("SELECT pg_backend_pid()")[0][0] for session in (first, second)]
    with other.reading() as session:
        for server in servers:
            assert session.rows("SELECT pg_terminate_backend(?, 30000)", server) == [(True,)]
    with opened.writing() as session:
        assert session.rows("SELECT pg_backend_pid()")[0][0] not in servers
    opened.close()
    other.close()


@pytest.mark.parametrize("engine", ["postgres"], indirect=True)
def test_looks_lie_in_the_partition_of_their_month(
    far_store: GroundStore, engine: Callable[[], Engine]
) -> None:
    november_ns = int(datetime(2025, 11, 1, tzinfo=UTC).timestamp()) * _NS
    times = (november_ns - 1, november_ns, november_ns + _DAY, 5, (1 << 63) - 1)
    for n, at_ns in enumerate(times):
        far_store.take(batch(look(f"A-{n}", at_ns=at_ns)))
    where = rows_of(
        engine(),
        "SELECT place.code, observation.tableoid::regclass::text FROM observation"
        " JOIN place ON place.id = observation.place ORDER BY place.code",
    )
    assert where == [
        ("A-0", "observation_2025_10"), ("A-1", "observation_2025_11"), ("A-2", "observation_2025_11"),
        ("A-3", "observation_before_2020"), ("A-4", "observation_beyond"),
    ]  # fmt: skip
    bounds = f"utc_ns >= {november_ns} AND utc_ns < {november_ns + _DAY}"
    plan = rows_of(engine(), f"EXPLAIN SELECT id FROM observation WHERE {bounds}")
    asked = " ".join(str(line) for (line,) in plan)
    assert "observation_2025_11" in asked
    assert not {"observation_2025_10", "observation_beyond"} & set(asked.split())


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


def _asked(question: str) -> list[tuple[Any, ...]]:
    relation = duckdb.sql(question)
    assert relation is not None
    return relation.fetchall()


def test_duckdb_reads_what_is_exported(store: GroundStore, tmp_path: Path) -> None:
    twice = (UndecidedCode("ITF", 'a"b,\n', 2),)
    half, unknown = PlaceFill(0.5, 0.04, 0.03, CaseGrid(4, 3)), PlaceFill(None)
    pending = look("A-2", standing=Standing.PENDING, fill=unknown)
    store.take(batch(look("A-1", 'a"b,\n', run="monday"), pending))
    store.take(
        batch(
            look("A-1", run="tuesday", at_ns=_BEGIN + _DAY + 7), look("A-9", "x", fill=half, undecided=twice)
        )
    )
    store.take(batch(look("A-1", "other"), site="hall 4"))
    assert store.export(SITE, tmp_path / "it's out") == {"observations": 4, "differences": 1}
    observations = str(tmp_path / "it's out" / "observations.parquet").replace("'", "''")
    differences = observations.replace("observations", "differences")
    told = _asked(
        f"SELECT site, run, location, state, epoch_ns(utc), evidence, reads FROM '{observations}'"
        " ORDER BY utc, location"
    )
    assert [row[2:5] for row in told] == [
        ("A-1", "read", _BEGIN), ("A-2", "empty", _BEGIN), ("A-9", "read", _BEGIN),
        ("A-1", "empty", _BEGIN + _DAY + 7),
    ]  # fmt: skip
    assert (told[0][:2], told[0][5], json.loads(told[0][6])[0][1]) == ((SITE, "monday"), None, 'a"b,\n')
    assert json.loads(told[2][6])[0][1] == "x"
    doubts = _asked(f"SELECT undecided FROM '{observations}' ORDER BY utc, location")
    assert [json.loads(row[0]) for row in doubts] == [
        [], [], [{"symbology": "ITF", "text": 'a"b,\n', "looks": 2}], [],
    ]  # fmt: skip
    assert _asked(f"SELECT DISTINCT printed, again FROM '{observations}'") == [("[]", False)]
    filled = _asked(
        "SELECT fill_asked, fill, overhang_m, lean_m, case_columns, case_rows"
        f" FROM '{observations}' ORDER BY utc, location"
    )
    nothing = (None,) * 5
    assert filled == [
        (False, *nothing), (True, *nothing), (True, 0.5, 0.04, 0.03, 4, 3), (False, *nothing),
    ]  # fmt: skip
    changed = _asked(f"SELECT location, change, before_texts FROM '{differences}'")
    assert changed == [("A-1", "gone", json.dumps(['a"b,\n']))]
    assert store.export("", tmp_path / "all")["observations"] == 5
    store.take(batch(places=(PlannedLocation("A-1", "A1"),), site="hall 5"))  # nobody looked yet
    assert store.export("hall 5", tmp_path / "empty") == {"observations": 0, "differences": 0}
    assert _asked(f"SELECT * FROM '{tmp_path / 'empty' / 'observations.parquet'}'") == []
    with pytest.raises(InputError, match="there is no site 'hall 9'"):
        store.export("hall 9", tmp_path / "none")
