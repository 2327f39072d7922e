"""A long series of numbers in little memory: what a flight of hours measures and is asked for at its end."""

from __future__ import annotations

from array import array

import numpy as np


class Series:
    """The newest `keep` numbers at least, twice as many at most; four bytes each, seven digits."""

    def __init__(self, keep: int = 100_000) -> None:
        self._keep = keep
        self._values = array("f")

    def __len__(self) -> int:
        return len(self._values)

    def add(self, value: float) -> None:
        self._values.append(value)
        if len(self._values) >= 2 * self._keep:
            del self._values[: self._keep]

    def quantile(self, share: float) -> float:
        """The value below which `share` of them lie, 0 for none at all."""
        return float(np.quantile(np.frombuffer(self._values, np.float32), share)) if self._values else 0.0
