"""What orders may ask of a drone's floor: its nodes, the open ways between them, its shelves."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from flightd.site.site import Side

_BESIDE_M: Final = 0.5
"""So far beside a way a drone is on it still."""


@dataclass(frozen=True, slots=True)
class Floor:
    """`ways` are the open ones in the directions in which they are; `shelves` the sides on which a node has
    one, and the levels on which places hang there (None: that is not told); `at_m` is where each node lies,
    y to the left of x."""

    map_id: str
    nodes: frozenset[str]
    ways: frozenset[tuple[str, str]]
    shelves: Mapping[str, Mapping[Side, frozenset[int] | None]]
    at_m: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def next_to(self, node: str | None, at_m: tuple[float, float] | None) -> frozenset[str]:
        """Where an open way leads at once from where a drone is: from the `node` that it is on, that one
        with it; else from `at_m` along the way that it is on."""
        if node is not None:
            return frozenset({node, *(b for a, b in self.ways if a == node)})
        return frozenset(b for a, b in self.ways if at_m is not None and self._is_on(at_m, a, b))

    def _is_on(self, at_m: tuple[float, float], a: str, b: str) -> bool:
        if a not in self.at_m or b not in self.at_m:
            return False
        (x0, y0), (x1, y1), (x, y) = self.at_m[a], self.at_m[b], at_m
        length_m = math.hypot(x1 - x0, y1 - y0)
        part = ((x - x0) * (x1 - x0) + (y - y0) * (y1 - y0)) / max(length_m, 1e-6) ** 2
        part = min(max(part, 0.0), 1.0)
        return math.hypot(x0 + part * (x1 - x0) - x, y0 + part * (y1 - y0) - y) <= _BESIDE_M
