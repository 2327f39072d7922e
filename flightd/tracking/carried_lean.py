"""Roll and pitch carried by the vehicle's gyros over a leap of those that it tells.  Pure."""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

from flightd.core.types import Attitude

LEAP_RAD, _OFTEN_S, _STAMPS_S = math.radians(1.0), 0.02, 0.02
"""A told roll or pitch that turns by more than this between two samples, in longer than `_OFTEN_S` by as much
more, and by more than the rate turns it in `_STAMPS_S`, by which stamps may be wrong, while the gyros felt
none of it, leaps: the autopilot takes another estimator's, or its own anew."""
_LEAST_RAD = 0.5 * LEAP_RAD
"""What leaps back leaps by this at least; less, that has all but faded, is taken back without being told."""
GAP_S = 0.06
"""Over longer ones two rates do not tell what was turned between them."""
_NOISE_S, _SIGMAS = 1.0, 5.0
"""Nor is what shaking makes of the rates a leap."""
_MOST_RADPS = 10.0
_WINDOW_S = 0.1
_TURNED_RAD2, _MOST_TURNED_RAD2, _UNEXPLAINED = math.radians(1.0) ** 2, math.radians(3.5) ** 2, 0.2
"""Gyros are believed that have explained turns, each over a window, of that sum of squares, all but so much
of it; the sum holds the newest ones up to the second."""
_PROOF_S = 60.0
_MOST_LEAPS, _WITHIN_NS = 2, 1_000_000_000
"""No estimator leaps more often, nor in two samples one after the other the same way: then it is the gyros
that are wrong, and have to prove themselves anew."""
_MOST_RAD = math.radians(10.0)


class Lean(NamedTuple):
    """Of roll and pitch, rad."""

    roll_rad: float
    pitch_rad: float

    def times(self, share: float) -> Lean:
        return Lean(share * self.roll_rad, share * self.pitch_rad)

    def plus(self, other: Lean) -> Lean:
        return Lean(self.roll_rad + other.roll_rad, self.pitch_rad + other.pitch_rad)

    def within(self, most_rad: float) -> Lean:
        """Each of the two brought to at most that, either way."""
        roll, pitch = (min(max(one, -most_rad), most_rad) for one in self)
        return Lean(roll, pitch)


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
        return self._faded(stamp_ns).within(_MOST_RAD)

    def take(self, sample: Attitude, *, leaps: bool = True) -> Attitude:
        """The sample with roll and pitch as they are carried on; one that is not newer than the last is told
        as that one is.  Unless it `leaps`, what it is told otherwise is a turn: one that touches the floor
        turns faster than two rates tell."""
        last, self.leap = self._last, LEVEL
        if last is None or sample.stamp_ns > last.stamp_ns:
            self._lead = self._faded(sample.stamp_ns)
            self._last = sample
            if last is not None:
                self._follow(last, sample, leaps=leaps)
        return sample.leant_by(*self.lead_at(sample.stamp_ns))

    def _faded(self, stamp_ns: int) -> Lean:
        """The lead as all leaps together make it: what leaps back cancels what leapt, however far."""
        last = self._last
        if last is None or self._lead == LEVEL:
            return LEVEL
        return self._lead.times(math.exp(min(last.stamp_ns - stamp_ns, 0) * 1e-9 / self._fade_s))

    def _follow(self, last: Attitude, sample: Attitude, *, leaps: bool) -> None:
        dt_s = (sample.stamp_ns - last.stamp_ns) * 1e-9
        if dt_s > GAP_S:
            self._roll.pause()
            self._pitch.pause()
            return
        roll_rates = last.roll_rate_radps, sample.roll_rate_radps
        pitch_rates = last.pitch_rate_radps, sample.pitch_rate_radps
        lead, stamp_ns = self._lead, sample.stamp_ns
        told = sample.roll_rad - last.roll_rad, sample.pitch_rad - last.pitch_rad
        roll = self._roll.step(stamp_ns, Turn(told[0], roll_rates, dt_s), lead.roll_rad, leaps=leaps)
        pitch = self._pitch.step(stamp_ns, Turn(told[1], pitch_rates, dt_s), lead.pitch_rad, leaps=leaps)
        if roll or pitch:
            self.leap = Lean(roll, pitch)
            self.leaps += max(abs(roll), abs(pitch)) >= _LEAST_RAD
            self._lead = lead.plus(self.leap.times(-1.0))


