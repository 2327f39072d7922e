"""The autopilot's clock against ours: offset and rate together, and how well.

What comes from there was sent before it is heard, what we send is stamped there after it was sent: each way
bounds the offset from one side, and the fastest messages bound it best.  So both ways are followed by
themselves, by the line that touches the fastest messages of the last seconds, and only where they lie apart
is halved (V. Paxson, On calibrating measurements of packet transit times, SIGMETRICS 1998; the line is the
likeliest one for delays that are a least one and an exponential rest).  A way that jitters by tens of
milliseconds is known to a few of them then, for some messages are always fast.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from flightd.core.geometry import Matrix

ASK_FAST_S, ASK_S = 0.1, 0.2
"""Between questions: until the clocks are compared, and from then on."""

_WINDOW_NS = 10_000_000_000
_ASKED_MAX = 64
_SETTLED = 8
_PLAUSIBLE_ROUND_TRIP_NS = 500_000_000
_JUMP_NS = 500_000_000
_BUCKET_NS = 100_000_000
"""Of the messages heard within so long only the fastest counts."""
_FLOOR_NS = 200_000.0
"""So much an offset errs by even where nothing delays a message."""
_RATE_SIGMA = 0.01
"""A rate that nothing was measured of: crystals keep 50 ppm, simulated or overloaded autopilots do not."""
_RATE_MOST, _RATES, _REFINED = 0.1, 41, 4
"""The rate is sought among so many within this, so often again around the best."""
_CONTRADICTING = 3
_SLACK_NS = 1_000_000.0
_LEAP_NS = 15_000_000.0
"""What comes faster by more than this may have a wrong stamp, and tells nothing until others confirm it."""
_FEW = 4
"""The delays of so many of the fastest messages say how near to the least delay the very fastest is."""
_SPREAD = sum(1.0 / n for n in range(1, _FEW + 1))
_LEAST_SPAN_NS = 1_000_000_000.0
_ASYMMETRY = 0.25
"""Share of the fastest round trip by which ways of different length put the offset wrong."""
_FOUND_NS = 45_000_000.0
"""So much of that is no error to fly by: it is constant, and found in flight with the camera's delay."""
_WANDER, _WANDER_SHARE = 2e-4, 0.2
"""What a rate may have changed by when it was measured no longer: a strange one changes the most."""


class _Way:
    """The messages of one way: their clock less ours as each of them showed it, too small by its delay
    (`side` +1: heard from there) or too large (-1: stamped there)."""

    def __init__(self, side: int) -> None:
        self.side = side
        self.samples: deque[tuple[int, int]] = deque()
        """Time of ours and offset, ns; of each bucket the fastest."""
        self._against: list[tuple[int, int]] = []
        """Of the messages that came faster than any can: time of ours and offset."""

    def clear(self) -> None:
        self.samples.clear()
        self._against.clear()

    def add(self, at_ns: int, offset_ns: int) -> None:
        samples = self.samples
        if samples and at_ns // _BUCKET_NS == samples[-1][0] // _BUCKET_NS:
            if self.side * (offset_ns - samples[-1][1]) <= 0:
                return
            samples.pop()
        samples.append((at_ns, offset_ns))

    def since(self, first_ns: int) -> None:
        """Forget what was before."""
        while self.samples and self.samples[0][0] < first_ns:
            self.samples.popleft()

    def changed_ns(self, at_ns: int, offset_ns: int) -> int | None:
        """When messages began to come faster than any can; None for a lone one.  This one did."""
        self._against = [one for one in self._against if at_ns - one[0] < _WINDOW_NS / 2]
        self._against.append((at_ns, offset_ns))
        if len(self._against) < _CONTRADICTING:
            return None
        # those that were kept back, too
        self.samples = deque(sorted({*self.samples, *self._against}))
        first_ns, self._against = self._against[0][0], []
        return first_ns


