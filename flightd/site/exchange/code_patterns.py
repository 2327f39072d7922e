"""The pattern of location codes, found in codes of which bay, level and position are known."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

_TOKEN: Final = re.compile(r"[^\W\d_]+|\d+|[\W_]+")
_NUMBERS: Final = ("bay", "level", "position")
_MOST: Final = 8
"""Patterns that are tried for one list of codes."""


@dataclass(frozen=True, slots=True)
class Numbers:
    """What a pattern may name of a place; `side` is L or R."""

    aisle: str
    side: str
    bay: int
    level: int
    position: int

    def fill(self, pattern: str) -> str:
        """The pattern with these numbers."""
        return pattern.format(
            aisle=self.aisle, side=self.side, bay=self.bay, level=self.level, position=self.position
        )


def patterns(told: Sequence[tuple[str, Numbers]]) -> Iterator[str]:
    """Patterns that give every code of its numbers, those that name most first."""
    split = [_TOKEN.findall(code) for code, _ in told]
    if not split or len({len(tokens) for tokens in split}) != 1:
        return
    columns = [
        list(_parts([(tokens[i], numbers) for tokens, (_, numbers) in zip(split, told, strict=True)]))
        for i in range(len(split[0]))
    ]
    for parts in itertools.islice(itertools.product(*columns), _MOST):
        yield "".join(parts)


def named(pattern: str) -> int:
    """How many of bay, level and position a pattern names."""
    return sum(f"{{{name}" in pattern for name in _NUMBERS)


def _parts(column: Sequence[tuple[str, Numbers]]) -> Iterator[str]:
    """What a piece of a pattern may be that gives these pieces of codes."""
    pieces = {piece for piece, _ in column}
    if all(piece.isdigit() for piece in pieces):
        yield from _fitting(column, _of_digits(min(map(len, pieces))))
    elif all(piece.isalpha() for piece in pieces):
        yield from _fitting(column, ["{aisle}{side}", "{side}{aisle}", "{aisle}", "{side}"])
        # letters that stand before or after the names, the same in all codes
        affixed: list[Callable[[str, str], str]] = [
            lambda lead, name: f"{lead}{name}",
            lambda lead, name: f"{name}{lead}",
        ]
        for name in ("{aisle}{side}", "{aisle}", "{side}"):
            length = len(column[0][1].fill(name))
            first = column[0][0]
            for lead, join in zip((first[:-length], first[length:]), affixed, strict=True):
                if lead:
                    yield from _fitting(column, [join(lead, name)])
    if len(pieces) == 1:
        yield pieces.pop().replace("{", "{{").replace("}", "}}")


def _of_digits(shortest: int) -> Iterator[str]:
    for count in (1, 2, 3):
        for names in itertools.permutations(_NUMBERS, count):
            for widths in itertools.product(range(1, shortest + 1), repeat=count):
                if sum(widths) <= shortest:
                    yield "".join(
                        f"{{{name}:0{width}}}" if width > 1 else f"{{{name}}}"
                        for name, width in zip(names, widths, strict=True)
                    )


def _fitting(column: Sequence[tuple[str, Numbers]], forms: Iterator[str] | Sequence[str]) -> Iterator[str]:
    for form in forms:
        if all(numbers.fill(form) == piece for piece, numbers in column):
            yield form
