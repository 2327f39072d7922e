"""The values in GS1 elements: of the right century, day, decimal place; never a day that there is not."""

from __future__ import annotations

from datetime import date
from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.core.label_values import LabelValue, Told, ValueKind, ValueSource
from flightd.vision.shelf.gs1 import Elements
from flightd.vision.shelf.gs1_values import full_date, gs1_values

TODAY = date(2026, 11, 26)


def told(*elements: tuple[str, str]) -> dict[str, tuple[Told, str]]:
    values = gs1_values(elements, 0.99, TODAY)
    assert all((value.source, value.confidence) == (ValueSource.GS1, 0.99) for value in values)
    return {value.kind.value: (value.value, value.unit) for value in values}


@pytest.mark.parametrize(
    ("element", "kind", "value", "unit"),
    [
        (("10", "ab/1"), "lot", "ab/1", ""),
        (("21", "0007"), "serial", "0007", ""),
        (("11", "260228"), "production_date", date(2026, 2, 28), ""),
        (("13", "260200"), "packaging_date", date(2026, 2, 28), ""),
        (("15", "280200"), "best_before", date(2028, 2, 29), ""),
        (("16", "261130"), "sell_by", date(2026, 11, 30), ""),
        (("17", "261231"), "expiry", date(2026, 12, 31), ""),
        (("30", "48"), "quantity", Decimal(48), ""),
        (("37", "00000012"), "quantity", Decimal(12), ""),
        (("3103", "001750"), "net_weight", Decimal("1.750"), "kg"),
        (("3100", "001750"), "net_weight", Decimal(1750), "kg"),
        (("3302", "052550"), "gross_weight", Decimal("525.50"), "kg"),
        (("3155", "150000"), "net_volume", Decimal("1.5"), "l"),
        (("3201", "000220"), "net_weight", Decimal(22), "lb"),
    ],
)
def test_an_element_is_a_value_in_its_unit(
    element: tuple[str, str], kind: str, value: Told, unit: str
) -> None:
    assert told(element) == {kind: (value, unit)}


def test_what_is_no_value_of_the_goods_is_none() -> None:
    elements: Elements = (
        ("00", "395011010013000129"),
        ("02", "09501101530003"),
        ("400", "PO1"),
        ("3922", "123"),
    )
    assert told(*elements) == {}


def test_one_measure_in_two_units_is_told_once() -> None:
    assert told(("3201", "000220"), ("3101", "000100")) == {"net_weight": (Decimal(10), "kg")}


@pytest.mark.parametrize(
    ("two_digits", "year"),
    [("26", 2026), ("76", 2076), ("77", 1977), ("99", 1999), ("00", 2000)],
)
def test_a_year_is_within_49_before_and_50_after(two_digits: str, year: int) -> None:
    assert full_date(f"{two_digits}0101", 2026) == date(year, 1, 1)


@given(st.integers(1900, 2150), st.integers(0, 99))
def test_a_year_of_two_digits_is_the_nearest_such_year(now: int, two: int) -> None:
    found = full_date(f"{two:02d}0615", now)
    assert found is not None
    assert (found.year % 100, -49 <= found.year - now <= 50) == (two, True)


def test_a_day_that_the_calendar_lacks_is_sure_to_nobody() -> None:
    assert gs1_values((("17", "260230"),), 0.99, TODAY) == (
        LabelValue(ValueKind.EXPIRY, "260230", "", ValueSource.GS1, 0.0),
    )
