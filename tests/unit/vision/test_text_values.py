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
from flightd.vision.shelf.text_values import text_values, worth_another

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


DAY = LabelTextConfig(kind="expiry", pattern=r"(\d{2}/\d{2}/\d{4})", dates=("%d/%m/%Y",))
SHORT = LabelTextConfig(kind="expiry", pattern=r"(\d{2}[A-Z]{3}\d{2})", dates=("%d%b%y",))
DOTS = LabelTextConfig(kind="expiry", pattern=r"(\d{4}\.\d{2}\.\d{2})", dates=("%Y.%m.%d",))
SPACES = LabelTextConfig(kind="expiry", pattern=r"EXP (\d{4} \d{2} \d{2})", dates=("%Y %m %d",))
NAMED = LabelTextConfig(kind="expiry", pattern=r"([A-Z]{3} \d{2} \d{2})", dates=("%b %d %y",))
DASHES = LabelTextConfig(kind="expiry", pattern=r"(\d{2}-\d{2}-\d{4})", dates=("%d-%m-%Y",))


@pytest.mark.parametrize(
    ("pattern", "text", "value"),
    [
        (DAY, "E10/08/2021", date(2021, 8, 10)),
        (DAY, "EXP20/12/2025", date(2025, 12, 20)),
        (DAY, "10/08/2021A12:16", date(2021, 8, 10)),
        (DOTS, "2022.01.18B", date(2022, 1, 18)),
        (DOTS, "2022.10.17까지", date(2022, 10, 17)),
        (SHORT, "BY15FEB22N 09:07", date(2022, 2, 15)),
        (SHORT, "15FEB22B 09:07", date(2022, 2, 15)),  # no year has three digits
        (DAY, "10 /08/ 2021", date(2021, 8, 10)),
        (DOTS, "2020 12.03", date(2020, 12, 3)),
        (DOTS, "2021. 10 .08", date(2021, 10, 8)),
        (DOTS, "2021,10·08", date(2021, 10, 8)),
        (DOTS, "2020-11.06", date(2020, 11, 6)),
        (DASHES, "03-04.2021", date(2021, 4, 3)),
        (SPACES, "EXP 2021 0808", date(2021, 8, 8)),
        (SHORT, "15 FEB 22 09:07", date(2022, 2, 15)),
        (NAMED, "JUN08 21 06:45", date(2021, 6, 8)),
    ],
)
def test_letters_that_touch_a_date_and_separators_read_otherwise_change_no_digit(
    pattern: LabelTextConfig, text: str, value: date
) -> None:
    assert told(pattern, line(text, text)) == [(value, 0.99)]


@pytest.mark.parametrize(
    ("pattern", "text"),
    [
        (DAY, "120/12/2025"),
        (DAY, "I20/12/2025"),
        (DAY, "20/12/20251"),
        (DOTS, "2021.11.118"),
        (SHORT, "15FEB22B7"),  # 15FEB2287, perhaps
        (SHORT, "15FEB22B"),  # cut short, perhaps
        (SHORT, "Z15FEB22"),
        (NAMED, "XJUN 08 21"),
        (SPACES, "EXP 20210808"),
        (DOTS, "2021 10 08"),  # in another order, perhaps
        (DASHES, "03.04.2021"),
        (LabelTextConfig(kind="expiry", pattern=r"(\d\d \d\d \d{4})", dates=("%m %d %Y",)), "03.04.2021"),
        (DOTS, "2021.1008"),  # a number of something
        (DOTS, "7.2021. 10.08"),
        (NAMED, "NOV2021"),  # the month of a year
        (NAMED, "12 JAN 2023"),
        (LabelTextConfig(kind="expiry", pattern=r"([A-Z]{3}\d{4})", dates=("%b%d%y",)), "12 JAN 2023"),
        (DAY, "18/02/0745"),
        (DAY, "18/02/2582"),
        (LabelTextConfig(kind="expiry", pattern=r"(\d\d\.\d\d\.\d\d)", dates=("%d.%m.%y",)), "20:12:25"),
    ],
)
def test_what_only_resembles_a_date_is_none(pattern: LabelTextConfig, text: str) -> None:
    assert told(pattern, line(text, text)) == []


@given(st.text("0179ABEILOSXZ", max_size=4), st.text("0179ABEILOSXZ", max_size=4))
def test_whatever_touches_a_date_it_is_told_as_it_stands_or_not_at_all(before: str, after: str) -> None:
    for pattern, text, value in (
        (DAY, "10/11/2021", date(2021, 11, 10)),
        (DOTS, "2021. 11.10", date(2021, 11, 10)),
        (SHORT, "10NOV21", date(2021, 11, 10)),
    ):
        found = told(pattern, line(before + text + after, before + text + after))
        digit = before[-1:].isdigit() or after[:1].isdigit()
        assert found == [] if digit else {day for day, sure in found if sure} <= {value}


