"""Whether what was known of a sensor is suddenly something else.  Pure."""

from __future__ import annotations

import math

import numpy as np

from flightd.core.geometry import Matrix

SIDES = 1.0, -1.0
_KNOWN_S = 5.0
"""What has not been known for so long is still being learnt: what is learnt at first errs, and is put
right."""
_SIGMAS = 3.0
"""What moves by no more of its own doubt is being learnt."""
_FOLLOWS_S = 3.0
"""What comes to be known otherwise more slowly than this has not leapt."""
_RATIO = 13.0
"""Logarithm of the likelihood ratio from which on a leap is believed."""


class LeapTest:
    """Of one state of a filter; two things tell of a `leap`.

    What is known has moved by as much.  Or the measurements contradict what is known and cannot move it as
    fast: Page's test (Biometrika 41, 1954), to either of `SIDES`, sums up the likelihood ratio of a state
    that has leapt; the sum falls while they agree with what is known, or with less than half a leap."""

    def __init__(self, leap: float) -> None:
        self._leap = leap
        self._sums = [0.0, 0.0]
        self._lately = self._sigma = math.nan
        self._known_s = 0.0
        self.leaps = 0
        """How often it has leapt."""

    @property
    def begins(self) -> list[int]:
        """The sides to which it has not leapt yet by anything that was measured."""
        return [side for side, summed in enumerate(self._sums) if not summed]

    def moved(self, known: float, sigma: float, dt_s: float) -> None:
        """What is known after `dt_s`; what is not known to half a leap can do none, and what moves no further
        than it was doubted lately is still being learnt."""
        if sigma > 0.5 * self._leap:
            self._begin()
            return
        self._known_s += dt_s
        if math.isnan(self._lately):
            self._lately, self._sigma = known, sigma
        part = min(dt_s / _FOLLOWS_S, 1.0)
        self._lately += part * (known - self._lately)
        self._sigma += part * (sigma - self._sigma)
        far = max(self._leap, _SIGMAS * self._sigma)
        if self._known_s >= _KNOWN_S and abs(known - self._lately) > far:
            self._begin()
            self.leaps += 1

    def restart(self, side: int) -> None:
        """What a leap to that side was held to have begun with is spent: had it leapt then, the filter would
        have followed by now."""
        self._sums[side] = 0.0

    def contradicted(self, by_leap: Matrix, errors: Matrix, spread: Matrix) -> int | None:
        """To which side the measurements contradict what is known, None: to neither.  `errors` (m,) are the
        innovations, which should be 0, with the covariance `spread` (m, m); `by_leap` (m, 2) those that a
        leap to either side would have made."""
        if self._known_s < _KNOWN_S:
            return None
        told = by_leap.T @ np.linalg.solve(spread, np.column_stack((errors, by_leap)))
        for side in range(len(SIDES)):
            ratio = float(told[side, 0] - 0.5 * told[side, 1 + side])
            self._sums[side] = max(self._sums[side] + ratio, 0.0)
        side = 0 if self._sums[0] >= self._sums[1] else 1
        if self._sums[side] < _RATIO:
            return None
        self._begin()
        self.leaps += 1
        return side

    def _begin(self) -> None:
        self._sums, self._lately, self._sigma, self._known_s = [0.0, 0.0], math.nan, math.nan, 0.0
