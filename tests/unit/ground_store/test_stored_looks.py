"""What was seen in a look stands with it and with its place, once, on SQLite and on PostgreSQL alike."""

from __future__ import annotations

from dataclasses import replace

import pytest

from flightd.core.inventory import CaseGrid, PlaceFill, Standing, UndecidedCode
from flightd.core.label_values import LabelValue, ValueKind, ValueSource
from flightd.ground.ground_store.batch import SentLook
from flightd.ground.ground_store.reads_text import reads_of, reads_text
from flightd.ground.ground_store.store import GroundStore
from tests.unit.ground_store.store_rig import BEGIN, DAY, SITE, batch, look, places_of


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
        store.take(batch(look("A-1", "PAL-1", run=f"run {day}", at_ns=BEGIN + day * DAY, fill=fill)))
        assert store.stock(SITE)[0]["fill"] == fills[fill]
    assert [row["fill"] for row in store.history(SITE, "A-1")] == [*reversed(fills.values())]
    store.take(batch(look("A-1", "PAL-1", run="run 2", at_ns=BEGIN + 2 * DAY, standing=Standing.WITHDRAWN)))
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
    store.take(batch(look("A-1", "PAL-1", run="tuesday", at_ns=BEGIN + DAY)))
    assert store.stock(SITE)[0]["undecided"] == []
    assert store.differences(SITE, "tuesday") == []
    later = look("A-1", "PAL-1", run="tuesday", at_ns=BEGIN + DAY, standing=Standing.WITHDRAWN)
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
    first = look("A-1", "PAL-1", at_ns=BEGIN - DAY, run="sunday")
    pending = look("A-1", standing=Standing.PENDING)
    told = replace(pending.observation, texts=(lot,))
    store.take(batch(first, pending))
    if namesake:
        store.take(batch(look("A-1", "PAL-9", at_ns=BEGIN - DAY), site="hall 4"))
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
