"""Whether what was known of a sensor is suddenly something else.  Pure."""

from __future__ import annotations

import math

import numpy as np

from flightd.core.geometry import Matrix

_FOLLOWS_S = 3.0
"""What comes to be known otherwise more slowly than this has not leapt."""
_RATIO = 12.0
"""Logarithm of the likelihood ratio from which on a leap is believed."""


class LeapTest:
    """Of one state of a filter; two things tell of a `leap`.

    What is known has moved by as much.  Or the measurements contradict what is known and cannot move it as
    fast: Page's test (Biometrika 41, 1954), to either side, sums up the likelihood ratio of a state that is
    off by a leap; the sum falls while they agree with what is known, or with less than half a leap."""

    def __init__(self, leap: float) -> None:
        self._leap = leap
        self._sums = [0.0, 0.0]
        self._lately = math.nan
        self.leaps = 0
        """How often it has leapt."""

    def moved(self, known: float, sigma: float, dt_s: float) -> None:
        """What is known after `dt_s`; what is not known to a quarter of a leap can do none."""
        if sigma > 0.25 * self._leap:
            self._sums, self._lately = [0.0, 0.0], math.nan
            return
        if math.isnan(self._lately):
            self._lately = known
        self._lately += min(dt_s / _FOLLOWS_S, 1.0) * (known - self._lately)
        if abs(known - self._lately) > self._leap:
            self._lately = known
            self.leaps += 1

    def contradicted(self, by_state: Matrix, errors: Matrix, spread: Matrix) -> bool:
        """Whether the measurements contradict what is known.  `errors` (m,) are g, which should be 0, with
        the covariance `spread` (m, m) and the derivative `by_state` (m,)."""
        if math.isnan(self._lately):
            return False
        score, information = by_state @ np.linalg.solve(spread, np.column_stack((-errors, by_state)))
        even = 0.5 * self._leap * information
        for side, sign in enumerate((1.0, -1.0)):
            self._sums[side] = max(self._sums[side] + self._leap * float(sign * score - even), 0.0)
        if max(self._sums) < _RATIO:
            return False
        self._sums, self._lately = [0.0, 0.0], math.nan
        self.leaps += 1
        return True
