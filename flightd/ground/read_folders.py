"""Folders that somebody else fills, such as a daemon on the same computer: the station only reads there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from flightd.ground.free_name import free_name
from flightd.ground.shown_text import shown


@dataclass(frozen=True, slots=True)
class ReadFolder:
    """A folder whose flights and inventories are named `NAME:` and their path below it."""

    name: str
    path: Path

    @property
    def prefix(self) -> str:
        return f"{self.name}:"


def read_folders(paths: Sequence[Path]) -> tuple[ReadFolder, ...]:
    """The folders, each named as it is called itself, with a number where two are called alike."""
    found: dict[str, ReadFolder] = {}
    for path in dict.fromkeys(path.absolute() for path in paths):
        name = free_name(shown(path.name) or "/", found)
        found[name] = ReadFolder(name, path)
    return tuple(found.values())
