"""What is suddenly something else, once in a flight."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from flightd.sim.plant.kinematics import OFF_FLOOR_M


@dataclass(frozen=True, slots=True)
class Leap:
    """A time that is longer by `by_s` for good, `after_s` after its vehicle first flew."""

    by_s: float = 0.0
    after_s: float = math.inf

    def since_s(self, heights: Iterable[tuple[int, float]], now_ns: int) -> float:
        """How long ago it came in a flight that was so high (m) at these times (ns); below 0: it is still to
        come, minus infinity where it never flew."""
        flew_ns = next((at_ns for at_ns, height_m in heights if height_m > OFF_FLOOR_M), math.inf)
        return (now_ns - flew_ns) * 1e-9 - self.after_s


NEVER = Leap()


class LeapInFlight:
    """A leap as it comes in a flight; it is asked from before the vehicle first flies, at rising times."""

    def __init__(self, leap: Leap) -> None:
        self._leap = leap
        self._flew_ns: int | None = None

    def ns(self, now_ns: int, height_m: float) -> int:
        """By how much the time is longer now that the vehicle is so high."""
        if self._flew_ns is None and height_m > OFF_FLOOR_M:
            self._flew_ns = now_ns
        came = self._flew_ns is not None and now_ns - self._flew_ns > self._leap.after_s * 1e9
        return round(self._leap.by_s * 1e9) if came else 0
