"""When two texts are the same code: one pure relation for search, comparison and upload.

The same code is written in many ways: as the reader gives it, with FNC1 as ASCII 29 or a printed stand-in,
with its application identifiers in parentheses, as a GS1 Digital Link URI, as a bare number with or without
leading zeros, in the groups that are printed below the bars.  What names the thing is compared, not what is
said of it besides: an SSCC is one logistic unit whatever content and count its label adds, article and serial
number are one item whatever its batch, an article with a batch is another thing than the article alone.

Source: GS1 General Specifications, sections 2 (keys), 3 (identifiers), 7.9 (check digit); GS1 Digital Link
Standard: URI Syntax, section 4 (primary keys and their qualifiers).

Numbers are keys only where their check digit holds; anything else is compared as it is, but for its case,
which spreadsheets and warehouse systems change.  The serials and batches of an article keep theirs: there,
`a` and `A` are two things.
"""

from __future__ import annotations

import re

from flightd.vision.shelf.digital_link import link_elements
from flightd.vision.shelf.gs1 import FNC1, Elements, Gs1Error, has_check_digit, parse_element_string

_AIM = re.compile(r"^\][A-Za-z][0-9A-Za-z]")
"""A symbology identifier, which scanners may put before the text (ISO/IEC 15424)."""
_STAND_INS = re.compile(
    r"<GS>|\{GS\}|\[GS\]|<FNC1>|\{FNC1\}|\[FNC1\]|\\x1d|\\u001d|\N{SYMBOL FOR GROUP SEPARATOR}|\^\]",
    re.IGNORECASE,
)
_PARENTHESISED = re.compile(r"\(\d{2,4}\)")
_ELEMENT = re.compile(r"\((\d{2,4})\)")
_GTIN_DIGITS = range(8, 15)
_SSCC_DIGITS = 18
_QUALIFIERS = ("22", "10", "21")
"""Of an article (01): variant, batch, serial number."""
_LONGEST = 2048


def code_key(text: str) -> str:
    """The same for the same code, another one for another; for comparing, not for people."""
    bare = _AIM.sub("", text.strip())
    if len(bare) > _LONGEST:
        return f"text:{bare.casefold()}"
    marked = _STAND_INS.sub(FNC1, bare)
    number = _number(marked)
    if number is not None:
        return number
    elements = _elements(marked)
    if elements:
        return _named(elements)
    return f"text:{marked.strip(FNC1).casefold()}"


def _elements(text: str) -> Elements:
    """The GS1 elements in it, by whatever notation it is in; none where it has none."""
    if "://" in text[:8]:
        return link_elements(text)
    if _PARENTHESISED.match(text):
        return _parsed(_without_parentheses(text))
    found = _parsed(text)
    # without a mark of its structure, one element of no key looks like any number
    return found if len(found) > 1 or FNC1 in text or dict(found).keys() & {"00", "01"} else ()


def _parsed(text: str) -> Elements:
    try:
        return parse_element_string(text)
    except Gs1Error:
        return ()


def _without_parentheses(text: str) -> str:
    """The element string, a separator behind each element: it does no harm where none is needed."""
    parts = _ELEMENT.split(text.replace(FNC1, ""))
    pairs = zip(parts[1::2], parts[2::2], strict=True)
    return "".join(f"{ai}{value.replace(' ', '')}{FNC1}" for ai, value in pairs)


def _named(elements: Elements) -> str:
    """The key of what the elements name."""
    values = dict(elements)
    if "00" in values:
        return f"gs1:(00){values['00']}"
    if "01" in values:
        qualifiers = [(ai, values[ai]) for ai in _QUALIFIERS if ai in values]
        # a serial number makes it one item, whatever variant and batch that is of
        named = [pair for pair in qualifiers if pair[0] == "21"] or qualifiers
        return f"gs1:(01){values['01']}" + "".join(f"({ai}){value}" for ai, value in named)
    if len(elements) == 1:
        data = "".join(elements[0])
        return _number(data) or f"text:{data.casefold()}"
    return "gs1:" + "".join(f"({ai}){value}" for ai, value in sorted(elements))


def _number(text: str) -> str | None:
    """The key of a bare SSCC or GTIN, also in the groups that are printed; None for any other text."""
    digits = text.replace(" ", "")
    if not digits.strip("0") or not has_check_digit(digits):
        return None
    if len(digits) == _SSCC_DIGITS:
        return f"gs1:(00){digits}"
    return f"gs1:(01){digits.zfill(14)}" if len(digits) in _GTIN_DIGITS else None
