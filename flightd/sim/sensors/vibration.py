"""How motors shake a camera on its mount: turned anew for each frame, or by a few tones about each axis.

Propellers turn some 60 to 200 times a second, faster than frames come and about as fast as the rows of one
are read out: lines are wavy, edges blurred, and a tone that is near a multiple of the frame rate swings the
picture slowly.  The speed of a motor wanders, and with it what that is near to.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass, replace

import numpy as np

from flightd.core.geometry import Matrix
from flightd.sim.plant.kinematics import Kinematics

_HZ = 60.0, 200.0
_COUNTS = 2, 3
"""How many tones an axis has."""
_LEAST_PART = 0.2
"""Of an axis's strongest possible tone."""
_HZ_WANDER = 0.01
"""By which share of itself (rms) a tone's frequency wanders."""
_WANDERS_S = (2.0, 6.0), (6.0, 20.0)
"""Periods between which those of its wandering are drawn, one each."""
_WANDER_SHARE = _HZ_WANDER * math.sqrt(2.0 / len(_WANDERS_S))


@dataclass(frozen=True, slots=True)
class Tone:
    """One frequency of an axis; `share` is that of the axis's mean square, `wanders` the periods (s) and
    phases (rad) in which its frequency wanders."""

    hz: float
    share: float
    phase_rad: float
    wanders: tuple[tuple[float, float], ...] = ()

    def at_rad(self, t_s: Matrix) -> Matrix:
        """Its phase at each moment: 2 pi times the integral of its frequency."""
        turns_s = t_s.copy()
        for period_s, phase_rad in self.wanders:
            way_s = _WANDER_SHARE * period_s / math.tau
            turns_s -= way_s * np.cos(math.tau / period_s * t_s + phase_rad)
        phase: Matrix = math.tau * self.hz * turns_s + self.phase_rad
        return phase


Tones = tuple[Tone, ...]


@dataclass(frozen=True, slots=True)
class Vibration:
    """Roll and pitch by which a camera is turned against its airframe, each `rms_rad` over its tones."""

    rms_rad: float = 0.0
    roll: Tones = ()
    pitch: Tones = ()

    def angles_rad(self, t_s: Matrix, over_s: float = 0.0) -> Matrix:
        """Roll and pitch (2, ...) at the moments (...) since the clock's zero, on average over an exposure of
        `over_s` around each: of a tone it leaves the sinc of the periods that it lasts."""
        return np.stack([self._sum(tones, t_s, over_s) for tones in (self.roll, self.pitch)])

    def _sum(self, tones: Tones, t_s: Matrix, over_s: float) -> Matrix:
        angle = np.zeros(np.shape(t_s))
        for tone in tones:
            left = self.rms_rad * math.sqrt(2.0 * tone.share) * np.sinc(tone.hz * over_s)
            angle += left * np.sin(tone.at_rad(t_s))
        return angle

    def filtered_rates_radps(self, t_s: float, cut_hz: float) -> tuple[float, float]:
        """Rates of roll and pitch after a low pass of second order (Butterworth's) at `cut_hz`, which delays
        them besides: here they keep their phase."""
        return self._rate(self.roll, t_s, cut_hz), self._rate(self.pitch, t_s, cut_hz)

    def _rate(self, tones: Tones, t_s: float, cut_hz: float) -> float:
        rate = 0.0
        for tone in tones:
            passed = math.tau * tone.hz / math.hypot(1.0, (tone.hz / cut_hz) ** 2)
            rate += passed * math.sqrt(2.0 * tone.share) * math.cos(float(tone.at_rad(np.array(t_s))))
        return self.rms_rad * rate


STILL = Vibration()


def drawn_tones(rng: random.Random) -> tuple[Tones, Tones]:
    """Those of roll and of pitch."""
    return _axis(rng), _axis(rng)


def _axis(rng: random.Random) -> Tones:
    parts = [rng.uniform(_LEAST_PART, 1.0) for _ in range(rng.choice(_COUNTS))]
    return tuple(
        Tone(
            rng.uniform(*_HZ),
            part / math.fsum(parts),
            rng.uniform(0.0, math.tau),
            tuple((rng.uniform(*within_s), rng.uniform(0.0, math.tau)) for within_s in _WANDERS_S),
        )
        for part in parts
    )


class Shaken:
    """The airframe's truth as a camera sees it that is turned anew for each frame, `rms_rad` in roll and in
    pitch, and sits still within it; so does one of which nobody knows the rows."""

    def __init__(self, rms_rad: float, seed: int) -> None:
        self._rms_rad = rms_rad
        self._rng = random.Random(f"shake {seed}")

    def __call__(self, truth: Kinematics) -> Kinematics:
        if not self._rms_rad:
            return truth
        gauss = self._rng.gauss
        roll_rad = truth.roll_rad + gauss(0.0, self._rms_rad)
        return replace(truth, roll_rad=roll_rad, pitch_rad=truth.pitch_rad + gauss(0.0, self._rms_rad))
