"""Who asks on the ground link."""

from __future__ import annotations

from dataclasses import dataclass

from flightd.adapters.ground_link.messages.base import Role


@dataclass(frozen=True, slots=True)
class Peer:
    """Where a request came from: `name` and `role` by its key, `route` its connection."""

    name: str
    role: Role
    route: bytes = b""
    address: str = ""
