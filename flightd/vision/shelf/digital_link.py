"""GS1 Digital Links: web addresses that carry GS1 keys, as QR codes on labels do.

Source: GS1 Digital Link Standard, URI Syntax 1.4: any domain and leading path, then /KEY/VALUE and the key's
qualifiers in the path, further elements in the query.  The compressed form is not read.
"""

from __future__ import annotations

from typing import Final
from urllib.parse import parse_qsl, quote, unquote, urlsplit

from flightd.core.types import CodeRead
from flightd.vision.shelf.gs1 import Elements, Gs1Error, check_element

_QUALIFIERS: Final = {
    "00": (),
    "01": ("22", "10", "21", "235"),
    "253": (),
    "255": (),
    "401": (),
    "402": (),
    **{f"{party}": () for party in (410, 411, 412, 413, 415, 416, 417)},
    "414": ("254",),
    "8003": (),
    "8004": (),
    "8006": ("22", "10", "21"),
    "8010": ("8011",),
    "8017": ("8019",),
    "8018": ("8019",),
}
"""The primary keys, and what may stand behind each of them in the path, in this order."""
_NAMES: Final = {"gtin": "01", "sscc": "00", "cpv": "22", "lot": "10", "ser": "21"}
"""Which the first versions of the standard let stand for identifiers."""
_GTIN_DIGITS: Final = 14
_SHORT_GTINS: Final = frozenset((8, 12, 13))
_RESOLVER: Final = "https://id.gs1.org"


def parse_digital_link(text: str) -> Elements:
    """The elements of a GS1 Digital Link, the key first; empty for a text that is none.

    Raises Gs1Error for one whose key has the form of its kind but a check digit that does not hold, or whose
    other elements are not what their identifiers demand.
    """
    try:
        address = urlsplit(text)
    except ValueError:
        return ()
    if address.scheme.lower() not in {"http", "https"} or not address.netloc:
        return ()
    parts = [part for part in address.path.split("/") if part]
    for start, name in enumerate(parts[:-1]):
        ai = _identifier(name)
        qualifiers = _pairs(parts[start + 2 :])
        if ai not in _QUALIFIERS or qualifiers is None or not _in_order(qualifiers, _QUALIFIERS[ai]):
            continue
        value = _padded(ai, unquote(parts[start + 1]))
        if not _has_form(ai, value):
            continue
        asked = ((_identifier(name), told) for name, told in parse_qsl(address.query))
        attributes = tuple((name, told) for name, told in asked if name.isdecimal())
        elements = ((ai, value), *qualifiers, *attributes)
        for identifier, told in elements:
            check_element(identifier, told)
        return elements
    return ()


def elements_of(read: CodeRead) -> Elements:
    """The GS1 elements of a read; those of a Digital Link that was counted as a plain text, too."""
    return read.gs1 or link_elements(read.text)


def link_elements(text: str) -> Elements:
    """The elements of a Digital Link; none of a text that is none, or of one that is damaged."""
    try:
        return parse_digital_link(text)
    except Gs1Error:
        return ()


def digital_link(*elements: tuple[str, str]) -> str:
    """The canonical address of a key and its qualifiers, by the resolver of GS1."""
    return "/".join([_RESOLVER, *(f"{ai}/{quote(value, safe='')}" for ai, value in elements)])


def _pairs(parts: list[str]) -> Elements | None:
    """Identifiers and values by turns; None for an odd number of parts."""
    if len(parts) % 2:
        return None
    return tuple(
        (_identifier(name), unquote(value)) for name, value in zip(parts[::2], parts[1::2], strict=True)
    )


def _identifier(name: str) -> str:
    return _NAMES.get(name.lower(), name)


def _in_order(qualifiers: Elements, allowed: tuple[str, ...]) -> bool:
    found = [ai for ai, _ in qualifiers]
    return found == [ai for ai in allowed if ai in found]


def _padded(ai: str, value: str) -> str:
    """Older links have GTINs of 8, 12 and 13 digits."""
    short = ai == "01" and len(value) in _SHORT_GTINS and value.isdecimal()
    return value.zfill(_GTIN_DIGITS) if short else value


def _has_form(ai: str, value: str) -> bool:
    """Whether a path's part may be such a key at all, whatever its check digit says."""
    try:
        check_element(ai, value, with_check_digit=False)
    except Gs1Error:
        return False
    return True
