"""The inventory keeps what it said it kept: through kills, torn writes, repeats and merges."""

from __future__ import annotations

import json
import random
import resource
import shutil
import sqlite3
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.adapters.store import evidence_pictures
from flightd.adapters.store.evidence_pictures import EvidenceFolder
from flightd.adapters.store.for_reading import opened_for_reading
from flightd.adapters.store.sqlite import SqliteStore
from flightd.core.errors import InputError, UnavailableError
from flightd.core.inventory import (
    CaseGrid,
    LocationState,
    Observation,
    PlaceFill,
    PlannedLocation,
    Standing,
    UndecidedCode,
)
from flightd.core.types import CodeRead
from flightd.ports import Store
from flightd.runtime.durable_files import replace_file
from flightd.vision.shelf.evidence_jpeg import MOST_BYTES, evidence_jpeg
from tests.rigs.patience import COMMAND_S
from tests.unit.store.kill_at_random import look

ROOT = Path(__file__).parents[3]


def test_planned_locations_are_not_visited_until_somebody_looks(tmp_path: Path) -> None:
    store: Store
    with SqliteStore(tmp_path) as store:
        store.plan([PlannedLocation("A-01", "A1"), PlannedLocation("A-02", "A1")])
        store.commit(look(1))
        found = {record.code: record for record in store.locations()}
    assert found["A-01"].state is LocationState.READ
    assert found["A-01"].texts == ("PALLET-000001",)
    assert (found["A-02"].state, found["A-02"].observation) == (LocationState.NOT_VISITED, None)


def test_how_deep_places_are_follows_the_newest_plan_and_is_merged(tmp_path: Path) -> None:
    with SqliteStore(tmp_path / "one") as store, SqliteStore(tmp_path / "two") as other:
        store.plan([PlannedLocation("A-01", "A1", 2)])
        store.plan([PlannedLocation("A-01", "A1", 3), PlannedLocation("A-02", "A1")])
        store.commit(look(1))
        other.plan([PlannedLocation("A-01", "A1")])
        other.merge(store)
        store.merge(other)
        for one in (store, other):
            assert [(r.pallets_deep, r.pallets_seen) for r in one.locations()] == [(3, 1), (1, 0)]


def test_of_which_site_it_is_follows_the_newest_plan_and_is_merged(tmp_path: Path) -> None:
    with SqliteStore(tmp_path / "one") as store, SqliteStore(tmp_path / "two") as other:
        assert store.site == ""
        for site in ("hall 2", "hall 3"):
            store.plan([PlannedLocation("A-01", "A1")], site)
        store.plan([PlannedLocation("A-02", "A1")])
        other.merge(store)
        assert (store.site, other.site) == ("hall 3", "hall 3")
        with SqliteStore(store.folder, read_only=True) as reader:
            assert reader.site == "hall 3"


def test_looks_that_are_too_many_are_read_in_parts_as_they_are_all_at_once(tmp_path: Path) -> None:
    with SqliteStore(tmp_path) as store:
        for number in range(120):
            store.commit(look(number), confirmed=number % 3 > 0)
        parts = list(store.parts(50))
        assert [len(part) for part in parts] == [50, 50, 20]
        assert [one for part in parts for one in store.loaded(part)] == store.looks()
        assert [one.id for part in parts for one in part] == [seen.id for seen, _ in store.looks()]
        standing = {record.observation.id for record in store.locations() if record.observation}
        assert store.standing_looks() == standing
        assert store.newest_run() == store.looks()[-1][0].run


def test_what_was_committed_is_read_back_as_it_was(tmp_path: Path) -> None:
    elements = (("01", "09501101530003"),)
    gs1 = CodeRead("Code 128", "0109501101530003", (), True, 3, 0.75, elements, module_px=2.9)
    seen = replace(look(2), reads=(gs1,), evidence="ab" * 32, confidence=1)
    bare = Observation("r", "B-1", 5, LocationState.EMPTY, 0.5)
    with SqliteStore(tmp_path) as store:
        store.commit(seen)
        store.commit(bare)
    with SqliteStore(tmp_path, create=False) as store:
        assert store.history("A-02") == [seen]
        assert store.history("B-1") == [bare]
        assert [observation.id for observation in store.history("A-02")] == [seen.id]