@dataclass(frozen=True, slots=True)
class _Fit:
    """The offset at `at_ns` is `offset_ns` plus `part_ns`, and grows by `rate` (ns per ns).  The fastest
    messages of either way lie `apart_ns` from each other; `sigma` is that of the offset at `middle_ns`."""

    at_ns: int
    offset_ns: int
    part_ns: float
    rate: float
    apart_ns: float
    middle_ns: int
    sigma: float
    rate_sigma: float

    def offset_at(self, ours_ns: int) -> float:
        """Beyond `offset_ns`."""
        return self.part_ns + self.rate * (ours_ns - self.at_ns)

    def sigma_ns(self, ours_ns: int) -> float:
        by_rate = self.rate_sigma * (ours_ns - self.middle_ns)
        wander = (_WANDER + _WANDER_SHARE * abs(self.rate)) * max(ours_ns - self.at_ns, 0)
        return math.hypot(self.sigma, by_rate) + wander

    def faster_ns(self, way: _Way, at_ns: int, offset_ns: int) -> float:
        """By how much a message came faster than the fastest that the line knows."""
        bound_ns = self.offset_at(at_ns) - way.side * self.apart_ns / 2
        return way.side * (offset_ns - self.offset_ns - bound_ns)


class ClockSync:
    """Offset and rate of the autopilot's clock.

    Give `heard` each stamped message, `ask` and `answered` the questions about its time.  Messages that the
    line cannot have (the clock jumped, its rate changed) end what was before them.
    """

    def __init__(self) -> None:
        self._down, self._up = _Way(1), _Way(-1)
        self._asked: deque[int] = deque(maxlen=_ASKED_MAX)
        self._trips = 0
        self._fit: _Fit | None = None

    @property
    def offset_ns(self) -> int | None:
        """Their clock less ours at the newest answer; None until a first one came."""
        return None if self._fit is None else self._fit.offset_ns + round(self._fit.part_ns)

    @property
    def rate(self) -> float:
        """By how much faster than ours it runs: 0.01 is 10 ms a second."""
        return 0.0 if self._fit is None else self._fit.rate

    @property
    def is_settled(self) -> bool:
        return self._trips >= _SETTLED

    def error_s(self, now_ns: int) -> float:
        """By how much times of that clock may be wrong in ours, one standard deviation, but for what is the
        same all the time; NaN before the clocks are compared."""
        if self._fit is None:
            return math.nan
        uneven_ns = max(_ASYMMETRY * self._fit.apart_ns - _FOUND_NS, 0.0)
        return (self._fit.sigma_ns(now_ns) + uneven_ns) * 1e-9

    def reset(self) -> None:
        """The other clock started anew."""
        self._asked.clear()
        self._forget()

    def ask(self, now_ns: int) -> int:
        """The time stamp of a new question."""
        self._asked.append(now_ns)
        return now_ns

    def heard(self, theirs_ns: int, now_ns: int) -> None:
        """Take a message that was stamped then; it tells nothing before the first answer."""
        if self._fit is not None:
            self._take(self._down, now_ns, theirs_ns - now_ns)
            self._down.since(now_ns - _WINDOW_NS)  # answers, which end it else, may stop coming

    def answered(self, ts1_ns: int, tc1_ns: int, now_ns: int) -> bool:
        """Take an answer; False when we did not ask (another client's answer, a late or forged one)."""
        round_trip_ns = now_ns - ts1_ns
        if ts1_ns not in self._asked or not 0 <= round_trip_ns <= _PLAUSIBLE_ROUND_TRIP_NS:
            return False
        self._asked.remove(ts1_ns)
        fit, half_ns = self._fit, ts1_ns + round_trip_ns // 2
        if fit is not None and abs(tc1_ns - half_ns - fit.offset_ns - fit.offset_at(half_ns)) > _JUMP_NS:
            self._forget()
        self._take(self._up, ts1_ns, tc1_ns - ts1_ns)
        self._take(self._down, now_ns, tc1_ns - now_ns)
        self._trips += 1
        for way in (self._down, self._up):
            way.since(now_ns - _WINDOW_NS)
        if self._up.samples and self._down.samples:
            self._fit = _fitted(self._down, self._up, now_ns)
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

    def _forget(self) -> None:
        self._down.clear()
        self._up.clear()
        self._fit, self._trips = None, 0

    def _take(self, way: _Way, at_ns: int, offset_ns: int) -> None:
        """Add a message, without those before when it and others are faster than any of that clock can be."""
        fit = self._fit
        if fit is not None:
            told_ns = _SLACK_NS + 3.0 * fit.sigma_ns(at_ns)
            faster_ns = fit.faster_ns(way, at_ns, offset_ns)
            changed_ns = way.changed_ns(at_ns, offset_ns) if faster_ns > told_ns else None
            if changed_ns is None and faster_ns > told_ns + _LEAP_NS and self.is_settled:
                return
            if changed_ns is not None:
                self._down.since(changed_ns)
                self._up.since(changed_ns)
        way.add(at_ns, offset_ns)


