"""Dates in lines of printed text: what may touch them, and which separators say the same.

Printers put a date beside other things (`E10/08/2021`, `10/08/2021A12:16`), and reading loses or adds spaces
and dots (`2021 0808`, `2021. 10 .08`).  None of that changes a digit.
"""

from __future__ import annotations

import calendar
import re
from dataclasses import dataclass
from datetime import date, datetime
from functools import cache
from typing import Final

_DIGITS: Final = {"d": 2, "m": 2, "y": 2, "Y": 4, "j": 3}
_SEPARATORS: Final = {" ": "[ .,·]{0,2}", ".": "[ .,·•]{0,3}", "/": " ?/ ?", "-": " ?[-–—] ?", "": " ?"}
"""What may be read for each: spaces have no ink, and a dot has little."""
_ONE_STROKE: Final = frozenset("OQDIl|")
_LIKE_DIGITS: Final = _ONE_STROKE | frozenset("LZSBGTAoizsbgq")


def day_of(text: str, form: str) -> date | None:
    """The date that a text is in this format, the last of its month without a day; None if it is none."""
    try:
        found = datetime.strptime(text, form).date()  # noqa: DTZ007 - a date alone
    except ValueError:
        return None
    if "%d" in form or "%j" in form:
        return found
    return found.replace(day=calendar.monthrange(found.year, found.month)[1])


def date_goes_on(before: str, text: str, after: str, form: str) -> bool:
    """Whether a character that touches a date may be a part of it: another digit, or what looks like one.  A
    year of four digits is whole, one of two may be cut short."""
    like_digits = _ONE_STROKE if "%Y" in form else _LIKE_DIGITS
    for neighbour, edge in ((before, text[:1]), (after, text[-1:])):
        if edge.isdigit() and (neighbour.isdigit() or neighbour in like_digits):
            return True
        if not edge.isdigit() and neighbour.isalnum():  # of a month's name
            return True
    return False


@dataclass(frozen=True, slots=True)
class RespacedDate:
    """A date whose separators were read otherwise: where it stands in its line, how its format writes it, and
    whether one of its separators was not read at all."""

    start: int
    end: int
    shown: str
    lost: bool


def respaced(text: str, form: str) -> RespacedDate | None:
    """The first such date in a line.  Of separators between digits one at least must have been read."""
    for match in _loosely(form).finditer(text):
        gaps = [said for name, said in match.groupdict().items() if name.startswith("gap")]
        if any(gaps) or not gaps:
            parts = _parts(form)
            shown = "".join(literal + match[f"field{at}"] for at, (literal, _) in enumerate(parts))
            return RespacedDate(match.start(), match.end(), shown, not all(gaps))
    return None


def _parts(form: str) -> list[tuple[str, str]]:
    """Each directive's letter with what stands before it."""
    return re.findall(r"([^%]*)%(.)", form)


@cache
def _loosely(form: str) -> re.Pattern[str]:
    """What a date of this format may be read as; one that begins or ends with a literal is its own."""
    found, left = "", ""
    for at, (literal, letter) in enumerate(_parts(form)):
        digits = _DIGITS.get(letter)
        if at:
            said = _SEPARATORS.get(literal, re.escape(literal))
            found += f"(?P<gap{at}>{said})" if digits and left in _DIGITS else said
        found += f"(?P<field{at}>" + (rf"\d{{{digits}}}" if digits else "[A-Za-z]+") + ")"
        left = letter
    return re.compile(rf"(?<!\d)(?<!\d[.,/-]){found}(?!\d)(?![.,/-]\d)", re.ASCII)
