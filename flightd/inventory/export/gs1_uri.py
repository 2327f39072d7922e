"""GS1 keys as URIs: canonical GS1 Digital Links, as EPCIS 2.0 and its vocabulary (CBV 2.0) have them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

from flightd.core.types import CodeRead
from flightd.vision.shelf.digital_link import digital_link, elements_of, link_elements
from flightd.vision.shelf.gs1 import Elements, Gs1Error, check_element, parse_element_string

_GTIN: Final = {"EAN-13": 13, "EAN-8": 8, "UPC-A": 12, "UPC-E": 12, "ITF-14": 14}
_LOCATION, _EXTENSION = "414", "254"
_SERIALS: Final = {"01": ("21",), "8006": ("21",), "8010": ("8011",)}
"""Keys of a class, with the qualifier that makes one thing of it."""
_BATCHES: Final = {"01": ("10",), "8006": ("10",)}
_SERIAL_BEHIND: Final = {"8003": 14, "253": 13, "255": 13}
"""Keys with a serial number behind so many digits; without it they are a class."""
_THINGS: Final = ("00", "8004", "8018", "8017", "402", "401")
_BRACKETED: Final = re.compile(r"\((\d{2,4})\)([^(]+)")


def item_uri(read: CodeRead) -> tuple[str, bool] | None:
    """The URI of what a code names, and whether it names a class rather than one thing; None for a code that
    names neither."""
    elements = dict(elements_of(read))
    for key in _THINGS:
        if key in elements:
            return digital_link((key, elements[key])), False
    for key, digits in _SERIAL_BEHIND.items():
        if key in elements:
            return digital_link((key, elements[key])), len(elements[key]) == digits
    for key, qualifiers in _SERIALS.items():
        if key in elements:
            if (one := _with(key, qualifiers, elements)) is not None:
                return one, False
            batch = _with(key, _BATCHES.get(key, ()), elements)
            return batch or digital_link((key, elements[key])), True
    if len(read.text) == _GTIN.get(read.symbology) and read.text.isdecimal():
        return digital_link(("01", read.text.zfill(14))), True
    return None


def location_uri(elements: Elements) -> str | None:
    """The URI of the location that a label names by its GLN (414), with the extension (254) if it has one;
    None for elements that say something else or more."""
    told = dict(elements)
    if _LOCATION not in told or not told.keys() <= {_LOCATION, _EXTENSION}:
        return None
    extension = [(_EXTENSION, told[_EXTENSION])] if _EXTENSION in told else []
    return digital_link((_LOCATION, told[_LOCATION]), *extension)


def location_code_uri(code: str) -> str | None:
    """The URI of a location whose code in the site file is a GLN: as an element string with or without
    brackets, or a Digital Link; None for any other code."""
    bracketed = tuple(_BRACKETED.findall(code))
    if bracketed and "".join(f"({ai}){value}" for ai, value in bracketed) == code:
        return location_uri(bracketed) if _all_hold(bracketed) else None
    try:
        elements = parse_element_string(code)
    except Gs1Error:
        elements = link_elements(code)
    return location_uri(elements)


def place_in(gln: str, code: str) -> str:
    """The URI of a place of the site `gln`, the location's code as the extension.  Gs1Error where one of them
    cannot be such."""
    check_element(_LOCATION, gln)
    check_element(_EXTENSION, code)
    return digital_link((_LOCATION, gln), (_EXTENSION, code))


def _with(key: str, qualifiers: tuple[str, ...], elements: Mapping[str, str]) -> str | None:
    """The URI with the first of the qualifiers that there is."""
    found = next((ai for ai in qualifiers if ai in elements), None)
    return digital_link((key, elements[key]), (found, elements[found])) if found else None


def _all_hold(elements: Elements) -> bool:
    try:
        for ai, value in elements:
            check_element(ai, value)
    except Gs1Error:
        return False
    return True
