"""The count against books that write the same codes and places in another way."""

from __future__ import annotations

from flightd.core.inventory import LocationRecord, LocationState, Observation
from flightd.core.types import CodeRead
from flightd.inventory.comparison import ComparisonOutcome, Difference, compare_stock

SSCC = "340123450002439853"
GTIN = "4006381333931"


def record(place: str, *texts: str) -> LocationRecord:
    reads = tuple(CodeRead("QR Code", text, (), True, 1, 1.0) for text in texts)
    state = {0: LocationState.EMPTY, 1: LocationState.READ}.get(len(texts), LocationState.SEVERAL)
    return LocationRecord(place, "A1", Observation("run", place, 1, state, 0.9, reads))


def told(lines: tuple[Difference, ...]) -> list[tuple[str, str, str, str]]:
    return [(line.outcome.value, line.location, line.text, line.found or line.found_at) for line in lines]


def test_codes_and_places_are_the_same_in_whatever_notation() -> None:
    records = [
        record("AL-1", f"00{SSCC}"),
        record("AL-2", f"01{GTIN.zfill(14)}10LOT7"),
        record("AL-3", "PAL-1"),
    ]
    books = {"al-1": [SSCC], "AL-2": [f"(01){GTIN.zfill(14)}(10)LOT7"], "AL-3": ["pal-1"]}
    assert told(compare_stock(records, books)) == [
        ("match", "AL-1", SSCC, ""),
        ("match", "AL-2", f"(01){GTIN.zfill(14)}(10)LOT7", ""),
        ("match", "AL-3", "pal-1", ""),
    ]


def test_a_code_in_another_notation_is_found_elsewhere() -> None:
    records = [record("A"), record("B", f"https://id.gs1.org/00/{SSCC}")]
    assert told(compare_stock(records, {"A": [f"(00){SSCC}"], "B": []})) == [
        ("moved", "A", f"(00){SSCC}", "B")
    ]


def test_the_books_that_name_a_code_twice_expect_it_once() -> None:
    lines = compare_stock([record("A", GTIN)], {"A": [GTIN, GTIN.zfill(14)], "a": [f"(01){GTIN.zfill(14)}"]})
    assert told(lines) == [("match", "A", GTIN, "")]


def test_an_article_with_a_batch_is_not_the_article() -> None:
    (line,) = compare_stock([record("A", GTIN)], {"A": [f"(01){GTIN.zfill(14)}(10)L1"]})
    assert (line.outcome, line.found) == (ComparisonOutcome.WRONG, GTIN)


def test_two_places_that_differ_by_case_alone_stay_two() -> None:
    lines = compare_stock([record("a", "X"), record("A", "Y")], {"a": ["X"], "A": ["Y"]})
    assert {line.outcome for line in lines} == {ComparisonOutcome.MATCH}
