"""Why something is not flown, or not done: a value with fields; its words are made at the edge."""

from __future__ import annotations

import abc
from dataclasses import dataclass


class Refusal(abc.ABC):
    """One reason; `str` of it is the line for people.  Who finds it derives a frozen dataclass."""

    __slots__ = ()

    @abc.abstractmethod
    def __str__(self) -> str: ...


@dataclass(frozen=True, slots=True)
class RecordedRefusal(Refusal):
    """What a flight log keeps of one: its words."""

    text: str

    def __str__(self) -> str:
        return self.text


def words(refusal: Refusal | None) -> str:
    """The reason's line, an empty text where there is none: for status, log and other edges."""
    return "" if refusal is None else str(refusal)