@pytest.mark.parametrize(
    "fill",
    [
        PlaceFill(0.625, 0.04, 0.03, CaseGrid(4, 3)),
        PlaceFill(None, cases=CaseGrid(2, 2)),
        PlaceFill(0.0),
        PlaceFill(None),
        None,
    ],
)
def test_how_full_a_place_is_is_read_back_as_it_was_and_merged(
    tmp_path: Path, fill: PlaceFill | None
) -> None:
    seen = replace(look(2), fill=fill)
    assert seen.id == look(2).id
    with SqliteStore(tmp_path / "a") as one, SqliteStore(tmp_path / "b") as other:
        one.commit(seen)
        other.merge(one)
        for store in (one, other):
            assert store.history(seen.location) == [seen]
            assert store.locations()[0].observation == seen
        one.forget([seen.id])
        assert one.history(seen.location) == []


UNDECIDED = UndecidedCode("ITF", "070429", 1), UndecidedCode("Codabar", "A1234B", 3)


def test_what_stayed_undecided_is_read_back_merged_and_makes_no_other_look(tmp_path: Path) -> None:
    seen = replace(look(2), undecided=UNDECIDED)
    assert seen.id == look(2).id
    with SqliteStore(tmp_path / "a") as one, SqliteStore(tmp_path / "b") as other:
        one.commit(seen)
        other.merge(one)
        other.commit(look(2))
        for store in (one, other):
            assert store.history(seen.location) == [seen]
            assert [record.texts for record in store.locations()] == [("PALLET-000002",)]
            assert [read.text for read in store.counted(seen.run)[0].reads] == ["PALLET-000002"]
        one.forget([seen.id])
        assert one.history(seen.location) == []


@pytest.mark.parametrize("share", [-0.01, 1.01])
def test_no_place_is_fuller_than_full_or_emptier_than_empty(share: float) -> None:
    with pytest.raises(ValueError, match="outside"):
        PlaceFill(share)


def test_where_in_the_picture_a_code_was_does_not_make_another_look(tmp_path: Path) -> None:
    corners = ((0.0, 0.0), (9.0, 0.0), (9.0, 9.0), (0.0, 9.0))
    bare = look(2)
    flown = replace(bare, reads=tuple(replace(read, corners_px=corners) for read in bare.reads))
    with SqliteStore(tmp_path) as store:
        store.commit(flown)
        store.commit(bare)
        assert store.history("A-02") == [bare]
    assert flown.id == bare.id


def test_the_newest_look_is_the_state_whatever_the_order(tmp_path: Path) -> None:
    looks = [replace(look(50 * n), location="A-00") for n in range(5)]
    random.Random(3).shuffle(looks)
    with SqliteStore(tmp_path) as store:
        for seen in looks + looks:
            store.commit(seen)
        (record,) = store.locations()
        assert record.texts == ("PALLET-000200",)
        assert len(store.history("A-00")) == 5


@settings(max_examples=15, deadline=None)
@given(st.lists(st.integers(0, 300), max_size=12), st.lists(st.integers(0, 300), max_size=12))
def test_merging_is_idempotent_and_knows_no_order(
    tmp_path_factory: pytest.TempPathFactory, mine: list[int], theirs: list[int]
) -> None:
    folder = tmp_path_factory.mktemp("merge")
    one, two = SqliteStore(folder / "one"), SqliteStore(folder / "two")
    for numbers, store in ((mine, one), (theirs, two)):
        store.plan([PlannedLocation("Z-9", "Z9")])
        for number in numbers:
            store.commit(look(number))
    with one, two:
        assert one.merge(two) == len(set(theirs) - set(mine))
        assert one.merge(two) == 0
        two.merge(one)
        assert one.locations() == two.locations()
        assert all(one.history(r.code) == two.history(r.code) for r in one.locations())


