"""How a drone flies in tests of something else than how it hovers, climbs and lands: these take a quarter of
a short flight.  As shipped it flies where they are what is judged."""

from __future__ import annotations

from typing import Final

BRISK: Final[dict[str, float]] = {"dwell_s": 0.5, "climb_mps": 0.8, "land_mps": 0.7}
"""Keys of `mission`; both rates are within the shipped limits of `control`."""

QUICK: Final = BRISK | {"speed_mps": 1.2, "accel_mps2": 1.0, "turn_rate_degps": 45.0}
"""Where how it gets there does not matter either.  The turns are the fastest within those limits."""
