"""The comparison with the books: each difference has its one name."""

from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.core.inventory import LocationRecord, LocationState, Observation
from flightd.core.types import CodeRead
from flightd.inventory.comparison import ComparisonOutcome, Difference, compare_stock, doubtful_locations


def record(code: str, state: str, *texts: str, confidence: float = 0.9) -> LocationRecord:
    if state == "not_visited":
        return LocationRecord(code, "A1", None)
    reads = tuple(CodeRead("QR Code", text, (), True, 1, 1.0) for text in texts)
    return LocationRecord(code, "A1", Observation("run", code, 1, LocationState(state), confidence, reads))


def outcomes(lines: tuple[Difference, ...]) -> set[tuple[str, str, str, str]]:
    return {(line.outcome.value, line.location, line.text, line.found or line.found_at) for line in lines}


@pytest.mark.parametrize(
    ("records", "expected", "wanted"),
    [
        ([record("L1", "read", "A")], {"L1": ["A"]}, {("match", "L1", "A", "")}),
        ([record("L1", "empty")], {"L1": ["A"]}, {("empty_but_expected", "L1", "A", "")}),
        ([record("L1", "read", "X")], {"L1": ["A"]}, {("wrong", "L1", "A", "X")}),
        ([record("L1", "read", "X")], {"L1": []}, {("unexpected", "L1", "X", "")}),
        ([record("L1", "read", "X")], {}, {("unexpected", "L1", "X", "")}),
        ([record("L1", "unreadable")], {"L1": ["A"]}, {("uncounted", "L1", "A", "")}),
        ([record("L1", "occluded")], {"L1": ["A"]}, {("uncounted", "L1", "A", "")}),
        ([record("L1", "not_visited")], {"L1": ["A"]}, {("uncounted", "L1", "A", "")}),
        ([], {"L1": ["A"]}, {("uncounted", "L1", "A", "")}),
        ([record("L1", "empty")], {"L1": []}, set()),
        (
            [record("L1", "several", "A", "B")],
            {"L1": ["A", "C"]},
            {("match", "L1", "A", ""), ("wrong", "L1", "C", "B")},
        ),
        (
            [record("L1", "read", "A")],
            {"L1": ["A", "C"]},
            {("match", "L1", "A", ""), ("missing", "L1", "C", "")},
        ),
        (
            [record("L1", "empty"), record("L2", "read", "A")],
            {"L1": ["A"]},
            {("moved", "L1", "A", "L2")},
        ),
        (  # swapped: two moves, nothing wrong, nothing unexpected
            [record("L1", "read", "B"), record("L2", "read", "A")],
            {"L1": ["A"], "L2": ["B"]},
            {("moved", "L1", "A", "L2"), ("moved", "L2", "B", "L1")},
        ),
        (  # an article that lies at both its places has not moved
            [record("L1", "empty"), record("L2", "read", "A")],
            {"L1": ["A"], "L2": ["A"]},
            {("empty_but_expected", "L1", "A", ""), ("match", "L2", "A", "")},
        ),
        (  # one stray label explains one missing code
            [record("L1", "empty"), record("L2", "empty"), record("L3", "read", "A")],
            {"L1": ["A"], "L2": ["A"]},
            {("moved", "L1", "A", "L3"), ("empty_but_expected", "L2", "A", "")},
        ),
        (  # found elsewhere counts as moved even where its own place could not be seen
            [record("L1", "unreadable"), record("L2", "read", "A")],
            {"L1": ["A"]},
            {("moved", "L1", "A", "L2")},
        ),
    ],
)
def test_each_difference_has_its_name(
    records: list[LocationRecord], expected: dict[str, list[str]], wanted: set[tuple[str, str, str, str]]
) -> None:
    assert outcomes(compare_stock(records, expected)) == wanted


_CODES = st.lists(st.sampled_from("ABCDEF"), max_size=3, unique=True)


@given(
    st.dictionaries(st.sampled_from(("L1", "L2", "L3", "L4")), _CODES),
    st.dictionaries(st.sampled_from(("L1", "L2", "L3", "L5")), _CODES),
)
def test_every_code_expected_or_found_is_accounted_for_once(
    found: dict[str, list[str]], expected: dict[str, list[str]]
) -> None:
    states = ("empty", "read", "several", "several")
    records = [record(code, states[len(texts)], *texts) for code, texts in found.items()]
    lines = compare_stock(records, expected)
    about_expected = [line for line in lines if line.outcome is not ComparisonOutcome.UNEXPECTED]
    wanted = Counter((code, text) for code, texts in expected.items() for text in texts)
    assert Counter((line.location, line.text) for line in about_expected) == wanted
    explaining: Counter[tuple[str, str]] = Counter()
    for line in lines:
        match line.outcome:
            case ComparisonOutcome.MATCH | ComparisonOutcome.UNEXPECTED:
                explaining[line.location, line.text] += 1
            case ComparisonOutcome.MOVED:
                explaining[line.found_at, line.text] += 1
            case ComparisonOutcome.WRONG:
                explaining[line.location, line.found] += 1
            case _:
                pass
    assert explaining == Counter((code, text) for code, texts in found.items() for text in texts)


def test_what_is_doubtful_is_counted_again_with_its_reason() -> None:
    records = [
        record("L1", "read", "A"),
        record("L2", "read", "B", confidence=0.3),
        record("L3", "empty"),
        record("L4", "read", "C"),
        record("L5", "occluded"),
    ]
    lines = compare_stock(records, {"L1": ["A"], "L2": ["B"], "L3": ["C"]})
    assert doubtful_locations(lines, records, 0.5) == {
        "L2": "confidence 0.30",
        "L3": "moved",
        "L4": "moved",
        "L5": "occluded",
    }