def test_evidence_is_merged_with_the_looks(tmp_path: Path) -> None:
    with SqliteStore(tmp_path / "one") as one, SqliteStore(tmp_path / "two") as two:
        name = two.keep_evidence(b"a picture")
        two.commit(look(7, evidence=name))
        one.merge(two)
        assert one.evidence.path(name).read_bytes() == b"a picture"


def test_evidence_pictures_fit_their_size_and_are_kept_once(tmp_path: Path) -> None:
    noise = np.random.default_rng(1).integers(0, 256, (1080, 1920, 3), np.uint8)
    for picture in (noise, np.full((480, 640, 3), 90, np.uint8)):
        assert len(evidence_jpeg(picture)) <= MOST_BYTES
    with SqliteStore(tmp_path) as store:
        jpeg = evidence_jpeg(noise)
        assert store.keep_evidence(jpeg) == store.keep_evidence(jpeg)
        assert len(list((tmp_path / "evidence").rglob("*.*"))) == 1
        with pytest.raises(ValueError, match="50000"):
            store.keep_evidence(b"x" * 60_000)


def test_a_picture_that_two_keep_at_once_is_kept_by_both(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    together = threading.Barrier(2, timeout=30.0)

    def both_write(path: Path, beside: Path, data: bytes) -> None:
        beside.write_bytes(b"half")
        together.wait()
        replace_file(path, beside, data)

    monkeypatch.setattr(evidence_pictures, "replace_file", both_write)
    folder = EvidenceFolder(tmp_path)
    with ThreadPoolExecutor(2) as threads:
        first, second = threads.map(folder.keep, [b"a picture"] * 2)
    assert first == second
    assert [path.read_bytes() for path in tmp_path.rglob("*.*")] == [b"a picture"]


def test_a_picture_for_which_there_is_no_room_leaves_nothing_behind(tmp_path: Path) -> None:
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limits[1]))
    try:
        with pytest.raises(UnavailableError, match="cannot keep the picture"):
            EvidenceFolder(tmp_path).keep(b"x" * 2000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert list(tmp_path.rglob("*.*")) == []


def test_half_written_pictures_are_swept_at_the_start(tmp_path: Path) -> None:
    SqliteStore(tmp_path).close()
    part = tmp_path / "evidence" / "ab" / "abcd.1.part"
    part.parent.mkdir(parents=True)
    part.write_bytes(b"half")
    SqliteStore(tmp_path).close()
    assert not part.exists()


def test_killed_at_random_moments_nothing_reported_is_lost(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "tests.unit.store.kill_at_random", "30", "5", str(tmp_path / "store")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True, timeout=COMMAND_S)
    result = json.loads(done.stdout)
    assert (result["kills"], result["lost"], result["unsound"]) == (30, 0, 0)
    assert result["commits"] > 0


@pytest.mark.parametrize("seed", range(4))
def test_a_log_torn_at_any_byte_loses_only_the_latest_looks(tmp_path: Path, seed: int) -> None:
    source = tmp_path / "source"
    with SqliteStore(source) as store:
        for number in range(30):
            store.commit(look(number))
        log = (source / "inventory.db-wal").read_bytes()
        base = (source / "inventory.db").read_bytes()
    rng = random.Random(seed)
    kept_before = -1
    for cut in sorted(rng.randrange(len(log) + 1) for _ in range(25)):
        torn = tmp_path / f"torn-{cut}"
        torn.mkdir(exist_ok=True)
        (torn / "inventory.db").write_bytes(base)
        (torn / "inventory.db-wal").write_bytes(log[:cut] + bytes(rng.randrange(4096)))
        with SqliteStore(torn) as store:
            kept = [record.texts[0] for record in store.locations()]
            assert kept == [f"PALLET-{n:06d}" for n in range(len(kept))]
            assert len(kept) >= kept_before
            store.commit(look(49))
        kept_before = len(kept)
        shutil.rmtree(torn)
    assert kept_before > 20


def test_what_is_no_inventory_is_refused_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no inventory"):
        SqliteStore(tmp_path / "missing", create=False)
    assert not (tmp_path / "missing").exists()
    (tmp_path / "inventory.db").write_bytes(b"no database at all, but long enough " * 50)
    with pytest.raises(InputError, match="no inventory, or a damaged one"):
        SqliteStore(tmp_path)
    other = tmp_path / "other"
    other.mkdir()
    database = sqlite3.connect(other / "inventory.db")
    database.execute("CREATE TABLE t (x)")
    database.close()
    with pytest.raises(InputError, match="no inventory; choose another folder"):
        SqliteStore(other)


def test_a_disk_that_refuses_is_said_so(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UnavailableError):
        SqliteStore(tmp_path / "file" / "store")
    with SqliteStore(tmp_path / "store") as store:
        most = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (4096, most[1]))  # stands for the disk that is full
        try:
            with pytest.raises(UnavailableError, match="cannot be written"):
                store.commit(look(1))
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, most)


