"""GS1 element strings: split at the right places, nothing accepted that is wrong."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.vision.shelf.gs1 import FNC1, Gs1Error, check_digit, has_check_digit, parse_element_string


@pytest.mark.parametrize(
    ("text", "elements"),
    [
        ("0109501101530003", (("01", "09501101530003"),)),
        ("00395011010013000129", (("00", "395011010013000129"),)),
        ("01095011015300031725010110AB-123", (("01", "09501101530003"), ("17", "250101"), ("10", "AB-123"))),
        (f"10AB{FNC1}21XY", (("10", "AB"), ("21", "XY"))),
        (f"{FNC1}0109501101530003", (("01", "09501101530003"),)),
        ("3103001750", (("3103", "001750"),)),
        (f"3922123{FNC1}37{'12'}", (("3922", "123"), ("37", "12"))),
        ("4109501101530003", (("410", "9501101530003"),)),
        (f"2539501101530003SER{FNC1}422528", (("253", "9501101530003SER"), ("422", "528"))),
        (f"800395011015300032{FNC1}", None),
    ],
)
def test_element_strings(text: str, elements: tuple[tuple[str, str], ...] | None) -> None:
    if elements is None:
        with pytest.raises(Gs1Error):
            parse_element_string(text)
    else:
        assert parse_element_string(text) == elements


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("", "empty"),
        ("0109501101530004", "check digit"),
        ("010950110153000", "length"),
        ("17251301", "no date"),
        ("10" + "A" * 21, "length"),
        ("10A B", "character"),
        (f"10{FNC1}21X", "length"),
        ("0512", "no application identifier"),
        ("31X3001750", "no application identifier"),
    ],
)
def test_what_is_wrong_is_refused_with_its_reason(text: str, word: str) -> None:
    with pytest.raises(Gs1Error, match=word):
        parse_element_string(text)


def test_check_digits_of_printed_numbers() -> None:
    for number in ("9780679601050", "036602301467", "96385074", "09501101530003", "106141412345678908"):
        assert has_check_digit(number)
        assert check_digit(number[:-1]) == int(number[-1])


@given(st.text("0123456789", min_size=17, max_size=17), st.integers(0, 16), st.integers(1, 9))
def test_one_wrong_digit_never_passes(body: str, place: int, off: int) -> None:
    number = body + str(check_digit(body))
    changed = number[:place] + str((int(number[place]) + off) % 10) + number[place + 1 :]
    assert has_check_digit(number)
    assert not has_check_digit(changed)


@given(st.text(max_size=60))
def test_any_text_parses_or_is_refused(text: str) -> None:
    try:
        elements = parse_element_string(text)
    except Gs1Error:
        return
    assert "".join(ai + value for ai, value in elements) == text.replace(FNC1, "")