@given(st.text("0123456789 .,/-", max_size=16))
def test_a_date_in_digits_has_its_digits_side_by_side_in_the_text(text: str) -> None:
    for pattern, form in ((DAY, "%d%m%Y"), (DOTS, "%Y%m%d"), (SPACES, "%Y%m%d")):
        for day, _ in told(pattern, line(f"EXP {text}", f"EXP {text}")):
            assert isinstance(day, date)
            assert day.strftime(form) in "".join(filter(str.isdigit, text))


def test_a_date_whose_year_has_two_digits_may_be_cut_short_where_the_line_is_open() -> None:
    short = LabelTextConfig(kind="expiry", pattern=r"(\d{2}/\d{2}/\d{2})", dates=("%d/%m/%y",))
    assert told(short, line("12/03/20", "12/03/20")) == [(date(2020, 3, 12), 0.99)]
    assert told(short, line("12/03/20", "12/03/20", right=True)) == [(date(2020, 3, 12), 0.0)]
    assert told(DAY, line("12/03/2020", "12/03/2020", right=True)) == [(date(2020, 3, 12), 0.99)]


def test_what_is_no_character_of_a_date_needs_not_be_sure() -> None:
    dots = (0.99,) * 4 + (0.4,) + (0.99,) * 2 + (0.3,) + (0.99,) * 2
    look = TextLook("2021.10.08", dots)
    assert told(DOTS, TextLine((), (look, look))) == [(date(2021, 10, 8), 0.99)]


def looks(*those: tuple[str, float]) -> TextLine:
    return TextLine((), tuple(TextLook(text, (sure,) * len(text)) for text, sure in those))


def test_three_looks_that_agree_on_a_date_are_surer_than_one_and_nothing_may_contradict_them() -> None:
    day, other, cut = "2021.10.08", "2021.10.06", "2021.10"
    agreed = looks((day, 0.7), (cut, 0.9), (day, 0.8), (day, 0.6))
    assert told(DOTS, agreed) == [(date(2021, 10, 8), 0.94)]
    assert told(DOTS, looks((day, 0.7), (day, 0.8))) == [(date(2021, 10, 8), 0.8)]
    assert told(DOTS, looks(*[(day, 0.99)] * 3, (other, 0.3)))[0][1] == 0.0
    assert told(DOTS, looks(*[(day, 0.99)] * 2, *[(cut, 0.9)] * 2))[0][1] == 0.0
    repaired = looks(*[("2O21.10.08", 0.99)] * 4)
    assert told(DOTS, repaired)[0][1] < 0.9, "however many looks take a letter for the digit"


def test_a_lot_is_what_the_first_two_looks_say() -> None:
    assert told(LOT, looks(*[("LOT B1203", 0.7)] * 4)) == [("B1203", 0.7)]
    assert told(LOT, looks(("LOT B12", 0.9), *[("LOT B1203", 0.99)] * 3))[0][1] == 0.0


def test_another_look_is_worth_while_until_the_value_is_sure_or_nothing_is_found() -> None:
    def worth(*texts: str, sure: float = 0.99, pattern: LabelTextConfig = DOTS) -> bool:
        return worth_another([TextLook(text, (sure,) * len(text)) for text in texts], (pattern,))

    assert worth("2021.10.08")
    assert not worth("2021.10.08", "2021.10.08")
    assert worth("2021.10.08", "2021.10.08", sure=0.6)
    assert worth("2021.10.08", "2021.10.0B")
    assert not worth("CHOCOLATE")
    assert worth("2O2I..1008")  # dots that were not seen together, perhaps
    assert not worth(*["2O2I..1008"] * 3)
    assert not worth("LOT 22345 X", pattern=LOT)
    assert worth("LOT B1203", pattern=LOT)
    assert not worth(*["LOT B1203"] * 2, sure=0.6, pattern=LOT)


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
    assert told(LOT, replace(line("LOT B1203", "LOT B1203"), glare=0.5)) == [("B1203", 0.8662)]


def test_what_glare_may_have_changed_at_an_open_end_is_sure_to_nobody() -> None:
    day = replace(line("EXP 18.09.2020", "EXP 18.09.2020", right=True), glare=0.2)  # 2026, in truth
    assert told(EXPIRY, day) == [(date(2020, 9, 18), 0.0)]
    assert told(EXPIRY, replace(day, open_right=False))[0][1] > 0.9
    assert told(EXPIRY, replace(day, glare=0.05))[0][1] > 0.9


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
