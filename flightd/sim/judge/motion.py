"""The true motion of a flight as arrays: what the judge computes on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Self

import numpy as np
from numpy.typing import NDArray

from flightd.sim.plant.kinematics import OFF_FLOOR_M, Kinematics

Values = NDArray[np.float64]

GAP_S = 0.5
"""True places further apart in time leave half a metre or more of a flight that nobody judges."""


@dataclass(frozen=True, slots=True)
class TrueMotion:
    """Samples in time order, each an array (n,): s, metres of the map, m/s, + up."""

    stamp_s: Values
    x_m: Values
    y_m: Values
    height_m: Values
    climb_mps: Values

    @classmethod
    def of(cls, truth: Sequence[Kinematics]) -> Self:
        rows = [(t.stamp_ns * 1e-9, t.x_m, t.y_m, t.height_m, t.climb_mps) for t in truth]
        return cls(*np.asarray(rows, np.float64).reshape(-1, 5).T)

    def __len__(self) -> int:
        return len(self.stamp_s)

    def chosen(self, wanted: NDArray[np.bool_]) -> TrueMotion:
        """Only the samples where `wanted` (n,) holds."""
        return TrueMotion(*(getattr(self, field.name)[wanted] for field in fields(self)))

    @property
    def gaps(self) -> int:
        """How often there is nothing known for too long between two samples, one of them off the floor."""
        flies = self.flying
        return int(((np.diff(self.stamp_s) > GAP_S) & (flies[1:] | flies[:-1])).sum())

    def on_floor_s(self) -> Iterator[tuple[float, float]]:
        """From when to when, s of the clock, it was on the floor: until it is off it again, or to the end."""
        flies = self.flying
        for begin in np.flatnonzero(~flies & np.r_[True, flies[:-1]]):
            off = np.flatnonzero(flies[begin:])
            yield float(self.stamp_s[begin]), float(self.stamp_s[begin + off[0] if len(off) else -1])

    @property
    def flying(self) -> NDArray[np.bool_]:
        """Which samples are off the floor, (n,)."""
        return self.height_m > OFF_FLOOR_M
