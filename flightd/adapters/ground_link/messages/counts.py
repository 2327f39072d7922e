"""What a client wants counted, node by node."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

import msgspec
from msgspec import Meta

from flightd.core.count_choice import ShelfCount


class NodeCount(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """What is counted at a node."""

    node: Annotated[str, Meta(max_length=64, description="node of the map")]
    side: Annotated[
        Literal["", "left", "right"],
        Meta(description="of the aisle, seen along +x: left is towards -y; empty: both"),
    ] = ""
    levels: Annotated[
        tuple[Annotated[int, Meta(ge=1, le=99)], ...],
        Meta(max_length=99, description="shelf levels, from 1 at the floor; none: all"),
    ] = ()


Counts: TypeAlias = tuple[NodeCount, ...] | None


def shelf_counts(told: Counts) -> tuple[ShelfCount, ...] | None:
    """What is to be counted, as the mission has it."""
    return None if told is None else tuple(ShelfCount(one.node, one.side, one.levels) for one in told)
