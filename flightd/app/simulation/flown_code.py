"""Which code a flight is evidence of."""

from __future__ import annotations

import subprocess
from pathlib import Path

from flightd import __version__

_ROOT = Path(__file__).parents[3]
_DESCRIBE_S = 10.0


def flown_code(root: Path = _ROOT) -> str:
    """The commit of the checkout that flightd runs from, with `-dirty` where files differ from it; without a
    checkout the version."""
    try:
        top = _git(root, "rev-parse", "--show-toplevel")
        if Path(top).resolve() != root.resolve():
            return __version__  # installed within another project's checkout
        return _git(root, "describe", "--always", "--dirty", "--tags")
    except (OSError, subprocess.SubprocessError):
        return __version__


def _git(root: Path, *arguments: str) -> str:
    command = ["git", "-C", str(root), *arguments]
    told = subprocess.run(command, capture_output=True, text=True, timeout=_DESCRIBE_S, check=True)  # noqa: S603 - fixed words
    return told.stdout.strip()
