"""Which texts are the same code, and which are not: the table that search, comparison and upload go by."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.vision.shelf.code_equality import code_key
from flightd.vision.shelf.gs1 import FNC1, check_digit

SSCC = "340123450002439853"
GTIN_14, GTIN_13, GTIN_12 = "04006381333931", "4006381333931", "614141000036"
CASE_14 = "14006381333938"
"""A case of GTIN_13: another article."""

EQUAL = [
    # as it is, and as people and spreadsheets change it
    ("PAL-424315/L37", "PAL-424315/L37"),
    ("PAL-424315/L37", "pal-424315/l37"),
    (" P506295\t", "P506295"),
    ("straße-7", "STRASSE-7"),
    ("10ABC", "10abc"),
    # SSCC, with and without its identifier
    (SSCC, f"00{SSCC}"),
    (SSCC, f"(00){SSCC}"),
    (f"00{SSCC}", f"(00){SSCC}"),
    (f"00{SSCC}", f"{FNC1}00{SSCC}"),
    (f"00{SSCC}", f"]C100{SSCC}"),
    (SSCC, "3 4012345 000243985 3"),
    (SSCC, "(00) 3 4012345 000243985 3"),
    (SSCC, f"https://id.gs1.org/00/{SSCC}"),
    (SSCC, f"(00){SSCC}(02){GTIN_14}(37)24"),
    (f"(02){GTIN_14}(37)24(00){SSCC}", f"00{SSCC}"),
    # GTIN, with leading zeros and without
    (GTIN_13, GTIN_14),
    (GTIN_12, f"0{GTIN_12}"),
    (GTIN_12, f"00{GTIN_12}"),
    ("96385074", "00000096385074"),
    ("012345678905", "12345678905"),
    (GTIN_13, "4 006381 333931"),
    (GTIN_13, f"]E0{GTIN_13}"),
    (GTIN_13, f"01{GTIN_14}"),
    (GTIN_13, f"(01){GTIN_14}"),
    (GTIN_12, f"(01)00{GTIN_12}"),
    (GTIN_13, f"(01){GTIN_14}(17)261231"),
    (GTIN_13, f"(01){GTIN_14}(3103)001250(15)261231"),
    (GTIN_13, f"https://id.gs1.org/01/{GTIN_14}"),
    (GTIN_13, f"https://shop.example/products/01/{GTIN_14}"),
    (GTIN_13, f"http://example.com/gtin/{GTIN_13}"),
    (GTIN_13, f"HTTPS://ID.GS1.ORG/01/{GTIN_14}"),
    (GTIN_13, f"https://id.gs1.org/01/{GTIN_14}?17=261231&linkType=gs1:pip"),
    # article with batch or serial
    (f"01{GTIN_14}10AB-1", f"(01){GTIN_14}(10)AB-1"),
    (f"01{GTIN_14}10AB-1{FNC1}17261231", f"(01){GTIN_14}(17)261231(10)AB-1"),
    (f"01{GTIN_14}10AB-1{FNC1}", f"01{GTIN_14}10AB-1"),
    (f"01{GTIN_14}10AB-1<GS>21S7", f"01{GTIN_14}10AB-1{FNC1}21S7"),
    (f"01{GTIN_14}10AB-1{{GS}}21S7", f"01{GTIN_14}10AB-1^]21S7"),
    (f"01{GTIN_14}10AB-1\N{SYMBOL FOR GROUP SEPARATOR}21S7", f"(01){GTIN_14}(21)S7"),
    (f"(01){GTIN_14}(21)S7(10)AB-1", f"(10)AB-1(01){GTIN_14}(21)S7"),
    (f"]d201{GTIN_14}21S7", f"https://id.gs1.org/01/{GTIN_14}/21/S7"),
    (f"(01){GTIN_14}(10)A/1", f"https://id.gs1.org/01/{GTIN_14}/10/A%2F1"),
    (f"(01){GTIN_14}(10)AB-1(21)S7", f"https://id.gs1.org/01/{GTIN_14}/10/AB-1/21/S7"),
    (f"(01){GTIN_14}(21)S7", f"https://example.com/gtin/{GTIN_14}/ser/S7"),
    (f"(01){GTIN_14}(10)AB-1", f"https://id.gs1.org/01/{GTIN_14}?10=AB-1"),
    ("(01) 0 4006381 33393 1 (21) S7", f"01{GTIN_14}21S7"),
    # elements that are no key
    ("10952183", "(10)952183"),
    ("10952185", "(10)952185"),
    ("(10)952183", f"{FNC1}10952183"),
    ("1726123110AB", "(17)261231(10)AB"),
    (f"10AB{FNC1}17261231", "(17)261231(10)AB"),
    ("(414)4012345000009", "4144012345000009"),
    ("(414)4012345000009(254)7", "https://id.gs1.org/414/4012345000009/254/7"),
    # addresses
    ("https://Example.com/p/7", "https://example.com/P/7"),
]

UNEQUAL = [
    ("P506295", "P506296"),
    ("P506295", "P50629"),
    ("PAL 1", "PAL1"),
    ("PAL-1", "PAL_1"),
    ("0012345", "12345"),
    ("000123", "123"),
    ("4006381333932", "04006381333932"),
    ("00000000", "00000000000000"),
    ("12345", "1234 5"),
    ("A-1", "A-01"),
    ("", "0"),
    (SSCC, "340123450004800514"),
    (SSCC, f"01{SSCC}"),
    (SSCC, SSCC[:-1]),
    (f"(00){SSCC}", "(00)340123450002439854"),
    ("340123450002439854", "00340123450002439854"),
    (SSCC, f"(01){GTIN_14}"),
    (GTIN_13, CASE_14),
    (GTIN_13, GTIN_12),
    (GTIN_13, "4006381333948"),
    (GTIN_13, f"(02){GTIN_14}"),
    (GTIN_13, f"(01){GTIN_14}(10)AB-1"),
    (GTIN_13, f"(01){GTIN_14}(21)S7"),
    (f"(01){GTIN_14}(10)S7", f"(01){GTIN_14}(21)S7"),
    (f"(01){GTIN_14}(21)s7", f"(01){GTIN_14}(21)S7"),
    (f"(01){GTIN_14}(10)ab", f"(01){GTIN_14}(10)AB"),
    (f"(01){GTIN_14}(21)S7", f"(01){GTIN_14}(21)S70"),
    (f"(01){GTIN_14}(21)S7", f"(01){CASE_14}(21)S7"),
    (f"(01){GTIN_14}(21)007", f"(01){GTIN_14}(21)7"),
    (f"01{GTIN_14}10AB21S7", f"(01){GTIN_14}(10)AB(21)S7"),
    (f"(10)AB{FNC1}(21)C", "10AB21C"),
    ("(10)952183", "(21)952183"),
    ("(10)952183", "952183"),
    (f"https://id.gs1.org/01/{GTIN_14}", f"https://id.gs1.org/01/{CASE_14}"),
    (f"https://id.gs1.org/01/{GTIN_14}", f"https://id.gs1.org/01/{GTIN_14}/21/S7"),
    (f"https://id.gs1.org/00/{SSCC}", f"https://id.gs1.org/01/{GTIN_14}"),
    ("https://example.com/01/4006381333932", "4006381333932"),
    (f"ftp://id.gs1.org/01/{GTIN_14}", GTIN_13),
    (f"https://example.com/{GTIN_14}", GTIN_13),
    ("https://example.com/01", "01"),
    ("https://[broken/01/4006381333931", GTIN_13),
    ("\N{ARABIC-INDIC DIGIT FOUR}006381333931", GTIN_13),
]


@pytest.mark.parametrize(("a", "b"), EQUAL)
def test_they_are_the_same_code(a: str, b: str) -> None:
    assert code_key(a) == code_key(b)


@pytest.mark.parametrize(("a", "b"), UNEQUAL)
def test_they_are_different_codes(a: str, b: str) -> None:
    assert code_key(a) != code_key(b)


@given(st.text())
def test_any_text_has_a_key_and_always_the_same(text: str) -> None:
    assert code_key(text) == code_key(text)


@given(st.integers(0, 10**17 - 1), st.integers(0, 10**17 - 1))
def test_two_units_are_never_one_in_whatever_notation(a: int, b: int) -> None:
    def sscc(serial: int) -> str:
        return f"{serial:017}{check_digit(f'{serial:017}')}"

    def writings(number: str) -> list[str]:
        return [number, f"00{number}", f"(00){number}", f"https://id.gs1.org/00/{number}"]

    if a:  # all zeros are no number of anything
        assert len({code_key(text) for text in writings(sscc(a))}) == 1
    for one in writings(sscc(a)):
        for other in writings(sscc(b)):
            assert (code_key(one) == code_key(other)) == (a == b) or not (a and b)
