"""The ground link: can it listen where the configuration says?"""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import TypeAlias

from flightd.config.ground import GroundConfig
from flightd.core.errors import UnavailableError
from flightd.doctor.check import Check, error, ok

GroundListener: TypeAlias = AbstractContextManager[object]
"""A link that listens as long as it is entered; UnavailableError when it cannot."""


def check_ground(ground: GroundConfig, link: GroundListener | None) -> list[Check]:
    """The ports are listened on for a moment; keys and allow-list were read when the link was made."""
    if link is None:
        return []
    try:
        with link:
            text = f"{ground.listen}, ports {ground.status_port} and {ground.command_port}"
            keys = "with keys" if ground.server_key else "without keys, this machine only"
            return [ok("ground", f"can listen on {text}, {keys}")]
    except UnavailableError as err:
        if err.remedy:
            return [error("ground", f"{err.file}: {err.what}", err.remedy)]
        return [error("ground", str(err), "stop what has the port (another flightd?), or choose another")]
