"""Whether an MCAP file is whole, and making one whole that was cut off."""

from __future__ import annotations

import os
from pathlib import Path

from flightd.adapters.recorder.mcap_file import McapFile
from flightd.runtime.mcap_scan import MAGIC


def repair(path: Path) -> None:
    """Make a log whole that was cut off by a kill, a full disk or a loss of power, in place.

    What comes before the cut stays as it is; a log that is whole already stays as it is, too.
    Raises InputError if the file cannot be opened or is not one of flightd's logs.
    """
    McapFile.resume(path).close()


def is_whole(path: Path) -> bool:
    """Whether a log was closed: its last bytes are those of a finished file.  OSError if unreadable."""
    with path.open("rb") as stream:
        size = stream.seek(0, os.SEEK_END)
        stream.seek(max(size - len(MAGIC), 0))
        return size > 2 * len(MAGIC) and stream.read() == MAGIC
