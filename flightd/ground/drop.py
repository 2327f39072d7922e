"""A file that somebody dropped into a folder, and that was taken."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Drop:
    """The newest file of an `inbox` whose content is kept, and which may lie there still, by `name` and
    `sha256`; `said` is what whoever dropped it is told."""

    inbox: str
    name: str
    sha256: str
    said: str
