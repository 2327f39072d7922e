"""What lines of printed text say of the goods, by the site's patterns: only what can mean one thing.

O and 0, I, l and 1 are the same in many fonts: each is read as any of them, and where more than one reading
fits a pattern, none is believed.  Where one does, it is meant (`L0T 401` is `LOT 401`); a value that had to
be read so itself is less sure.
"""

from __future__ import annotations

import calendar
import re
from collections.abc import Iterator, Sequence
from datetime import date, datetime
from decimal import Decimal
from itertools import product
from typing import Final

from flightd.config.label_text import LabelTextConfig
from flightd.core.label_text import TextLine, TextLook
from flightd.core.label_values import LabelValue, Told, ValueKind, ValueSource, told_text

_ALIKE: Final = {character: group for group in ("O0", "Il1") for character in group}
_MOST_READINGS: Final = 4096
_REPAIRED: Final = 0.85
"""Part of its confidence that a value keeps in which a character was taken for one that looks like it: a cut
J was read as an I, a 9 in glare as an O."""
_LOST_TO_GLARE: Final = 0.2
"""And that it loses in a line that is burnt out altogether: what is left of a 9 is a 0."""
_LONGEST: Final = 120
"""Characters of a line; what is longer is no line of a label."""


def text_values(lines: Sequence[TextLine], patterns: Sequence[LabelTextConfig]) -> tuple[LabelValue, ...]:
    """What the lines say, each value once with its confidence: that of the least sure of its characters in
    the surest of the looks, which must all say the same, whole; else 0, and what one of them says."""
    found: dict[tuple[ValueKind, Told], LabelValue] = {}
    for pattern in patterns:
        for line in lines:
            value = _value(line, pattern)
            if value is not None:
                key = value.kind, value.value
                found[key] = max(found.get(key, value), value, key=lambda v: v.confidence)
    return tuple(found.values())


def says_something(look: TextLook, patterns: Sequence[LabelTextConfig]) -> bool:
    """Whether a look at a line has a value for one of the patterns, however unsure: without one no other look
    makes the line sure."""
    alone = TextLine(((0.0, 0.0),) * 4, (look,))
    return any(_read(look, alone, pattern)[0] is not None for pattern in patterns)


def _value(line: TextLine, pattern: LabelTextConfig) -> LabelValue | None:
    told = [_read(look, line, pattern) for look in line.looks]
    values = {value for value, _ in told if value is not None}
    if not values:
        return None
    agreed = len(values) == 1 and all(value is not None for value, _ in told)
    confidence = max(sure for _, sure in told) if agreed and min(sure for _, sure in told) > 0.0 else 0.0
    first = next(value for value, _ in told if value is not None)
    return LabelValue(ValueKind(pattern.kind), told_text(first), "", ValueSource.TEXT, round(confidence, 4))


def _read(look: TextLook, line: TextLine, pattern: LabelTextConfig) -> tuple[Told | None, float]:
    """The value of one look with the probability of its least sure character; 0 where it can mean something
    else, or may go on beyond what was read."""
    if len(look.text) > _LONGEST:
        return None, 0.0
    meant: dict[Told, tuple[int, int, str]] = {}
    searched = re.compile(pattern.pattern)
    spaced = _readings(look.text)
    if spaced is None:
        return None, 0.0
    for reading in spaced:
        match = searched.search(reading)
        if match is not None and not _goes_on(reading, match):
            for value in _meanings(match[1], pattern):
                meant.setdefault(value, (*match.span(1), match[1]))
    if not meant:
        return None, 0.0
    value, (start, end, reading) = next(iter(meant.items()))
    more_right = (line.gap or (line.open_right and end == len(look.text))) and _fits_longer(
        look.text, end, pattern
    )
    more_left = line.open_left and start == 0 and _fits_longer(look.text, 0, pattern)
    if len(meant) > 1 or more_right or more_left:
        return value, 0.0
    part = (_REPAIRED if look.text[start:end] != reading else 1.0) * (1.0 - _LOST_TO_GLARE * line.glare)
    touching = look.text[end : end + 1].strip()  # what is left of another character of the value, perhaps
    return value, min(look.sure[start : end + len(touching)]) * part


def _readings(text: str) -> Iterator[str] | None:
    """Every text that looks like this one, itself first; None where there are too many."""
    choices = [character + _ALIKE.get(character, "").replace(character, "") for character in text]
    count = 1
    for choice in choices:
        count *= len(choice)
    return None if count > _MOST_READINGS else map("".join, product(*choices))


def _goes_on(text: str, match: re.Match[str]) -> bool:
    """Whether the value is a part of a longer word."""
    start, end = match.span(1)
    before = start > 0 and match.start() == start and text[start - 1].isalnum()
    return before or (end < len(text) and text[end].isalnum())


def _fits_longer(text: str, at: int, pattern: LabelTextConfig) -> bool:
    """Whether the pattern takes a value that goes on beyond an end of the line, at `at`."""
    for more in "A1":
        match = re.search(pattern.pattern, text[:at] + more + text[at:])
        start, end = match.span(1) if match else (0, 0)
        if match and start <= at < end and _meanings(match[1], pattern):
            return True
    return False


def _meanings(text: str | None, pattern: LabelTextConfig) -> set[Told]:
    """What the group of a pattern can be; several for a date that its formats take differently."""
    bare = (text or "").strip()
    if pattern.is_date:
        return {day for form in pattern.dates if (day := _day(bare, form)) is not None}
    if ValueKind(pattern.kind) is ValueKind.QUANTITY:
        return {Decimal(bare)} if bare.isascii() and bare.isdecimal() else set()
    return {bare} if bare else set()


def _day(text: str, form: str) -> date | None:
    try:
        found = datetime.strptime(text, form).date()  # noqa: DTZ007 - a date alone
    except ValueError:
        return None
    if "%d" in form or "%j" in form:
        return found
    return found.replace(day=calendar.monthrange(found.year, found.month)[1])
