"""Versions of the program and of what it stands on, for who is asked why something does not work."""

from __future__ import annotations

import importlib.metadata
import platform
from collections.abc import Iterable

from flightd import __version__


def versions_of(libraries: Iterable[str]) -> dict[str, str]:
    """By name: flightd, Python, the system, and those of the libraries that are installed."""
    found = {
        "flightd": __version__,
        "Python": platform.python_version(),
        "system": f"{platform.system()} {platform.release()}",
    }
    for library in libraries:
        try:
            found[library] = importlib.metadata.version(library)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found
