"""Searches the guide: every word has to be there, the best places first, each with the words around it."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

from flightd.ground.guide_pages.rendering import RenderedPage, Section

MOST_HITS = 40
MOST_WORDS = 8
_AROUND_CHARS = 90
_IN_TITLE, _IN_HEADING, _IN_TEXT, _PHRASE = 8.0, 6.0, 1.0, 5.0
_LOOKED_AHEAD = 20
_COUNTED = 4
"""A word that stands there more often counts no more."""

Part: TypeAlias = tuple[str, bool]
"""A piece of text, and whether it is what was searched for."""


@dataclass(frozen=True, slots=True)
class Hit:
    """A place in the guide: page and heading, and its text around the first words that were found."""

    topic: str
    title: str
    heading: str
    id: str
    parts: tuple[Part, ...]


class GuideSearch:
    """An index over the sections of all pages."""

    def __init__(self, pages: Sequence[RenderedPage]) -> None:
        self._places = [
            (page, section, _Folded.of(page, section))
            for page in pages
            for section in page.sections
            if section.text or section.id
        ]

    def find(self, query: str) -> list[Hit]:
        """The places that hold the beginning of every word of `query`; none for a query without words."""
        words = list(dict.fromkeys(re.findall(r"[\w.-]+", query.casefold())))[:MOST_WORDS]
        words = [word for word in words if any(char.isalnum() for char in word)]
        if not words:
            return []
        patterns = [re.compile(rf"(?<!\w){re.escape(word)}") for word in words]
        rarity = [self._rarity(pattern) for pattern in patterns]
        phrase = " ".join(words)
        scored = []
        for order, (page, section, folded) in enumerate(self._places):
            parts = [folded.score(pattern) for pattern in patterns]
            if all(parts):
                score = math.fsum(part * rare for part, rare in zip(parts, rarity, strict=True))
                score += _PHRASE * len(words) if len(words) > 1 and phrase in folded.all else 0.0
                scored.append((-score, order, page, section))
        scored.sort(key=lambda one: one[:2])
        return [_hit(page, section, patterns) for _, _, page, section in scored[:MOST_HITS]]

    def _rarity(self, pattern: re.Pattern[str]) -> float:
        """More for a word that few places hold."""
        holding = sum(1 for _, _, folded in self._places if pattern.search(folded.all))
        return math.log(1 + len(self._places) / (1 + holding))


@dataclass(frozen=True, slots=True)
class _Folded:
    title: str
    heading: str
    text: str
    all: str

    @classmethod
    def of(cls, page: RenderedPage, section: Section) -> _Folded:
        title, heading, text = page.title.casefold(), section.heading.casefold(), section.text.casefold()
        return cls(title, heading, text, f"{title}\n{heading}\n{text}")

    def score(self, pattern: re.Pattern[str]) -> float:
        found = sum(1 for _ in pattern.finditer(self.text))
        return (
            _IN_TITLE * bool(pattern.search(self.title))
            + _IN_HEADING * bool(pattern.search(self.heading))
            + _IN_TEXT * min(found, _COUNTED)
        )


def _hit(page: RenderedPage, section: Section, patterns: Sequence[re.Pattern[str]]) -> Hit:
    return Hit(page.topic, page.title, section.heading, section.id, _around(section.text, patterns))


def _around(text: str, patterns: Sequence[re.Pattern[str]]) -> tuple[Part, ...]:
    """The text around the first word that was found, what was found marked; its beginning where only the
    heading holds it."""
    folded = text.casefold()
    if len(folded) != len(text):  # a letter that folds to two: places would not fit
        folded = text.lower() if len(text.lower()) == len(text) else text
    found = sorted(
        (*match.span(), which) for which, pattern in enumerate(patterns) for match in pattern.finditer(folded)
    )
    spans = [(start, stop) for start, stop, _ in found]
    first = _densest(found)
    begin = _word_begin(text, max(first - _AROUND_CHARS, 0))
    end = min(first + 2 * _AROUND_CHARS, len(text))
    if end < len(text):
        end = max(text.rfind(" ", begin, end), first + 1)
    parts: list[Part] = [("… ", False)] if begin > 0 else []
    at = begin
    for start, stop in spans:
        if start >= at and stop <= end:
            parts += [(text[at:start], False), (text[start:stop], True)]
            at = stop
    parts.append((text[at:end] + (" …" if end < len(text) else ""), False))
    return tuple(part for part in parts if part[0])


def _densest(found: Sequence[tuple[int, int, int]]) -> int:
    """Where the most different words stand near each other: (start, stop, which word) in order."""
    best, most = found[0][0] if found else 0, 0
    for place, (start, _, _) in enumerate(found):
        near = {which for at, _, which in found[place : place + _LOOKED_AHEAD] if at - start < _AROUND_CHARS}
        if len(near) > most:
            best, most = start, len(near)
    return best


def _word_begin(text: str, at: int) -> int:
    return 0 if at == 0 else text.find(" ", at) + 1
