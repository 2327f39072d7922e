"""What a label says stays a text in a spreadsheet, and comes back exactly."""

from __future__ import annotations

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


@pytest.mark.parametrize("text", ["", "PAL-000123/L07", "0109501101530003", "'quoted'", "A=1", " =1"])
def test_usual_codes_are_written_as_they_are(text: str) -> None:
    assert inert(text) == text == exact(text)
