"""The autopilot's clock against ours, by TIMESYNC round trips: offset and rate together, and how well."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

ASK_FAST_S, ASK_S = 0.1, 0.2
"""Between questions: until the clocks are compared, and from then on."""

_WINDOW_NS = 5_000_000_000
_TRIPS_MAX = 64
_SETTLED = 8
_PLAUSIBLE_ROUND_TRIP_NS = 500_000_000
_JUMP_NS = 500_000_000
_FLOOR_NS = 200_000.0
"""So much a trip's offset errs by even where nothing delays it."""
_RATE_SIGMA = 0.01
"""A rate that nothing was measured of: crystals keep 50 ppm, simulated or overloaded autopilots do not."""
_CONTRADICTING = 3
_SLACK_NS = 1_000_000.0
_ASYMMETRY = 0.25
"""Share of the fastest round trip by which ways of different length put the offset wrong."""
_FOUND_NS = 30_000_000.0
"""So much of that is no error to fly by: it is constant, and found in flight with the camera's delay."""
_WANDER, _WANDER_SHARE = 2e-4, 0.2
"""What a rate may have changed by when it was measured no longer: a strange one changes the most."""


@dataclass(frozen=True, slots=True)
class _Trip:
    """Their clock less ours half-way, `at_ns` of ours."""

    at_ns: int
    offset_ns: int
    round_trip_ns: int


@dataclass(frozen=True, slots=True)
class _Fit:
    """The offset at `at_ns` is `offset_ns` plus `part_ns`, and grows by `rate` (ns per ns); with variances
    and covariance of part and rate."""

    at_ns: int
    offset_ns: int
    part_ns: float
    rate: float
    variance: float
    covariance: float
    rate_variance: float

    def offset_at(self, ours_ns: int) -> float:
        """Beyond `offset_ns`."""
        return self.part_ns + self.rate * (ours_ns - self.at_ns)

    def sigma_ns(self, ours_ns: int) -> float:
        age_ns = float(ours_ns - self.at_ns)
        square = self.variance + 2.0 * self.covariance * age_ns + self.rate_variance * age_ns * age_ns
        wander = _WANDER + _WANDER_SHARE * abs(self.rate)
        return math.sqrt(max(square, 0.0)) + wander * abs(age_ns)


class ClockSync:
    """Offset and rate of the autopilot's clock, by a line through the trips of the last seconds.

    Somewhere within its round trip each answer was given: a fast trip tells much, a slow one little.  Trips
    that the line cannot have (the clock jumped, its rate changed) end what was before them.
    """

    def __init__(self) -> None:
        self._trips: deque[_Trip] = deque(maxlen=_TRIPS_MAX)
        self._against: list[_Trip] = []
        self._asked: deque[int] = deque(maxlen=_TRIPS_MAX)
        self._fit: _Fit | None = None

    @property
    def offset_ns(self) -> int | None:
        """Their clock less ours at the newest trip; None until a first answer came."""
        return None if self._fit is None else self._fit.offset_ns + round(self._fit.part_ns)

    @property
    def rate(self) -> float:
        """By how much faster than ours it runs: 0.01 is 10 ms a second."""
        return 0.0 if self._fit is None else self._fit.rate

    @property
    def is_settled(self) -> bool:
        return len(self._trips) >= _SETTLED

    def error_s(self, now_ns: int) -> float:
        """By how much times of that clock may be wrong in ours, one standard deviation, but for what is the
        same all the time; NaN before the clocks are compared."""
        if self._fit is None:
            return math.nan
        fastest_ns = min(trip.round_trip_ns for trip in self._trips)
        return (self._fit.sigma_ns(now_ns) + max(_ASYMMETRY * fastest_ns - _FOUND_NS, 0.0)) * 1e-9

    def reset(self) -> None:
        """The other clock started anew."""
        self._trips.clear()
        self._against.clear()
        self._asked.clear()
        self._fit = None

    def ask(self, now_ns: int) -> int:
        """The time stamp of a new question."""
        self._asked.append(now_ns)
        return now_ns

    def answered(self, ts1_ns: int, tc1_ns: int, now_ns: int) -> bool:
        """Take an answer; False when we did not ask (another client's answer, a late or forged one)."""
        round_trip_ns = now_ns - ts1_ns
        if ts1_ns not in self._asked or not 0 <= round_trip_ns <= _PLAUSIBLE_ROUND_TRIP_NS:
            return False
        self._asked.remove(ts1_ns)
        half_ns = round_trip_ns // 2
        self._judge(_Trip(ts1_ns + half_ns, tc1_ns - ts1_ns - half_ns, round_trip_ns))
        while self._trips[-1].at_ns - self._trips[0].at_ns > _WINDOW_NS:
            self._trips.popleft()
        self._fit = _fitted(self._trips)
        return True

    def to_ours(self, theirs_ns: int) -> int | None:
        """Our time of a stamp of theirs; None while the clocks are not compared."""
        fit = self._fit
        if fit is None:
            return None
        since_ns = theirs_ns - fit.offset_ns - fit.at_ns
        return fit.at_ns + round((since_ns - fit.part_ns) / (1.0 + fit.rate))

    def to_theirs(self, ours_ns: int) -> int | None:
        """Their time of one of ours; None while the clocks are not compared."""
        fit = self._fit
        return None if fit is None else ours_ns + fit.offset_ns + round(fit.offset_at(ours_ns))

    def _judge(self, trip: _Trip) -> None:
        """Add a trip, without those before it when it and others cannot be what the clock was until then."""
        fit, against = self._fit, self._against
        wrong_ns = 0.0 if fit is None else abs(trip.offset_ns - fit.offset_ns - fit.offset_at(trip.at_ns))
        if wrong_ns > _JUMP_NS:
            self._trips.clear()
            against.clear()
        elif fit is not None:
            told_ns = trip.round_trip_ns / 2 + _SLACK_NS + 3.0 * fit.sigma_ns(trip.at_ns)
            if wrong_ns > told_ns:
                against.append(trip)
            elif against and trip.round_trip_ns <= max(other.round_trip_ns for other in against):
                against.clear()  # a passing disturbance
        self._trips.append(trip)
        if len(against) >= _CONTRADICTING:
            while self._trips[0] is not against[0]:
                self._trips.popleft()
            against.clear()


def _fitted(trips: deque[_Trip]) -> _Fit:
    """The line through the trips, weighted by what each can tell; the rate is held near zero by a prior."""
    newest = trips[-1]
    fastest_ns = min(trip.round_trip_ns for trip in trips)
    s = sx = sy = sxy = 0.0
    sxx = 1.0 / _RATE_SIGMA**2
    for trip in trips:
        sigma = _FLOOR_NS + (trip.round_trip_ns - fastest_ns) / math.sqrt(12.0)
        weight = 1.0 / (sigma * sigma)
        x, y = float(trip.at_ns - newest.at_ns), float(trip.offset_ns - newest.offset_ns)
        s, sx, sy = s + weight, sx + weight * x, sy + weight * y
        sxx, sxy = sxx + weight * x * x, sxy + weight * x * y
    det = s * sxx - sx * sx
    return _Fit(
        at_ns=newest.at_ns,
        offset_ns=newest.offset_ns,
        part_ns=(sxx * sy - sx * sxy) / det,
        rate=(s * sxy - sx * sy) / det,
        variance=sxx / det,
        covariance=-sx / det,
        rate_variance=s / det,
    )
