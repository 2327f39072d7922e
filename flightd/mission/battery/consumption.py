"""What the battery still gives: its consumption, learnt in flight, and how far that reaches.

A multirotor draws nearly the same power whether it hovers or flies slowly, so that charge is time: a share
of the full battery for each second in the air.
"""

from __future__ import annotations

import math


class BatteryGauge:
    """Consumption in flight, as a share of the full battery per second.

    The configured time stands for `_BELIEF_S` seconds of flight seen; what was measured outweighs it soon,
    and at once where it is worse and the gauge has moved by more than its own steps."""

    _BELIEF_S = 90.0
    _MOVED_FRAC = 0.04

    def __init__(self, flight_s: float) -> None:
        self._flight_s = flight_s
        self._seen_s = self._BELIEF_S
        self._used_frac = self._believed_frac = self._BELIEF_S / flight_s
        self._begin: tuple[int, float] | None = None
        self._now: tuple[int, float] | None = None

    def step(self, now_ns: int, charge_frac: float, flying: bool) -> None:
        """Take the newest charge; NaN is none."""
        if flying and not math.isnan(charge_frac):
            self._now = (now_ns, charge_frac)
            self._begin = self._begin or self._now
        elif not flying and self._begin is not None:  # landed: what this flight showed stays
            self._seen_s, self._used_frac = self._totals()
            self._begin = self._now = None

    @property
    def rate_per_s(self) -> float:
        """Share of the full battery per second of flight."""
        seen_s, used_frac = self._totals()
        blended = used_frac / seen_s
        measured_s, measured_frac = seen_s - self._BELIEF_S, used_frac - self._believed_frac
        return max(blended, measured_frac / measured_s) if measured_frac >= self._MOVED_FRAC else blended

    def sure_frac(self, now_ns: int) -> float:
        """What is left of the last charge that was known in this flight, by no less than the configured
        consumption since; NaN where none was."""
        if self._now is None:
            return math.nan
        rate_per_s = max(self.rate_per_s, 1.0 / self._flight_s)
        return self._now[1] - rate_per_s * (now_ns - self._now[0]) * 1e-9

    def _totals(self) -> tuple[float, float]:
        if self._begin is None or self._now is None:
            return self._seen_s, self._used_frac
        seconds = (self._now[0] - self._begin[0]) * 1e-9
        return self._seen_s + seconds, self._used_frac + max(self._begin[1] - self._now[1], 0.0)
