"""Brown-Conrady distortion (OpenCV's order k1 k2 p1 p2 k3) of normalised image points, and its inverse."""

from __future__ import annotations

import numpy as np

from flightd.core.geometry import Lens, Matrix


def distorted(ideal: Matrix, lens: Lens) -> Matrix:
    """Where the lens puts ideal normalised image points (2, …); NaN beyond the angle at which its
    polynomial folds back, which no real ray does."""
    k1, k2, p1, p2, k3 = lens.distortion
    x, y = ideal
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    bent = np.stack(
        [
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        ]
    )
    slope = 1.0 + r2 * (3.0 * k1 + r2 * (5.0 * k2 + r2 * 7.0 * k3))
    seen: Matrix = np.where(slope > 0.0, bent, np.nan)
    return seen


def undistorted(seen: Matrix, lens: Lens) -> Matrix:
    """Ideal normalised image points (2, …) of distorted ones, by fixed-point iteration to 1e-12.

    Raises ValueError when the lens bends so much that the points have no ideal counterpart."""
    k1, k2, p1, p2, k3 = lens.distortion
    ideal: Matrix = seen.copy()
    if not lens.is_distorted or not seen.size:
        return ideal
    for _ in range(200):
        x, y = ideal
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        bend_x = 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
        bend_y = p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
        better: Matrix = (seen - np.stack([bend_x, bend_y])) / radial
        moved = float(np.abs(better - ideal).max())
        ideal = better
        if moved < 1e-12:
            return ideal
    raise ValueError(f"distortion {lens.distortion} folds the picture's corners; use a milder lens")
