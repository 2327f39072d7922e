"""What is known of a place's goods: from its codes, unknown where these differ or are not sure enough."""

from __future__ import annotations

from dataclasses import replace
from datetime import date
from decimal import Decimal

import pytest

from flightd.core.inventory import LocationState, Observation
from flightd.core.label_values import LabelValue, PlaceValue, Told, UnknownReason, ValueKind, ValueSource
from flightd.core.types import CodeRead
from flightd.inventory.export.value_columns import VALUE_COLUMNS, value_cells
from flightd.inventory.place_values import code_values, place_values

AT = 1_795_000_000_000_000_000  # in 2026


def code(text: str, **gs1: str) -> CodeRead:
    return CodeRead("Code 128", text, (), True, 1, 1.0, tuple((ai[1:], value) for ai, value in gs1.items()))


def look(*reads: CodeRead, confidence: float = 0.99) -> Observation:
    state = LocationState.READ if len({read.text for read in reads}) == 1 else LocationState.SEVERAL
    return Observation("r", "A-1", AT, state, confidence, reads)


def told(values: tuple[PlaceValue, ...]) -> dict[str, Told | UnknownReason | None]:
    return {value.kind.value: value.known.value if value.known else value.unknown for value in values}


def test_the_elements_of_the_code_are_the_values_of_the_place() -> None:
    seen = look(code("x", a01="09501101530003", a10="B1", a17="270100", a3103="001750"))
    assert told(place_values(seen)) == {
        "lot": "B1", "expiry": date(2027, 1, 31), "net_weight": Decimal("1.75"),
    }  # fmt: skip
    assert place_values(None) == ()


def test_a_digital_link_has_values_too() -> None:
    link = "https://id.gs1.org/01/09501101530003/10/B1?17=271231"
    assert told(place_values(look(code(link)))) == {"lot": "B1", "expiry": date(2027, 12, 31)}


def test_the_codes_of_one_label_complete_each_other() -> None:
    seen = look(code("s", a00="395011010013000129"), code("c", a02="09501101530003", a37="12", a10="B"))
    assert told(place_values(seen)) == {"lot": "B", "quantity": 12}


def test_codes_that_differ_leave_the_place_unknown_and_each_its_own() -> None:
    one, two = code("1", a10="B1", a15="270101"), code("2", a10="B2", a15="270101")
    seen = look(one, two)
    assert told(place_values(seen)) == {"lot": UnknownReason.SEVERAL, "best_before": date(2027, 1, 1)}
    assert told(code_values(two, seen))["lot"] == "B2"


def test_one_code_that_contradicts_itself_says_nothing() -> None:
    twice = CodeRead("QR Code", "x", (), True, 1, 1.0, (("10", "A"), ("10", "B")))
    assert told(place_values(look(twice))) == {"lot": UnknownReason.CONTRADICTING}


@pytest.mark.parametrize(("demanded", "lot"), [(0.7, UnknownReason.UNSURE), (0.5, "B")])
def test_what_is_less_sure_than_demanded_is_unknown(demanded: float, lot: Told) -> None:
    assert told(place_values(look(code("x", a10="B"), confidence=0.6), demanded)) == {"lot": lot}


def test_a_day_that_there_is_not_is_unknown() -> None:
    for demanded in (0.7, 0.0):
        values = place_values(look(code("x", a17="260230")), demanded)
        assert told(values) == {"expiry": UnknownReason.UNSURE}


LOT = LabelValue(ValueKind.LOT, "B1", "", ValueSource.TEXT, 0.95)


@pytest.mark.parametrize(
    ("reads", "texts", "lot"),
    [
        ((), (LOT,), "B1"),
        ((), (replace(LOT, confidence=0.89),), UnknownReason.UNSURE),
        ((), (LOT, replace(LOT, text="B2")), UnknownReason.CONTRADICTING),
        ((code("x", a10="B9"),), (), "B9"),
        ((code("x", a10="B9"),), (replace(LOT, confidence=0.5),), "B9"),
        ((code("x", a10="B9"),), (LOT,), UnknownReason.CONTRADICTING),
        ((code("x", a01="09501101530003"),), (LOT,), "B1"),
    ],
)
def test_text_comes_second_and_two_sources_must_not_differ(
    reads: tuple[CodeRead, ...], texts: tuple[LabelValue, ...], lot: Told
) -> None:
    state = LocationState.READ if reads else LocationState.UNREADABLE
    seen = Observation("r", "A-1", AT, state, 0.99, reads, texts=texts)
    assert told(place_values(seen, 0.5)) == {"lot": lot}


def test_where_both_say_the_same_the_code_is_the_source() -> None:
    seen = replace(look(code("x", a10="B1"), confidence=0.9), texts=(LOT,))
    (value,) = place_values(seen)
    assert value.known is not None
    assert (value.known.source, value.known.confidence) == (ValueSource.GS1, 0.9)


def test_a_table_has_a_cell_for_each() -> None:
    values = place_values(look(code("x", a10="B1", a37="12", a17="260230", a3103="001750", a3112="000125")))
    cells = dict(zip(VALUE_COLUMNS, value_cells(values), strict=True))
    assert {name: cell for name, cell in cells.items() if cell != ""} == {
        "lot": "B1", "quantity": 12, "expiry": "unknown", "net_weight": 1.75, "net_weight_unit": "kg",
        "measures": "net_length 1.25 m",
    }  # fmt: skip
