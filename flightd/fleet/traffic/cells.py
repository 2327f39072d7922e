"""Which resources conflict: those whose cells meet when two drones are on them.

The cell of a drone is an upright cylinder around its middle: half its size, a clearance, and what its
position is uncertain by.  Two resources conflict where their boxes come nearer to each other than two cells
reach, both across and upwards; so a crossing, a swap and two nodes that lie too close are all the same
conflict.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from flightd.fleet.traffic.lanes import Box, LaneGraph

Conflicts: TypeAlias = tuple[tuple[int, ...], ...]
"""For each resource those that conflict with it, itself among them, rising."""

_ROWS = 128


@dataclass(frozen=True, slots=True)
class CellSize:
    """`body_m` is the drone across, propellers included; `clearance_m` is kept around it; its position is
    uncertain by `uncertainty_m` at most.  Cells that are `upright_m` above each other do not meet: below
    that, the wash of the upper drone disturbs the lower one."""

    body_m: float = 0.6
    clearance_m: float = 0.15
    uncertainty_m: float = 0.3
    upright_m: float = 2.0

    @property
    def radius_m(self) -> float:
        """Of the cell across."""
        return self.body_m / 2 + self.clearance_m + self.uncertainty_m

    @property
    def separation_m(self) -> float:
        """Middles of two cells that do not meet are so far apart across, or `upright_m` upwards."""
        return 2 * self.radius_m


def conflicts_of(lanes: LaneGraph, cell: CellSize) -> Conflicts:
    """The conflicts of all resources of a graph."""
    boxes = _array(lanes.boxes)
    found: list[tuple[int, ...]] = [()] * len(boxes)
    by_y = np.argsort(boxes[:, 1], kind="stable")
    for first in range(0, len(boxes), _ROWS):
        chosen = by_y[first : first + _ROWS]
        rows = boxes[chosen]
        reach_m = cell.separation_m
        near = np.flatnonzero(
            (boxes[:, 1] < rows[:, 4].max() + reach_m) & (boxes[:, 4] > rows[:, 1].min() - reach_m)
        )
        others = boxes[near]
        low = others[None, :, :3] - rows[:, None, 3:]
        high = rows[:, None, :3] - others[None, :, 3:]
        gap = np.maximum(np.maximum(low, high), 0.0)
        across = np.hypot(gap[..., 0], gap[..., 1])
        meets = (across < reach_m - 1e-9) & (gap[..., 2] < cell.upright_m - 1e-9)
        for row, resource in zip(meets, chosen.tolist(), strict=True):
            found[resource] = tuple(near[row].tolist())
    return tuple(found)


def within(lanes: LaneGraph, resources: Sequence[int], reach_m: float, upright_m: float) -> frozenset[int]:
    """The resources that come nearer than `reach_m` across, and `upright_m` upwards, to one of
    `resources`."""
    boxes = _array(lanes.boxes)
    found: set[int] = set()
    for resource in resources:
        row = boxes[resource]
        gap = np.maximum(np.maximum(boxes[:, :3] - row[3:], row[:3] - boxes[:, 3:]), 0.0)
        near = (np.hypot(gap[:, 0], gap[:, 1]) < reach_m - 1e-9) & (gap[:, 2] < upright_m - 1e-9)
        found.update(np.flatnonzero(near).tolist())
    return frozenset(found)


def _array(boxes: Sequence[Box]) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    return np.array([(b.x0_m, b.y0_m, b.z0_m, b.x1_m, b.y1_m, b.z1_m) for b in boxes])
