"""Roll and pitch carried by the vehicle's gyros over a leap of those that it tells.  Pure."""

from __future__ import annotations

import math
from typing import NamedTuple

from flightd.core.types import Attitude

LEAP_RAD = math.radians(1.0)
"""A told roll or pitch that turns by more than this between two samples, and the gyros did not, leaps: the
autopilot takes another estimator's, or its own anew."""
GAP_S = 0.06
"""Over longer ones two rates do not tell what was turned between them."""
_MOST_RADPS = 10.0
_LIVELY = 5
"""A rate that did not change so often in a row is not measured: some fill the field with a constant."""


class Lean(NamedTuple):
    """Of roll and pitch, rad."""

    roll_rad: float
    pitch_rad: float


LEVEL = Lean(0.0, 0.0)


class CarriedLean:
    """A drone does not lean otherwise because its autopilot thinks better of it: what is known of the error
    before a leap stays true, of the attitude as it is carried over it.  Whether the new one is better or
    worse need not be known.  As errors of the told attitude do, a leap fades within `fade_s`.  Call `take`
    with each sample."""

    def __init__(self, fade_s: float) -> None:
        self._fade_s = fade_s
        self._last: Attitude | None = None
        self._lively = 0
        self.lead = LEVEL
        """The carried roll and pitch less the told ones, of the newest sample."""

    def take(self, sample: Attitude) -> Attitude:
        """The sample with roll and pitch as they are carried on; one that is not newer than the last is told
        as that one is."""
        last = self._last
        dt_s = 0.0 if last is None else (sample.stamp_ns - last.stamp_ns) * 1e-9
        if last is None or dt_s > 0.0:
            self._last = sample
        if last is not None and dt_s > 0.0:
            self._follow(last, sample, dt_s)
        return sample.leant_by(*self.lead)

    def _follow(self, last: Attitude, sample: Attitude, dt_s: float) -> None:
        before = last.roll_rate_radps, last.pitch_rate_radps
        after = sample.roll_rate_radps, sample.pitch_rate_radps
        known = all(abs(rate) <= _MOST_RADPS for rate in (*before, *after))  # NaN fails too
        self._lively = min(self._lively + 1, _LIVELY) if known and before != after else 0
        kept = math.exp(-dt_s / self._fade_s)
        lead_roll, lead_pitch = kept * self.lead.roll_rad, kept * self.lead.pitch_rad
        if self._lively == _LIVELY and dt_s <= GAP_S:
            lead_roll -= _leap(sample.roll_rad - last.roll_rad, before[0], after[0], dt_s)
            lead_pitch -= _leap(sample.pitch_rad - last.pitch_rad, before[1], after[1], dt_s)
        self.lead = Lean(lead_roll, lead_pitch)


def _leap(told_rad: float, before_radps: float, after_radps: float, dt_s: float) -> float:
    """What was told to be turned more than the gyros felt; 0 where that is no leap."""
    apart_rad = told_rad - 0.5 * (before_radps + after_radps) * dt_s
    return apart_rad if abs(apart_rad) > LEAP_RAD else 0.0
