"""What a label says stays a text in a spreadsheet, and comes back exactly."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.core.csv_text import exact, inert

TEXTS = st.text(st.sampled_from("'=+-@\t\r\nA1 ;\"") | st.characters(), max_size=12)


@given(TEXTS)
def test_every_text_comes_back_and_none_begins_a_formula(text: str) -> None:
    cell = inert(text)
    assert exact(cell) == text
    assert cell[:1] not in set("=+-@\t\r\n")
    for part in re.split(r"[;\t\r\n]", cell):  # as a program has it that takes another separator
        assert part.lstrip('"')[:1] not in set("=+-@")


@pytest.mark.parametrize(
    ("text", "cell"),
    [
        ("A;=1+2", "A;'=1+2"),
        ("A\t@x", "A\t'@x"),
        ('A;"=1', "A;'\"=1"),
        ("\t=1", "'\t'=1"),
        ("A;'-1", "A;''-1"),
    ],
)
def test_a_formula_behind_another_separator_is_none(text: str, cell: str) -> None:
    assert inert(text) == cell
    assert exact(cell) == text


def test_long_rows_of_signs_take_no_longer_than_they_are_long() -> None:
    assert exact(inert(";'" * 200_000)) == ";'" * 200_000


@pytest.mark.parametrize("text", ["", "PAL-000123/L07", "0109501101530003", "'quoted'", "A=1", " =1"])
def test_usual_codes_are_written_as_they_are(text: str) -> None:
    assert inert(text) == text == exact(text)