@pytest.mark.parametrize(
    ("state", "texts"),
    [("read", 0), ("read", 2), ("several", 1), ("empty", 1), ("not_visited", 0), ("occluded", 1)],
)
def test_a_state_that_its_reads_deny_cannot_be_made(state: str, texts: int) -> None:
    reads = tuple(CodeRead("QR Code", f"T{n}", (), True, 1, 1.0) for n in range(texts))
    with pytest.raises(ValueError, match="A-1"):
        Observation("r", "A-1", 1, LocationState(state), 0.5, reads)


def test_a_pending_look_counts_for_nothing_until_it_is_confirmed(tmp_path: Path) -> None:
    with SqliteStore(tmp_path) as store:
        first, second = look(1), look(51)
        assert first.location == second.location
        store.commit(first)
        store.commit(second, confirmed=False)
        assert newest(store, first.location) == first.id
        assert store.counted("other run") == ()
        store.settle(second.run, [second.location], confirmed=True)
        assert newest(store, first.location) == second.id
        (counted,) = store.counted(first.run)
        assert counted.location == first.location
        assert [read.text for read in counted.reads] == [read.text for read in second.reads]


def test_which_looks_were_second_ones_is_read_back_and_merged(tmp_path: Path) -> None:
    looks = [look(1), replace(look(2), again=True)]
    with SqliteStore(tmp_path / "a") as store, SqliteStore(tmp_path / "b") as other:
        for seen in looks:
            store.commit(seen)
        other.merge(store)
        assert [seen.again for seen, _ in store.looks()] == [False, True]
        assert other.looks() == store.looks()


def test_a_booked_place_that_is_contradicted_is_counted_no_more_and_keeps_its_history(tmp_path: Path) -> None:
    with SqliteStore(tmp_path) as store:
        seen, again, other = look(1), look(51), look(2)
        assert (seen.location, seen.run) == (again.location, again.run)
        for one in (seen, other):
            store.commit(one)
        store.contradict(seen.run, [seen.location])
        counted = [place.location for place in store.counted(seen.run)]
        assert counted == [other.location], "the run's remainder looks there again"
        assert newest(store, seen.location) is None
        assert newest(store, other.location) == other.id
        assert [kept.id for kept in store.history(seen.location)] == [seen.id]
        store.commit(again, confirmed=False)
        store.settle(again.run, [again.location], confirmed=True)
        store.commit(seen)
        assert newest(store, seen.location) == again.id
        assert [standing for _, standing in store.looks(seen.location)] == [
            Standing.WITHDRAWN,
            Standing.CONFIRMED,
        ]


def test_what_was_withdrawn_stays_withdrawn_through_repeats_and_merges(tmp_path: Path) -> None:
    with SqliteStore(tmp_path / "a") as one, SqliteStore(tmp_path / "b") as other:
        seen = look(1)
        for store in (one, other):
            store.commit(seen, confirmed=False)
        one.settle(seen.run, [seen.location], confirmed=False)
        other.settle(seen.run, [seen.location], confirmed=True)
        one.settle(seen.run, [seen.location], confirmed=True)
        one.commit(seen)
        assert newest(one, seen.location) is None
        other.merge(one)
        assert newest(other, seen.location) is None
        assert [kept.id for kept in other.history(seen.location)] == [seen.id]


