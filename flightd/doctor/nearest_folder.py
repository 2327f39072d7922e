"""Where something would be made that is not there yet."""

from __future__ import annotations

from pathlib import Path


def nearest_there(path: Path) -> Path:
    """`path`, or the nearest above it that is there.  OSError where one above may not be
    searched."""
    return next(one for one in (path, *path.parents) if one.exists())
