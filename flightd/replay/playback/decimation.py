"""A long series in few points, on a common time grid: the lowest and the highest value of each stretch."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]

_GAP_S = 1.5
"""Samples farther apart are not joined: nothing is known between them."""


@dataclass(frozen=True, slots=True)
class TimeGrid:
    """`stretches` stretches of equal length from `from_s` to `to_s`."""

    from_s: float
    to_s: float
    stretches: int

    def __post_init__(self) -> None:
        if not self.to_s > self.from_s or self.stretches < 1:
            raise ValueError(f"no time grid: {self.from_s} to {self.to_s} s in {self.stretches}")

    @property
    def step_s(self) -> float:
        return (self.to_s - self.from_s) / self.stretches

    def times_s(self) -> Array:
        """The (2 x stretches,) times that `decimated` gives values for, two in each stretch."""
        places = np.arange(2 * self.stretches) / 2 + 0.25
        return self.from_s + places * self.step_s


def decimated(t_s: Array, values: Array, grid: TimeGrid) -> Array:
    """Two values for each stretch of the grid, its lowest and its highest in the order in which they came,
    so that no peak is lost; a stretch without a sample has what lies between its neighbours.  NaN where
    nothing is known.  `t_s` does not fall."""
    found = np.full(2 * grid.stretches, math.nan)
    known = np.isfinite(values) & np.isfinite(t_s)
    times, numbers = t_s[known], values[known]
    if len(times) == 0:
        return found
    stretch = np.floor((times - grid.from_s) / grid.step_s).astype(np.int64)
    inside = (stretch >= 0) & (stretch < grid.stretches)
    if inside.any():
        _fill(found, stretch[inside], numbers[inside])
    _join(found, grid, times, numbers)
    return found


def _fill(found: Array, stretch: NDArray[np.int64], numbers: Array) -> None:
    starts = np.flatnonzero(np.diff(stretch, prepend=stretch[0] - 1))
    lowest, highest = np.minimum.reduceat(numbers, starts), np.maximum.reduceat(numbers, starts)
    ends = np.append(starts[1:], len(numbers)) - 1
    rising = numbers[ends] >= numbers[starts]
    where = 2 * stretch[starts]
    found[where] = np.where(rising, lowest, highest)
    found[where + 1] = np.where(rising, highest, lowest)


def _join(found: Array, grid: TimeGrid, times: Array, numbers: Array) -> None:
    """Stretches between two samples that are not too far apart lie on the straight line between them."""
    empty = np.isnan(found)
    if not empty.any():
        return
    at = grid.times_s()[empty]
    after = np.searchsorted(times, at)
    between = (after > 0) & (after < len(times))
    index = np.clip(after, 1, len(times) - 1) if len(times) > 1 else None
    if index is None:
        return
    near = between & (times[index] - times[index - 1] <= max(_GAP_S, 2 * grid.step_s))
    joined = np.where(near, np.interp(at, times, numbers), math.nan)
    found[empty] = joined