TO_8 = ("DROP TABLE site",)
TO_7 = (*TO_8, "DROP TABLE undecided_code")
TO_6 = (
    *TO_7,
    "ALTER TABLE place_fill DROP COLUMN case_columns",
    "ALTER TABLE place_fill DROP COLUMN case_rows",
    "ALTER TABLE location DROP COLUMN pallets_deep",
)
TO_5 = (*TO_6, "ALTER TABLE observation DROP COLUMN again")
TO_4 = (*TO_5, "ALTER TABLE place_fill DROP COLUMN lean_m")
TO_3 = (*TO_7, *TO_5[4:], "DROP TABLE place_fill")
TO_2 = (*TO_3, "ALTER TABLE code_read DROP COLUMN module_px", "DROP TABLE text_search")
OLDER = {
    1: (*TO_2, "ALTER TABLE observation DROP COLUMN standing"),
    2: TO_2,
    3: TO_3,
    4: TO_4,
    5: TO_5,
    6: TO_6,
    7: TO_7,
    8: TO_8,
}


@pytest.mark.parametrize("version", OLDER)
def test_an_inventory_of_an_earlier_format_is_taken_over_as_confirmed(tmp_path: Path, version: int) -> None:
    with SqliteStore(tmp_path) as store:
        store.commit(look(1))
    database = sqlite3.connect(tmp_path / "inventory.db")
    for statement in OLDER[version]:
        database.execute(statement)
    database.execute(f"PRAGMA user_version = {version}")
    database.close()
    before = (tmp_path / "inventory.db").read_bytes()
    with opened_for_reading(tmp_path, untouched=True) as store:
        assert newest(store, look(1).location) == look(1).id
    assert (tmp_path / "inventory.db").read_bytes() == before
    unsure = replace(look(2), undecided=UNDECIDED)
    with SqliteStore(tmp_path) as store:
        assert newest(store, look(1).location) == look(1).id
        assert [seen.undecided for seen in store.history(look(1).location)] == [()]
        store.commit(unsure, confirmed=False)
        assert newest(store, look(2).location) is None
        assert store.history(look(2).location) == [unsure]
        assert store.site == ""
        store.plan([], "hall 3")
        assert store.site == "hall 3"


def newest(store: SqliteStore, location: str) -> str | None:
    """The id of the observation that tells a location's state."""
    record = next(record for record in store.locations() if record.code == location)
    return record.observation.id if record.observation else None


def test_what_an_ended_flight_left_pending_is_never_confirmed_by_the_next(tmp_path: Path) -> None:
    with SqliteStore(tmp_path) as store:
        old, new, other = look(51), look(1), look(2)
        assert old.location == new.location
        assert (old.run, old.utc_ns > new.utc_ns) == (new.run, True), "a clock that was set back"
        store.commit(old, confirmed=False)
        store.commit(other)
        store.withdraw_pending(old.run)
        store.commit(new, confirmed=False)
        store.settle(new.run, [new.location], confirmed=True)
        assert newest(store, new.location) == new.id
        assert newest(store, other.location) == other.id


def test_a_file_that_breaks_in_flight_is_a_disk_that_refuses(tmp_path: Path) -> None:
    with SqliteStore(tmp_path) as store:
        for number in range(200):
            store.commit(look(number))
    file = tmp_path / "inventory.db"
    whole = file.read_bytes()
    file.write_bytes(whole[:16384] + b"\xff" * (len(whole) - 16384))
    with SqliteStore(tmp_path, create=False) as store:
        with pytest.raises(UnavailableError, match="cannot be read"):
            store.locations()
        with pytest.raises(UnavailableError, match="cannot be written"):
            store.commit(look(1000))
