"""What this station runs on."""

from __future__ import annotations

from flightd.core.versions import versions_of

_LIBRARIES = ("starlette", "uvicorn", "websockets", "pyzmq", "msgspec", "pydantic", "numpy", "mcap")


def station_versions() -> dict[str, str]:
    """By name."""
    return versions_of(_LIBRARIES)
