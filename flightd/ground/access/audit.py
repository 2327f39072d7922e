"""The station's audit: a line for each act, with its person; it is only added to.

The file is written as the drone's own audit is (`ground.audit`), which has the same orders with the name of
the station's key; ids join the two.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec

from flightd.core.errors import UnavailableError

FILE = "audit.jsonl"


class StationEntry(msgspec.Struct, frozen=True):
    """Who did what from where, and what came of it: `accepted`, or `refused` and why; a schedule's
    run may be `missed`."""

    person: str
    role: str
    by: str
    address: str
    act: str
    target: str
    outcome: str
    text: str = ""
    id: str = ""


def audit_file(state: Path) -> Path:
    """Where the lines of the station with this state folder are."""
    return state / FILE


def audit_files(state: Path) -> tuple[Path, Path]:
    """The lines that were put aside, and those since; either may not be there."""
    file = audit_file(state)
    return file.with_name(f"{FILE}.1"), file


def newest_entries(state: Path, most: int, person: str = "") -> list[dict[str, Any]]:
    """The newest lines, oldest first, of one person or of all; what is no line is left out.
    UnavailableError where they cannot be read."""
    kept: deque[dict[str, Any]] = deque(maxlen=most)
    for path in audit_files(state):
        try:
            kept.extend(
                entry
                for entry in _entries(path)
                if not person or str(entry.get("person", "")).casefold() == person.casefold()
            )
        except FileNotFoundError:
            continue
        except OSError as err:
            raise UnavailableError(
                f"{path}: cannot be read: {err.strerror}", remedy="be the user that the station runs as"
            ) from None
    return list(kept)


def _entries(path: Path) -> Iterator[dict[str, Any]]:
    with path.open("rb") as lines:
        for line in lines:
            try:
                entry = msgspec.json.decode(line)
            except (msgspec.DecodeError, UnicodeDecodeError):
                continue  # a power cut in the middle of it
            if isinstance(entry, dict):
                yield entry
