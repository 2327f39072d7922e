"""The processes of a session, as the system lists them."""

from __future__ import annotations

from pathlib import Path


def of_session(session: int) -> set[int]:
    """Those that were begun in it and live."""
    found = set()
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, _, its = stat.read_text().rpartition(") ")[2].split()[:4]
        except OSError:  # gone meanwhile
            continue
        if int(its) == session and state != "Z":
            found.add(int(stat.parent.name))
    return found
