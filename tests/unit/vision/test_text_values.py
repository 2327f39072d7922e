"""What lines of text say: one thing or nothing; what only looks like it is never told as sure."""

from __future__ import annotations

from dataclasses import replace
from datetime import date
from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.config.label_text import LabelTextConfig
from flightd.core.label_text import TextLine, TextLook
from flightd.core.label_values import LabelValue, Told, ValueKind, ValueSource
from flightd.vision.shelf.text_values import text_values

LOT = LabelTextConfig(kind="lot", pattern=r"LOT[:\s]*([A-Z]\d{3,5})")
ANY_LOT = LabelTextConfig(kind="lot", pattern=r"LOT\s*([A-Z0-9]+)")
EXPIRY = LabelTextConfig(kind="expiry", pattern=r"EXP\s*(\S+)", dates=("%d.%m.%Y", "%m/%y"))
SLASHED = LabelTextConfig(kind="expiry", pattern=r"EXP (\S+)", dates=("%d/%m/%y", "%m/%d/%y"))
QUANTITY = LabelTextConfig(kind="quantity", pattern=r"QTY\s*(\d+)")


def line(*texts: str, sure: float = 0.99, left: bool = False, right: bool = False) -> TextLine:
    return TextLine((), tuple(TextLook(text, (sure,) * len(text)) for text in texts), left, right)


def told(pattern: LabelTextConfig, *lines: TextLine) -> list[tuple[Told, float]]:
    return [(value.value, value.confidence) for value in text_values(lines, (pattern,))]


@pytest.mark.parametrize(
    ("pattern", "text", "value"),
    [
        (LOT, "LOT: B1203 A", "B1203"),
        (LOT, "L0T B1203", "B1203"),
        (ANY_LOT, "LOT ABC", "ABC"),
        (EXPIRY, "EXP 31.12.2026", date(2026, 12, 31)),
        (EXPIRY, "EXP 02/28", date(2028, 2, 29)),
        (QUANTITY, "QTY 48 PCS", Decimal(48)),
    ],
)
def test_a_line_that_can_mean_one_thing_means_it(pattern: LabelTextConfig, text: str, value: Told) -> None:
    assert told(pattern, line(text, text)) == [(value, 0.99)]


@pytest.mark.parametrize(
    ("pattern", "text"),
    [
        (ANY_LOT, "LOT AB0"),  # or ABO
        (ANY_LOT, "LOT A1B"),  # or AIB
        (
            LabelTextConfig(kind="expiry", pattern=r"EXP (\S+)", dates=("%d/%m/%y", "%m/%d/%y")),
            "EXP 03/04/26",
        ),
    ],
)
def test_a_line_that_can_mean_two_things_is_sure_to_nobody(pattern: LabelTextConfig, text: str) -> None:
    ((_, confidence),) = told(pattern, line(text, text))
    assert confidence == 0.0


@pytest.mark.parametrize("text", ["LOT B12", "LOTB123456", "EXP 31.02.2026", "EXP 31.13.2026", "QTY 48X", ""])
def test_what_does_not_fit_is_nothing(text: str) -> None:
    assert text_values([line(text, text)], (LOT, EXPIRY, QUANTITY)) == ()


def test_the_least_sure_character_counts_and_both_looks_must_agree() -> None:
    doubtful = TextLook("LOT B1203", (0.1,) * 4 + (0.99, 0.6, 0.99, 0.99, 0.99))
    assert told(LOT, TextLine((), (doubtful, doubtful))) == [("B1203", 0.6)]
    assert told(LOT, TextLine((), (doubtful, line("LOT B1203").looks[0]))) == [("B1203", 0.99)]
    assert told(LOT, line("LOT B1203", "LOT B1208"))[0][1] == 0.0
    assert told(LOT, line("LOT B1203", "LOT B12"))[0][1] == 0.0


def test_what_touches_the_value_must_be_sure_too() -> None:
    remnant = TextLook("QTY 48-", (0.99,) * 6 + (0.45,))
    assert told(QUANTITY, TextLine((), (remnant, remnant))) == [(Decimal(48), 0.45)]
    assert told(QUANTITY, line("QTY 48, OK", "QTY 48, OK")) == [(Decimal(48), 0.99)]


@pytest.mark.parametrize(
    ("pattern", "text", "value"),
    [
        (LOT, "LOT BI203", "B1203"),
        (LOT, "LOT B12O3", "B1203"),
        (EXPIRY, "EXP O3.02.2026", date(2026, 2, 3)),
        (QUANTITY, "QTY 48O", Decimal(480)),
    ],
)
def test_a_letter_taken_for_the_digit_that_it_looks_like_is_less_sure(
    pattern: LabelTextConfig, text: str, value: Told
) -> None:
    ((found, confidence),) = told(pattern, line(text, text))
    assert (found, round(confidence, 3)) == (value, 0.842)


def test_what_may_go_on_beyond_the_line_is_sure_only_where_its_length_is_known() -> None:
    assert told(QUANTITY, line("QTY 48", "QTY 48", right=True)) == [(Decimal(48), 0.0)]
    assert told(QUANTITY, line("QTY 48 PCS", "QTY 48 PCS", right=True)) == [(Decimal(48), 0.99)]
    assert told(LOT, line("LOT B12345", "LOT B12345", right=True)) == [("B12345", 0.99)]
    assert told(EXPIRY, line("EXP 31.12.2026", "EXP 31.12.2026", right=True)) == [(date(2026, 12, 31), 0.99)]
    gappy = replace(line("QTY 48 PCS", "QTY 48 PCS"), gap=True)
    assert told(QUANTITY, gappy) == [(Decimal(48), 0.0)], "it may be 428"
    bare = LabelTextConfig(kind="lpn", pattern=r"([A-Z]+)$")
    assert told(bare, line("PQR", "PQR", left=True)) == [("PQR", 0.0)]


def test_glare_on_the_line_makes_it_less_sure() -> None:
    assert told(LOT, replace(line("LOT B1203", "LOT B1203"), glare=0.5)) == [("B1203", 0.891)]


def test_one_value_on_two_lines_is_told_once_and_two_values_both() -> None:
    lines = (
        line("LOT B1203", "LOT B1203", sure=0.7),
        line("LOT B1203", "LOT B1203"),
        line("LOT C1203", "LOT C1203"),
    )
    assert text_values(lines, (LOT,)) == tuple(
        LabelValue(ValueKind.LOT, lot, "", ValueSource.TEXT, 0.99) for lot in ("B1203", "C1203")
    )


@given(st.text("O0Il1AB 7", max_size=40))
def test_nothing_is_sure_that_looks_like_something_else(text: str) -> None:
    alike = {"O": "0", "0": "O", "I": "1", "l": "1", "1": "I"}
    for value, confidence in told(ANY_LOT, line(f"LOT {text}", f"LOT {text}")):
        assert confidence == 0.0 or not set(str(value)) & (alike.keys() - {"l"})
