"""Roll and pitch carried by the vehicle's gyros over a leap of those that it tells.  Pure."""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

from flightd.core.types import Attitude

LEAP_RAD, _STAMPS_S = math.radians(1.0), 0.02
"""A told roll or pitch that turns by more than this between two samples, and by more than the rate turns it
in so long, by which stamps may be wrong, while the gyros felt none of it, leaps: the autopilot takes another
estimator's, or its own anew."""
GAP_S = 0.06
"""Over longer ones two rates do not tell what was turned between them."""
_MOST_RADPS = 10.0
_TURNED_RAD2, _MOST_TURNED_RAD2, _UNEXPLAINED = math.radians(2.0) ** 2, math.radians(5.0) ** 2, 0.2
"""Gyros are believed that have explained turns of that sum of squares, all but so much of it; the sum holds
the newest ones up to the second."""
_PROOF_S = 60.0
_MOST_LEAPS, _WITHIN_NS = 2, 1_000_000_000
"""No estimator leaps more often: then it is the gyros that are wrong."""
_MOST_RAD = math.radians(10.0)


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
        self._roll, self._pitch = _Gyro(), _Gyro()
        self._lead = LEVEL
        self.leap = LEVEL
        """By how much the newest sample leapt."""
        self.leaps = 0

    def lead_at(self, stamp_ns: int) -> Lean:
        """The carried roll and pitch less the told ones, at or after the newest sample."""
        last = self._last
        if last is None or self._lead == LEVEL:
            return LEVEL
        kept = math.exp(min(last.stamp_ns - stamp_ns, 0) * 1e-9 / self._fade_s)
        return Lean(kept * self._lead.roll_rad, kept * self._lead.pitch_rad)

    def take(self, sample: Attitude, *, leaps: bool = True) -> Attitude:
        """The sample with roll and pitch as they are carried on; one that is not newer than the last is told
        as that one is.  Unless it `leaps`, what it is told otherwise is a turn: one that touches the floor
        turns faster than two rates tell."""
        last, self.leap = self._last, LEVEL
        if last is None or sample.stamp_ns > last.stamp_ns:
            self._lead = self.lead_at(sample.stamp_ns)
            self._last = sample
            if last is not None:
                self._follow(last, sample, leaps=leaps)
        return sample.leant_by(*self._lead)

    def _follow(self, last: Attitude, sample: Attitude, *, leaps: bool) -> None:
        dt_s = (sample.stamp_ns - last.stamp_ns) * 1e-9
        if dt_s > GAP_S:
            return
        turns = (
            (self._roll, sample.roll_rad - last.roll_rad, last.roll_rate_radps, sample.roll_rate_radps),
            (self._pitch, sample.pitch_rad - last.pitch_rad, last.pitch_rate_radps, sample.pitch_rate_radps),
        )
        leapt = [gyro.leapt_rad(sample.stamp_ns, told, rates, dt_s) for gyro, told, *rates in turns]
        if leaps and any(leapt):
            self.leap = Lean(*leapt)
            self.leaps += 1
            self._lead = Lean(*(_bounded(at - by) for at, by in zip(self._lead, self.leap, strict=True)))
        # what was taken for leaps was none
        if self._roll.is_wrong:
            self._lead = self._lead._replace(roll_rad=0.0)
        if self._pitch.is_wrong:
            self._lead = self._lead._replace(pitch_rad=0.0)


class _Gyro:
    """One axis: whether the gyro explains what is told to be turned."""

    def __init__(self) -> None:
        self._turned_rad2 = self._unexplained_rad2 = 0.0
        self._leapt_ns: deque[int] = deque(maxlen=_MOST_LEAPS)
        self.is_wrong = False
        """It was found wrong, and has not been found right since."""

    def leapt_rad(self, stamp_ns: int, told_rad: float, rates_radps: list[float], dt_s: float) -> float:
        """What was told to be turned more than was felt between two samples; 0 where that is no leap."""
        fastest = max(abs(rate) for rate in rates_radps)
        felt_rad = 0.5 * sum(rates_radps) * dt_s
        if not (math.isfinite(felt_rad) and fastest <= _MOST_RADPS):
            return 0.0
        explains = self._explains
        self.is_wrong = self.is_wrong and not explains
        apart_rad = told_rad - felt_rad
        leaps = explains and abs(apart_rad) > LEAP_RAD + _STAMPS_S * fastest
        self._mind(told_rad, 0.0 if leaps else apart_rad, dt_s)
        if not leaps:
            return 0.0
        often = len(self._leapt_ns) == _MOST_LEAPS and stamp_ns - self._leapt_ns[0] < _WITHIN_NS
        self._leapt_ns.append(stamp_ns)
        if often:
            self._unexplained_rad2, self.is_wrong = self._turned_rad2, True
            return 0.0
        return apart_rad

    @property
    def _explains(self) -> bool:
        few = self._turned_rad2 < _TURNED_RAD2
        return not few and self._unexplained_rad2 < _UNEXPLAINED * self._turned_rad2

    def _mind(self, told_rad: float, unexplained_rad: float, dt_s: float) -> None:
        """Add up squares, of what leaps at most those of a leap."""
        kept = math.exp(-dt_s / _PROOF_S)
        turned = kept * self._turned_rad2 + min(told_rad**2, LEAP_RAD**2)
        unexplained = kept * self._unexplained_rad2 + min(unexplained_rad**2, LEAP_RAD**2)
        share = min(_MOST_TURNED_RAD2 / turned, 1.0) if turned else 1.0
        self._turned_rad2, self._unexplained_rad2 = share * turned, share * unexplained


def _bounded(lead_rad: float) -> float:
    return min(max(lead_rad, -_MOST_RAD), _MOST_RAD)
