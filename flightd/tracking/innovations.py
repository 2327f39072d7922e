"""What a filter's innovations say of the noise that it assumes: the noise follows them, within bounds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flightd.core.geometry import Matrix

_BIAS_GAIN, _BIASED = 0.25, 0.6
"""Innovations whose running mean is beyond this, in sigmas, all err to one side: the wind has changed."""
_SHAKE_GAIN = 0.03
_ROUGH_GAIN, _LEAST_ROUGH, _MOST_ROUGH = 0.02, 0.15, 1.5
"""How soon, and between which shares of the configured density, the noise of the motion is adapted:
successive innovations of a filter that assumes too much of it contradict each other, of one that assumes too
little they agree (Mehra, IEEE Trans. Automatic Control 15, 1970)."""
_MOST_RATIO = 9.0


class Innovations:
    """Give `mind` all of each frame."""

    def __init__(self, shake_rad: float, bounds_rad: tuple[float, float]) -> None:
        self._bounds_rad = bounds_rad
        self._bias = [0.0, 0.0]
        self._last = [0.0, 0.0]
        self.rough = 1.0
        """The noise of the motion as a share of the configured one."""
        self.shake_rad = shake_rad
        """How far the picture shakes against the told attitude from frame to frame."""

    def forget(self) -> None:
        """The lines are others now."""
        self._bias = [0.0, 0.0]
        self._last = [0.0, 0.0]

    def one_sided(self, axis: int) -> bool:
        """Whether all lines across the axis err to one side lately."""
        return abs(self._bias[axis]) > _BIASED

    def shake_variance(self, by_tilt: tuple[float, float]) -> float:
        """What that shaking adds to the variance of what changes by so much per radian of roll and pitch."""
        by_roll, by_pitch = by_tilt
        return (by_roll**2 + by_pitch**2) * self.shake_rad**2

    def mind(self, errors: Matrix, spread: Matrix, by_tilt: Matrix, axes: Sequence[int | None]) -> None:
        """Take all of one frame (m,), expected to have the covariance (m, m), with their derivative (m, 2) by
        roll and pitch; `axes` are those across which each tells an offset, None: a direction."""
        told = errors / np.sqrt(np.diag(spread))
        for axis in range(2):
            mine = [-float(error) for error, of in zip(told, axes, strict=True) if of == axis]
            if mine:
                self.take(axis, sum(mine) / len(mine))
        self.shaken(errors, spread, by_tilt)

    def take(self, axis: int, mean: float) -> None:
        self._bias[axis] += _BIAS_GAIN * (mean - self._bias[axis])
        agree = min(max(mean * self._last[axis], -1.0), 1.0)
        self.rough = min(max(self.rough * (1.0 + _ROUGH_GAIN * agree), _LEAST_ROUGH), _MOST_ROUGH)
        self._last[axis] = mean

    def shaken(self, errors: Matrix, spread: Matrix, by_tilt: Matrix) -> None:
        """Follow the innovations e (m,), expected to have the covariance S (m, m); B (m, 2) is their
        derivative by roll and pitch.

        Judged is the square of that part of them which a shaken picture makes of all lines alike,
        |B' S^-1 e|^2, in units of what is expected of it, trace(B' S^-1 B).  It is 1 in the mean where the
        likelihood has its greatest value; the mean square of all innovations is not, where the noise of
        single lines is assumed too large."""
        weighed = by_tilt.T @ np.linalg.solve(spread, np.column_stack((errors, by_tilt)))
        expected = float(np.trace(weighed[:, 1:]))
        if not expected > 0.0:
            return
        ratio = float(weighed[:, 0] @ weighed[:, 0]) / expected
        low, high = self._bounds_rad
        shake_rad = self.shake_rad * (1.0 + _SHAKE_GAIN * (min(ratio, _MOST_RATIO) - 1.0))
        self.shake_rad = min(max(shake_rad, low), high)
