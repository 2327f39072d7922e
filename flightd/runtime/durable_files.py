"""Files that a power cut leaves either as they were or as they shall be."""

from __future__ import annotations

import os
from pathlib import Path


def replace_file(path: Path, beside: Path, data: bytes) -> None:
    """Put `data` in the place of `path`, by way of a file `beside` it in the same folder; on the disk before
    this returns.  Raises OSError when the disk refuses: `path` is as it was then and `beside` may be left,
    unless only their folder could not be brought to the disk: then `path` is new already."""
    with beside.open("wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    beside.replace(path)
    sync_folder(path.parent)


def sync_folder(folder: Path) -> None:
    """A new name in a folder is on the disk only once the folder is."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