def _fitted(down: _Way, up: _Way, now_ns: int) -> _Fit:
    """The line between the fastest messages of both ways; the rate is held near zero by a prior."""
    offset_ns = up.samples[-1][1]
    ways = [(way.side, *_relative(way, now_ns, offset_ns)) for way in (down, up)]
    rate = _likeliest(ways)
    gaps, bounds = [], []
    for side, at_ns, seen_ns in ways:
        level = side * (seen_ns - rate * at_ns)
        bounds.append(side * float(level.max()))
        gaps.append(np.sort(level.max() - level))
    errors = [_least_error(gap) for gap in gaps]
    span_ns = max(*(-float(at_ns.min()) for _, at_ns, _ in ways), _LEAST_SPAN_NS)
    finest = 1.0 / math.hypot(*(1.0 / error for error in errors))
    return _Fit(
        at_ns=now_ns,
        offset_ns=offset_ns,
        part_ns=(bounds[0] + bounds[1]) / 2,
        rate=rate,
        apart_ns=max(bounds[1] - bounds[0], 0.0),
        middle_ns=now_ns - round(span_ns / 2),
        sigma=math.hypot(*errors) / 2,
        rate_sigma=1.0 / math.hypot(1.0 / _RATE_SIGMA, span_ns / (2.0 * finest)),
    )


def _relative(way: _Way, now_ns: int, offset_ns: int) -> tuple[Matrix, Matrix]:
    """Times before now and offsets beyond `offset_ns`, ns."""
    at_ns = np.array([when - now_ns for when, _ in way.samples], dtype=np.float64)
    return at_ns, np.array([seen - offset_ns for _, seen in way.samples], dtype=np.float64)


def _likeliest(ways: list[tuple[int, Matrix, Matrix]]) -> float:
    """The rate at which the messages' delays beyond the least of their way are the likeliest: exponential
    ones of the mean that they have at the best rate of a first round."""
    middle, width = 0.0, _RATE_MOST
    means = [math.inf for _ in ways]
    for _ in range(_REFINED):
        rates = np.linspace(middle - width, middle + width, _RATES)
        costs = 0.5 * (rates / _RATE_SIGMA) ** 2
        delays = []
        for (side, at_ns, seen_ns), mean in zip(ways, means, strict=True):
            level = side * (seen_ns[None, :] - rates[:, None] * at_ns[None, :])
            late = level.max(axis=1) - level.mean(axis=1)
            delays.append(late)
            costs = costs + len(at_ns) * late / (mean if math.isfinite(mean) else 1.0)
        best = int(costs.argmin())
        means = [max(float(late[best]), _FLOOR_NS) for late in delays]
        middle, width = float(rates[best]), 2.0 * width / (_RATES - 1) if math.isfinite(means[0]) else width
    return middle


def _least_error(gaps: Matrix) -> float:
    """By how much the fastest message may be slower than the least delay, from the delays (sorted, ns) of
    those next to it; what a single one tells is its way's whole jitter, which nobody knows."""
    if len(gaps) < 2:
        return _FLOOR_NS + _SLACK_NS
    few = min(_FEW, len(gaps) - 1)
    return _FLOOR_NS + float(gaps[few]) / (_SPREAD if few == _FEW else 1.0)
