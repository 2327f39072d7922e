"""What lines of printed text say of the goods, by the site's patterns: only what can mean one thing.

O and 0, I, l and 1 are the same in many fonts: each is read as any of them, and where more than one reading
fits a pattern, none is believed.  Where one does, it is meant (`L0T 401` is `LOT 401`); a value that had to
be read so itself is less sure.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date
from decimal import Decimal
from functools import lru_cache
from itertools import product
from typing import Final

from flightd.config.label_text import LabelTextConfig
from flightd.core.label_text import TextLine, TextLook
from flightd.core.label_values import (
    DATES,
    LEAST_TEXT_CONFIDENCE,
    LabelValue,
    Told,
    ValueKind,
    ValueSource,
    told_text,
)
from flightd.vision.shelf.date_text import date_goes_on, day_of, has_whole_year, respaced

_ALIKE: Final = {character: group for group in ("O0", "Il1") for character in group}
_MOST_READINGS: Final = 4096
_REPAIRED: Final = 0.85
"""Part of its confidence that a value keeps in which a character was taken for one that looks like it: a cut
J was read as an I, a 9 in glare as an O."""
_LOST_TO_GLARE: Final = 0.25
"""And that it loses in a line that is burnt out altogether: what is left of a 9 is a 0, of a Z a 7."""
_BURNT_END: Final = 0.2
"""Glare of a line in which no character at an open end is believed: a 6 there was told as a 0."""
_LONGEST: Final = 120
"""Characters of a line; what is longer is no line of a label."""
_PLAIN_LOOKS: Final = 2
"""The first of a line; at the others a letter of a lot may become another."""
_AGREEING: Final = 3
"""Looks that must say the same where there are so many."""
_DATE_DIGITS: Final = 4
_BLIND_LOOKS: Final = 2
"""More of them at a line that may be a date, while none says anything."""


def text_values(lines: Sequence[TextLine], patterns: Sequence[LabelTextConfig]) -> tuple[LabelValue, ...]:
    """What the lines say, each value once with its confidence: that of the least sure of its characters in
    the surest of two looks that say the same, whole.  A date, for which the calendar vouches, may be what
    three of more looks say, the surest two together, while none says something else.  It is 0 otherwise, and
    the value what one of them says."""
    found: dict[tuple[ValueKind, Told], LabelValue] = {}
    for pattern in patterns:
        for line in lines:
            value = _value(line, pattern)
            if value is not None:
                key = value.kind, value.value
                found[key] = max(found.get(key, value), value, key=lambda v: v.confidence)
    return tuple(found.values())


def worth_another(looks: Sequence[TextLook], patterns: Sequence[LabelTextConfig]) -> bool:
    """Whether one more look at a line may make it sure: it has a value that was looked at once, a date that
    is not sure yet, or may be a date in dots that were not seen together."""
    line = TextLine(((0.0, 0.0),) * 4, tuple(looks))
    values = text_values([line], patterns)
    if values:
        unsure = [value for value in values if value.confidence < LEAST_TEXT_CONFIDENCE]
        return len(looks) < _PLAIN_LOOKS or any(value.kind in DATES for value in unsure)
    digits = max(sum(map(str.isdigit, look.text)) for look in looks)
    return len(looks) <= _BLIND_LOOKS and digits >= _DATE_DIGITS and any(one.is_date for one in patterns)


def _value(line: TextLine, pattern: LabelTextConfig) -> LabelValue | None:
    looks = line.looks if pattern.is_date else line.looks[:_PLAIN_LOOKS]
    told = [_read(look, line, pattern) for look in looks]
    telling = [one for one in told if one is not None]
    if not telling:
        return None
    first = telling[0].value
    agreed = len(telling) >= min(_AGREEING, len(told)) and all(one.value == first for one in telling)
    confidence = 0.0
    if agreed and all(one.part > 0.0 for one in telling):
        *_, second, surest = sorted((0.0, *(one.sure for one in telling)))
        both = 1.0 - (1.0 - surest) * (1.0 - second) if len(telling) >= _AGREEING else surest
        confidence = min(one.part for one in telling) * both
    return LabelValue(ValueKind(pattern.kind), told_text(first), "", ValueSource.TEXT, round(confidence, 4))


@dataclass(frozen=True, slots=True)
class _Found:
    """Where in a line a value was found: its part of the `reading` that told it, and its end in the line as
    the pattern takes it, `shown`.  A `whole` one can have lost nothing at its ends."""

    start: int
    end: int
    reading: str
    shown: str
    shown_end: int
    whole: bool = False


@dataclass(frozen=True, slots=True)
class _Look:
    """What one look tells, the probability of its least sure character, and the part of that which the line
    leaves to it: none where something else can be meant, or its end may be cut off or burnt."""

    value: Told
    sure: float
    part: float


def _read(look: TextLook, line: TextLine, pattern: LabelTextConfig) -> _Look | None:
    meant = _meant(look.text, pattern)
    if not meant:
        return None
    value, found = next(iter(meant.items()))
    short = pattern.is_date and not found.whole
    at_left = line.open_left and found.start == 0
    at_right = line.open_right and found.end == len(look.text)
    more_left = at_left and (short or _fits_longer(found.shown, 0, pattern))
    more_right = (at_right or line.gap) and (short or _fits_longer(found.shown, found.shown_end, pattern))
    burnt = (at_left or at_right) and line.glare >= _BURNT_END
    repaired = look.text[found.start : found.end] != found.reading[found.start : found.end]
    part = (_REPAIRED if repaired else 1.0) * (1.0 - _LOST_TO_GLARE * line.glare)
    # what is left of another character of the value, perhaps
    end = found.end + (0 if found.whole else len(look.text[found.end : found.end + 1].strip()))
    sure = min(
        sure
        for character, sure in zip(look.text[found.start : end], look.sure[found.start : end], strict=True)
        if character.isalnum() or not found.whole
    )
    return _Look(value, sure, 0.0 if len(meant) > 1 or more_left or more_right or burnt else part)


@lru_cache(maxsize=256)
def _meant(text: str, pattern: LabelTextConfig) -> Mapping[Told, _Found]:
    """Everything that a text can mean, as it stands there; else, for a date, with other separators.  Looks at
    one line mostly say the same, and it is asked after each of them."""
    readings = _readings(text, pattern) if len(text) <= _LONGEST else []
    meant: dict[Told, _Found] = {}
    for reading in readings:
        for value, found in _as_it_stands(reading, pattern):
            meant.setdefault(value, found)
    if meant or not pattern.is_date:
        return meant
    for reading in readings:
        for value, found in _respaced(reading, pattern):
            meant.setdefault(value, found)
    return meant


def _readings(text: str, pattern: LabelTextConfig) -> list[str]:
    """Every text that looks like this one, itself first; none where there are too many."""
    choices = [character + _ALIKE.get(character, "").replace(character, "") for character in text]
    if pattern.is_date:  # where a digit beside a digit is one
        beside = [
            re.search(r"\d", text[max(0, at - 1) : at] + text[at + 1 : at + 2]) for at in range(len(text))
        ]
        choices = [
            text[at] if text[at].isdigit() and beside[at] else choice for at, choice in enumerate(choices)
        ]
    return [] if math.prod(map(len, choices)) > _MOST_READINGS else list(map("".join, product(*choices)))


def _as_it_stands(reading: str, pattern: LabelTextConfig) -> Iterator[tuple[Told, _Found]]:
    """What the pattern finds in a reading, but in a part of a longer word."""
    match = re.search(pattern.pattern, reading)
    if match is None or match[1] is None:
        return
    start, end = match.span(1)
    before, after = reading[:start] if start == match.start() else "", reading[end:]
    found = _Found(start, end, reading, reading, end)
    if pattern.is_date:
        for form in pattern.dates:
            day = day_of(match[1].strip(), form)
            if day is not None and not date_goes_on(before, match[1], after, form):
                yield day, replace(found, whole=has_whole_year(form))
    elif not before[-1:].isalnum() and not after[:1].isalnum():
        yield from ((value, found) for value in _meanings(match[1], pattern))


def _respaced(reading: str, pattern: LabelTextConfig) -> Iterator[tuple[date, _Found]]:
    """Dates that the pattern finds in a reading once their separators are as their format has them."""
    for form in pattern.dates:
        other = respaced(reading, form)
        if other is None:
            continue
        start, end = other.start, other.end
        line = reading[:start] + other.shown + reading[end:]
        shown_end = start + len(other.shown)
        match = re.search(pattern.pattern, line)
        if match is None or match.span(1) != (start, shown_end):
            continue
        if other.lost and match.start() == start:  # without a caption `2021 0808` may be a telephone number
            continue
        day = day_of(other.shown, form)
        before = reading[:start] if start == match.start() else ""
        if day is not None and not date_goes_on(before, other.shown, reading[end:], form):
            yield day, _Found(start, end, reading, line, shown_end, has_whole_year(form))


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
        return {day for form in pattern.dates if (day := day_of(bare, form)) is not None}
    if ValueKind(pattern.kind) is ValueKind.QUANTITY:
        return {Decimal(bare)} if bare.isascii() and bare.isdecimal() else set()
    return {bare} if bare else set()
