"""Whether the delay of a filter's frames is suddenly another one, and by what its state errs then.  Pure.

What a leap makes of the innovations is not what it makes of the measurements: the filter explains it by other
states meanwhile.  So the error of the whole state that a leap would have made is carried on as the state is
(Willsky and Jones, IEEE Trans. Automatic Control 21, 1976), from when nothing spoke for one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flightd.core.geometry import Matrix
from flightd.tracking.leap_test import SIDES, LeapTest
from flightd.tracking.motion_model import DELAY, FIRST_LINE

_LEAP_S = 0.02
_SPENT = 0.5
"""Share of a leap: what is left of it once the filter would have followed the rest."""


class DelayLeap:
    """Has to be told of all that is done to the state, and asked with each frame."""

    def __init__(self) -> None:
        self.test = LeapTest(_LEAP_S)
        self.off: Matrix = np.zeros((FIRST_LINE, len(SIDES)))
        """(n, 2) by what the state errs, had the delay leapt to either side when its test last began."""

    @property
    def leaps(self) -> int:
        """How often it has leapt."""
        return self.test.leaps

    def moved(self, jacobian: Matrix, delay_s: float, sigma_s: float, dt_s: float) -> None:
        """The state has gone on by `dt_s`, by its derivative (n, n); what is known of the delay now."""
        self.off = jacobian @ self.off
        self.test.moved(delay_s, sigma_s, dt_s)

    def keep(self, rows: Sequence[int]) -> None:
        """Only those places of the state are left."""
        self.off = self.off[rows]

    def grow(self, row: Matrix) -> None:
        """One more is told by (n,) the others."""
        self.off = np.vstack((self.off, row @ self.off))

    def found(self, by_leap: Matrix, errors: Matrix, spread: Matrix) -> Matrix | None:
        """(n,) by what the state errs per second of the delay, where the innovations `errors` (m,) of the
        covariance `spread` (m, m) say that it has leapt; `by_leap` (m, 2) is what of them a leap to either
        side would have made."""
        side = self.test.contradicted(by_leap, errors, spread)
        off = None if side is None else self.off[:, side] / _LEAP_S
        for tried, sign in enumerate(SIDES):
            if abs(self.off.item(DELAY, tried)) < _SPENT * _LEAP_S:
                self.test.restart(tried)
            if tried in self.test.begins:
                self.off[:, tried] = 0.0
                self.off[DELAY, tried] = -sign * _LEAP_S
        return off
