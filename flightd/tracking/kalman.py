"""The steps of a Kalman filter, in the covariance form that stays positive (Joseph).

Written out, for the usual library for it imports half of scipy: seconds that a daemon which is started
anew in the air does not have.
"""

from __future__ import annotations

import numpy as np

from flightd.core.geometry import Matrix


def predicted(p: Matrix, transition: Matrix, noise: Matrix) -> Matrix:
    """(n, n) covariance after a step with the (n, n) `transition` and the (n, n) `noise` of the model."""
    moved: Matrix = transition @ p @ transition.T + noise
    return (moved + moved.T) / 2


def corrected(
    x: Matrix,
    p: Matrix,
    rows: Matrix,
    errors: Matrix,
    noise: Matrix,
    unmoved: slice | list[int] | None = None,
) -> tuple[Matrix, Matrix, Matrix]:
    """(n,) state and (n, n) covariance that bring m measured errors to 0, and the (m, m) covariance that the
    errors were expected to have; of several states (n, k) each by its own errors (m, k).

    `errors` (m,) are h(x) - z, or any g(x) that is 0 where state and measurement agree, `rows` (m, n) their
    derivative by the state, `noise` (m, m) the covariance of what was measured.  States that are `unmoved`
    learn nothing of them (Schmidt's filter: they are considered, not corrected)."""
    crossed = p @ rows.T
    spread: Matrix = rows @ crossed + noise
    gain = np.linalg.solve(spread, crossed.T).T
    if unmoved is not None:
        gain[unmoved] = 0.0
    kept = np.eye(len(x)) - gain @ rows
    after = kept @ p @ kept.T + gain @ noise @ gain.T
    return x - gain @ errors, (after + after.T) / 2, spread
