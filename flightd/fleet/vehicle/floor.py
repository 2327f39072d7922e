"""What orders may ask of a drone's floor: its nodes, the open ways between them, its shelves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from flightd.site.site import Side


@dataclass(frozen=True, slots=True)
class Floor:
    """`ways` are the open ones in the directions in which they are; `shelves` the sides on which a node has
    one, and the levels on which places hang there (None: that is not told)."""

    map_id: str
    nodes: frozenset[str]
    ways: frozenset[tuple[str, str]]
    shelves: Mapping[str, Mapping[Side, frozenset[int] | None]]
