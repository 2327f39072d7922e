"""Texts of labels as warehouses print them, all different within one site."""

from __future__ import annotations

from flightd.vision.shelf.gs1 import check_digit

_COMPANY = "4012345"
"""A GS1 company prefix."""
_MANY = 10**6
_STEP = 618_033
"""Prime to a million: numbers that follow each other lie far apart."""


class Numbers:
    """Six-digit numbers for the places of one site, two for each, none twice in half a million places."""

    def __init__(self, seed: int) -> None:
        self._offset = (seed * 7_919) % _MANY

    def of(self, place: int) -> tuple[int, int]:
        first, second = 2 * place, 2 * place + 1
        return self._scattered(first), self._scattered(second)

    def _scattered(self, number: int) -> int:
        return (number * _STEP + self._offset) % _MANY


def sscc(serial: int) -> str:
    """The GS1 number of a logistic unit (SSCC), as an element."""
    digits = f"3{_COMPANY}{serial:09}"
    return f"(00){digits}{check_digit(digits)}"


def gtin_13(serial: int) -> str:
    """An article number (GTIN-13), as an EAN-13 carries it."""
    digits = f"40{serial:06}1234"
    return f"{digits}{check_digit(digits)}"


def gtin_with_serial(serial: int) -> str:
    """Article and serial number, as GS1 elements."""
    digits = f"0{_COMPANY}{serial % 100_000:05}"
    return f"(01){digits}{check_digit(digits)}(21){serial:06}"


def lot(serial: int) -> str:
    """A batch number, as a GS1 element."""
    return f"(10){serial:06}"


def own_number(serial: int) -> str:
    """A warehouse's own number of a pallet."""
    return f"P{serial:06}"


def pallet_name(serial: int) -> str:
    """A warehouse's own name of a pallet, with its batch."""
    return f"PAL-{serial:06}/L{serial % 97:02}"
