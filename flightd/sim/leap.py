"""What is suddenly something else, once in a flight."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Leap:
    """A time that is longer by `by_s` for good, `after_s` after its device began."""

    by_s: float = 0.0
    after_s: float = math.inf

    def ns(self, elapsed_ns: int) -> int:
        """By how much it is longer so long after."""
        return round(self.by_s * 1e9) if elapsed_ns > self.after_s * 1e9 else 0


NEVER = Leap()
