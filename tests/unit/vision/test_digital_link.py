"""GS1 Digital Links: the elements of an address that is one, and nothing of any other address."""

from __future__ import annotations

import string

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.vision.shelf.digital_link import digital_link, parse_digital_link
from flightd.vision.shelf.gs1 import Gs1Error, check_digit

GTIN = "09501101530003"


@pytest.mark.parametrize(
    ("text", "elements"),
    [
        (f"https://id.gs1.org/01/{GTIN}", (("01", GTIN),)),
        (f"HTTPS://ID.GS1.ORG/01/{GTIN}/21/X1", (("01", GTIN), ("21", "X1"))),
        (
            f"http://shop.example:8080/a/b/01/{GTIN}/10/B%2F1/21/S-1?17=251231&linkType=all#top",
            (("01", GTIN), ("10", "B/1"), ("21", "S-1"), ("17", "251231")),
        ),
        ("https://example.com/01/9501101530003", (("01", GTIN),)),
        ("https://example.com/00/395011010013000129", (("00", "395011010013000129"),)),
        ("https://example.com/414/9501101530003/254/A-01", (("414", "9501101530003"), ("254", "A-01"))),
        (f"https://example.com/8003/{GTIN}77?3103=000500", (("8003", f"{GTIN}77"), ("3103", "000500"))),
    ],
)
def test_a_link_gives_its_elements(text: str, elements: tuple[tuple[str, str], ...]) -> None:
    assert parse_digital_link(text) == elements


@pytest.mark.parametrize(
    "text",
    [
        "PALLET-1",
        GTIN,
        "https://example.com/",
        "https://example.com/product/1234",
        "https://example.com/01/abc",
        f"https://example.com/01/{GTIN}/21",
        f"https://example.com/01/{GTIN}/21/X/10/B",
        f"https://example.com/10/B/01x/{GTIN}",
        f"ftp://id.gs1.org/01/{GTIN}",
        f"https:///01/{GTIN}",
        "https://[half/01/x",
    ],
)
def test_any_other_text_gives_none(text: str) -> None:
    assert parse_digital_link(text) == ()


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("https://id.gs1.org/01/09501101530004", "check digit"),
        (f"https://id.gs1.org/01/{GTIN}?17=251399", "no date"),
        (f"https://id.gs1.org/01/{GTIN}?05=1", "no application identifier"),
        (f"https://id.gs1.org/01/{GTIN}/21/{'S' * 21}", "length"),
        (f"https://id.gs1.org/01/{GTIN}/21/S%201", "character"),
    ],
)
def test_a_link_with_a_mistake_says_which(text: str, word: str) -> None:
    with pytest.raises(Gs1Error, match=word):
        parse_digital_link(text)


_MARKS = "!\"%&'()*+,-./:;<=>?_"
_SERIAL = st.text(string.ascii_letters + string.digits + _MARKS, min_size=1, max_size=20)


@given(st.text("0123456789", min_size=13, max_size=13), _SERIAL)
def test_what_is_written_is_read_again(digits: str, serial: str) -> None:
    elements = (("01", f"{digits}{check_digit(digits)}"), ("21", serial))
    assert parse_digital_link(digital_link(*elements)) == elements


@given(st.text())
def test_no_text_is_too_odd(text: str) -> None:
    for tried in (text, f"https://{text}", f"https://a/01/{text}"):
        try:
            parse_digital_link(tried)
        except Gs1Error:
            continue
