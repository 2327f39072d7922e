"""Files that lie where they are said to lie: no link is followed, and no pipe is waited for."""

from __future__ import annotations

import os
import stat
from pathlib import Path


def is_plain_file(path: Path) -> bool:
    """Whether a file lies there, itself."""
    return stat.S_ISREG(_mode(path))


def is_plain_folder(path: Path) -> bool:
    """Whether a folder lies there, itself."""
    return stat.S_ISDIR(_mode(path))


def plain_file(path: Path, most_bytes: int) -> bytes | None:
    """What is in a file of at most so many bytes; None where there is none, or it is something else."""
    try:
        opened = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    except OSError:
        return None
    try:
        found = os.fstat(opened)
        if not stat.S_ISREG(found.st_mode) or found.st_size > most_bytes:
            return None
        with os.fdopen(opened, "rb", closefd=False) as stream:
            return stream.read(most_bytes)
    except OSError:
        return None
    finally:
        os.close(opened)


def _mode(path: Path) -> int:
    try:
        return path.lstat().st_mode
    except (OSError, ValueError):
        return 0
