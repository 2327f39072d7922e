"""The three roles, and which orders each may give.

The role that the drone's own list of clients gives to the station's key bounds them all: what the drone
refuses to the station, it refuses to everybody who orders through it.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Literal

from flightd.core.errors import InputError
from flightd.core.types import CommandKind


class Role(enum.StrEnum):
    """Each may what the one before it may."""

    VIEWER = "viewer"
    """Looks, and stops."""
    OPERATOR = "operator"
    """Flies, counts, decides."""
    ADMIN = "admin"
    """Changes site and drone, and reads the audit."""

    def covers(self, needed: Role) -> bool:
        """Whether it may what `needed` may."""
        return _ORDER.index(self) >= _ORDER.index(needed)


_ORDER = tuple(Role)
QUELLING = frozenset({CommandKind.STOP, CommandKind.PAUSE})
"""What takes motion away belongs to everybody who sees the drone: whoever sees a person step into the aisle
must not look for somebody with another role first.  It steers nowhere, and what it ended only an operator
begins again.  Pause is among them so that a viewer's only way is not the hardest one."""


@dataclass(frozen=True, slots=True)
class Identity:
    """Who asks: by a password (`session` is the hash of its id), by a key, from this machine, over a fleet's
    broker, or a schedule of the station.  With `scopes` (words of `key_book`) it is a program that may what
    these say and nothing else, whatever the role."""

    name: str
    role: Role
    by: Literal["local", "password", "key", "mqtt", "schedule"]
    session: bytes = b""
    scopes: frozenset[str] | None = None


def may_order(role: Role, command: CommandKind) -> bool:
    """Whether a person of this role may give the order to a drone."""
    return role.covers(Role.OPERATOR) or command in QUELLING


def read_role(text: str, key: str) -> Role:
    """InputError, at the option `key`, for what is no role."""
    try:
        return Role(text)
    except ValueError:
        raise InputError(f"expected {', '.join(Role)}", key=f"{key} {text}") from None