class Turn(NamedTuple):
    """Of one angle between two samples: what was told, the gyro's rates at both, and the time."""

    told_rad: float
    rates_radps: tuple[float, float]
    dt_s: float

    @property
    def felt_rad(self) -> float:
        return 0.5 * sum(self.rates_radps) * self.dt_s

    @property
    def fastest_radps(self) -> float:
        return max(map(abs, self.rates_radps))

    @property
    def is_felt(self) -> bool:
        return math.isfinite(sum(self.rates_radps)) and self.fastest_radps <= _MOST_RADPS

    @property
    def apart_rad(self) -> float:
        return self.told_rad - self.felt_rad

    @property
    def most_apart_rad(self) -> float:
        """What is no leap yet, of gyros that do not shake."""
        return LEAP_RAD * max(self.dt_s / _OFTEN_S, 1.0) + _STAMPS_S * self.fastest_radps


class _Gyro:
    """One axis: whether the gyro explains what is told to be turned."""

    def __init__(self) -> None:
        self._turned_rad2 = self._unexplained_rad2 = 0.0
        self._told_rad = self._felt_rad = self._window_s = self._noise_rad2 = 0.0
        self._leapt_ns: deque[int] = deque(maxlen=_MOST_LEAPS)
        self._leapt_rad = 0.0
        """What the sample before leapt by."""

    def step(self, stamp_ns: int, turn: Turn, lead_rad: float, *, leaps: bool) -> float:
        """What was told to be turned more than was felt, 0 where that is no leap; `lead_rad` is what has been
        carried so far: all of it leaps back where the gyro no longer explains what is told, and where the
        told angle leaps back, be it at the floor or in the midst of a turn."""
        before_rad, self._leapt_rad = self._leapt_rad, 0.0
        if not turn.is_felt:
            return 0.0
        if abs(turn.apart_rad - lead_rad) < _LEAST_RAD < min(abs(turn.apart_rad), abs(lead_rad)):
            return lead_rad
        most_rad, apart_rad = max(turn.most_apart_rad, _SIGMAS * math.sqrt(self._noise_rad2)), turn.apart_rad
        is_turn = abs(apart_rad) <= most_rad
        if is_turn or (leaps and not self._explains):
            self._mind(turn)
            return 0.0 if self._explains else lead_rad
        if not leaps:
            return 0.0
        often = len(self._leapt_ns) == _MOST_LEAPS and stamp_ns - self._leapt_ns[0] < _WITHIN_NS
        if often or before_rad * apart_rad > 0.0:
            self._turned_rad2 = self._unexplained_rad2 = 0.0
            return lead_rad
        self._leapt_ns.append(stamp_ns)
        self._leapt_rad = apart_rad
        return apart_rad

    def pause(self) -> None:
        """The sample to come is none right after the last."""
        self._leapt_rad = 0.0

    @property
    def _explains(self) -> bool:
        few = self._turned_rad2 < _TURNED_RAD2
        return not few and self._unexplained_rad2 < _UNEXPLAINED * self._turned_rad2

    def _mind(self, turn: Turn) -> None:
        """Add up squares of turns over a window each, in which noise averages out."""
        self._noise_rad2 += min(turn.dt_s / _NOISE_S, 1.0) * (turn.apart_rad**2 - self._noise_rad2)
        self._told_rad += turn.told_rad
        self._felt_rad += turn.felt_rad
        self._window_s += turn.dt_s
        if self._window_s < _WINDOW_S:
            return
        kept = math.exp(-self._window_s / _PROOF_S)
        turned = kept * self._turned_rad2 + self._told_rad**2
        unexplained = kept * self._unexplained_rad2 + (self._told_rad - self._felt_rad) ** 2
        share = min(_MOST_TURNED_RAD2 / turned, 1.0) if turned else 1.0
        self._turned_rad2, self._unexplained_rad2 = share * turned, share * unexplained
        self._told_rad = self._felt_rad = self._window_s = 0.0
