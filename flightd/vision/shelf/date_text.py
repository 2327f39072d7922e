"""Dates in lines of printed text: what may touch them, and which separators say the same.

Printers put a date beside other things (`E10/08/2021`, `10/08/2021A12:16`), and reading loses or adds spaces
and dots (`2020 12.03`, `2021. 10 .08`).  None of that changes a digit.
"""

from __future__ import annotations

import calendar
import re
from dataclasses import dataclass
from datetime import date, datetime
from functools import cache
from typing import Final

_YEARS: Final = range(2000, 2100)
"""Of goods; a date of another year is no date, or misread."""
_DIGITS: Final = {"d": 2, "m": 2, "y": 2, "Y": 4, "j": 3}
_SEPARATORS: Final = {" ": "[ .,·]{0,2}", ".": "[ .,·•-]{0,3}", "/": " ?/ ?", "-": " ?[-.] ?", "": " ?"}
"""What may be read for each: spaces have no ink, and a dot has little."""
_A_YEAR: Final = re.compile(r"20\d\d")
_DOTS: Final = str.maketrans(",·•", "...")
_ONE_STROKE: Final = frozenset("OQDIl|")
_LIKE_DIGITS: Final = _ONE_STROKE | frozenset("LZSBGTAoizsbgq")


def day_of(text: str, form: str) -> date | None:
    """The date that a text is in this format, the last of its month without a day; None if it is none."""
    try:
        found = datetime.strptime(text, form).date()  # noqa: DTZ007 - a date alone
    except ValueError:
        return None
    if found.year not in _YEARS:
        return None
    if "%d" in form or "%j" in form:
        return found
    return found.replace(day=calendar.monthrange(found.year, found.month)[1])


def date_goes_on(before: str, text: str, after: str, form: str) -> bool:
    """Whether a date may have more characters in what stands `before` and `after` it: another digit, or what
    looks like one.  A year of four digits is whole, one of two may be cut short, though not by one alone."""
    like_digits = _ONE_STROKE if has_whole_year(form) else _LIKE_DIGITS
    for neighbour, edge in ((before[-1:], text[:1]), (after[:1], text[-1:])):
        if neighbour.isdigit() or (neighbour.isalnum() and not edge.isdigit()):
            return True
    lone = after[1:2] and not after[1:2].isalnum()  # `15FEB22B 09:07`: no year has three digits
    return before[-1:] in like_digits or (after[:1] in like_digits and not lone)


def has_whole_year(form: str) -> bool:
    """Whether dates in this format have years of four digits."""
    return "%Y" in form


@dataclass(frozen=True, slots=True)
class RespacedDate:
    """A date whose separators were read otherwise: where it stands in its line, how its format writes it, and
    whether one of its separators was not read at all."""

    start: int
    end: int
    shown: str
    lost: bool


def respaced(text: str, form: str) -> RespacedDate | None:
    """The first such date in a line.  Where all is digits, one separator at least is as the format has it: by
    another one they may mean another order.  Beside a month's name none is lost: `NOV 2021` is no day."""
    parts = _parts(form)
    between = [at for at in range(1, len(parts)) if {parts[at - 1][1], parts[at][1]} <= _DIGITS.keys()]
    for match in _loosely(form).finditer(text):
        gaps = [match[f"gap{at}"].translate(_DOTS) for at in between]
        lost = any(parts[at][0] and not gap for at, gap in zip(between, gaps, strict=True))
        as_written = any(gap and parts[at][0] in gap for at, gap in zip(between, gaps, strict=True))
        shown = "".join(literal + match[f"field{at}"] for at, (literal, _) in enumerate(parts))
        if len(between) == len(parts) - 1:
            believed = as_written
        else:
            believed = not lost and (has_whole_year(form) or not _A_YEAR.search(shown))
        if believed:
            return RespacedDate(match.start(), match.end(), shown, lost)
    return None


def _parts(form: str) -> list[tuple[str, str]]:
    """Each directive's letter with what stands before it."""
    return re.findall(r"([^%]*)%(.)", form)


@cache
def _loosely(form: str) -> re.Pattern[str]:
    """What a date of this format may be read as."""
    found = ""
    for at, (literal, letter) in enumerate(_parts(form)):
        digits = _DIGITS.get(letter)
        found += f"(?P<gap{at}>{_SEPARATORS.get(literal, re.escape(literal))})" if at else re.escape(literal)
        found += f"(?P<field{at}>" + (rf"\d{{{digits}}}" if digits else "[A-Za-z]+") + ")"
    return re.compile(rf"(?<!\d)(?<!\d[.,/-]){found}(?!\d)(?![.,/-]\d)", re.ASCII)
