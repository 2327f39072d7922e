"""What the messages of the ground link share: their version, names and stamps, and who may say what."""

from __future__ import annotations

import enum
import math
from typing import Annotated

import msgspec
from msgspec import Meta

VERSION = 1


class Role(enum.StrEnum):
    """What a client may do: look, or also command."""

    VIEWER = "viewer"
    OPERATOR = "operator"


Version = Annotated[int, Meta(description="version of this protocol: 1")]
Session = Annotated[str, Meta(description="random name of this run of the daemon")]
Seq = Annotated[int, Meta(description="counts the messages of this topic from 1; a gap is what you missed")]
Stamp = Annotated[int, Meta(description="the daemon's monotonic clock, ns")]
RequestId = Annotated[
    str,
    Meta(
        min_length=8,
        max_length=64,
        description="chosen by the client, 8 to 64 characters, never used twice (a UUID); a command sent "
        "again with the same id is answered again, not done again",
    ),
]


class ClientRequest(msgspec.Struct, frozen=True, kw_only=True, tag_field="op", forbid_unknown_fields=True):
    """What every request has."""

    version: Version
    id: RequestId


class DaemonAnswer(msgspec.Struct, frozen=True, kw_only=True, tag_field="answer"):
    """What every answer has."""

    version: Version = VERSION
    request: Annotated[str, Meta(description="id of the request; empty if it could not be read")]


def finite(value: float) -> float | None:
    """The number, or None where JSON has no form for it."""
    return value if math.isfinite(value) else None
