"""The linear Kalman filter, in the covariance form that stays positive (Joseph).

Written out, for the usual library for it imports half of scipy: seconds that a daemon which is started
anew in the air does not have.
"""

from __future__ import annotations

import numpy as np

from flightd.core.geometry import Matrix


class KalmanFilter:
    """State `x` (n, 1) with covariance `P` (n, n); model `F` (n, n), `B` (n, k), `Q` (n, n); `H` (m, n)."""

    def __init__(self, x: Matrix, P: Matrix) -> None:  # noqa: N803 - the field's letters
        n = len(x)
        self.x = x
        self.P = P
        self.F: Matrix = np.eye(n)
        self.B: Matrix | None = None
        self.Q: Matrix = np.eye(n)
        self.H: Matrix = np.zeros((1, n))

    def predict(self, u: Matrix | None = None) -> None:
        """x = F x + B u, P = F P F' + Q."""
        self.x = self.F @ self.x
        if self.B is not None and u is not None:
            self.x = self.x + self.B @ u
        self.P = self.F @ self.P @ self.F.T + self.Q

    def update(self, z: Matrix, R: Matrix) -> None:  # noqa: N803
        """Take the measurement `z` (m, 1) with covariance `R` (m, m)."""
        crossed = self.P @ self.H.T
        gain = crossed @ np.linalg.inv(self.H @ crossed + R)
        self.x = self.x + gain @ (z - self.H @ self.x)
        kept = np.eye(len(self.x)) - gain @ self.H
        self.P = kept @ self.P @ kept.T + gain @ R @ gain.T
