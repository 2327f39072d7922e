"""Least squares over a chain of K states that also share G unknowns.

The normal equations are block tridiagonal with a border: state k meets only its neighbours and the shared
unknowns.  Eliminating the states one after the other leaves G equations, whose inverse is the covariance of
the shared unknowns with all of the chain allowed for (Schur complement; Golub and Van Loan, Matrix
Computations, 4.5 and 3.2.11).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flightd.core.geometry import Matrix


@dataclass(slots=True)
class BorderedChain:
    """Normal equations, to be added up: `own` (K, n, n), `link` (K - 1, n, n) of each state with the next,
    `border` (K, n, G), `shared` (G, G), and the right-hand sides `own_rhs` (K, n), `shared_rhs` (G,)."""

    own: Matrix
    link: Matrix
    border: Matrix
    shared: Matrix
    own_rhs: Matrix
    shared_rhs: Matrix

    @classmethod
    def empty(cls, states: int, size: int, shared: int) -> BorderedChain:
        return cls(
            np.zeros((states, size, size)),
            np.zeros((max(states - 1, 0), size, size)),
            np.zeros((states, size, shared)),
            np.zeros((shared, shared)),
            np.zeros((states, size)),
            np.zeros(shared),
        )

    def eliminate(self) -> Eliminated:
        """The states expressed by the shared unknowns.  LinAlgError where they are not determined."""
        states, size = self.own_rhs.shape
        shared, rhs = self.shared.copy(), self.shared_rhs.copy()
        own, border, own_rhs = self.own[0], self.border[0], self.own_rhs[0]
        last = np.zeros((size, size))
        by: list[Matrix] = []
        for k in range(states):
            link = self.link[k] if k + 1 < states else last
            right = np.concatenate([link, border, own_rhs[:, None]], axis=1)
            solved = np.linalg.solve(own, right)
            by.append(solved)
            down = right.T @ solved
            shared -= down[size:-1, size:-1]
            rhs -= down[size:-1, -1]
            if k + 1 < states:
                own = self.own[k + 1] - down[:size, :size]
                border = self.border[k + 1] - down[:size, size:-1]
                own_rhs = self.own_rhs[k + 1] - down[:size, -1]
        return Eliminated(shared, rhs, by)


@dataclass(frozen=True, slots=True)
class Eliminated:
    """The equations of the shared unknowns, (G, G) and (G,), and each state (n, n + G + 1) by the next one,
    the shared unknowns and a constant."""

    shared: Matrix
    rhs: Matrix
    by: list[Matrix]

    def substitute(self, shared: Matrix) -> Matrix:
        """The states (K, n) for the shared unknowns (G,)."""
        size = len(self.by[0])
        steps, after = np.zeros((len(self.by), size)), np.zeros(size)
        for k in range(len(self.by) - 1, -1, -1):
            by = self.by[k]
            after = by[:, -1] - by[:, size:-1] @ shared - by[:, :size] @ after
            steps[k] = after
        return steps
