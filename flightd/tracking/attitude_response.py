"""What becomes of the setpoints that were sent: the attitude that is not told yet, and the one to come.

Telemetry comes late and so do setpoints: what the vehicle tells is what it made of those of a while ago.
Both ways together with the autopilot's own attitude loop are a delay and a lag of the second order; which,
shows in what was told of what was sent.  All of many delays and bandwidths are tried at once, and the
likeliest is believed.  From the newest told attitude on, its answer to the setpoints sent since is the best
guess there is: up to the moment at which a setpoint that goes out now begins to act, and through most of the
lag after it (a Smith predictor's model: O. Smith, Closer control of loops with dead time, 1957).  Pure.
"""

from __future__ import annotations

import math

import numpy as np

from flightd.core.geometry import Matrix, wrap_pi
from flightd.core.types import Attitude, AttitudeSetpoint

_DELAYS_S: Matrix = np.arange(0.0, 0.305, 0.01)
_DELAYS_NS: Matrix = _DELAYS_S * 1e9
_BANDWIDTHS_RADPS: Matrix = np.array([6.0, 8.0, 10.0, 13.0, 17.0])
"""Of an attitude loop without overshoot."""
_FIRST_DELAY_S, _DELAY_SIGMA_S = 0.04, 0.04
_FIRST_BANDWIDTH_RADPS, _BANDWIDTH_SIGMA = 10.0, 0.3
"""Before anything was seen of it; the bandwidth's is that of its logarithm."""
_LAG_SHARE = 0.75
"""How far into the attitude loop's own lag, 2 / bandwidth, the motion is foreseen: a loop that is closed over
the motion by then swings less where gusts push, and hovers no less still where none does."""
_YAW_LAG_S = 0.2
_STEP_S = 0.02
_KEPT = 1200
"""So many ticks are remembered at least."""
_MEMORY_S = 8.0
"""Of what was seen while the vehicle was moved; of a hover nothing is learnt, and nothing forgotten."""
_MOVED_RADPS = math.radians(6.0)
_INDEPENDENT_PER_S = 6.0
"""Errors of a model follow each other: so many of them a second tell something new."""
_STEADY_S = 2.0
"""A constant difference between attitude and setpoint (trim) says nothing of the delay."""
_FORESEEN_NS = 9_000_000_000
"""Of a vehicle that fell silent no more is foreseen: by then it has been held, and brought down by setpoints
that brake its drift; what it does later nobody knows."""
_MOST_STEPS = 150
_LEAST_RAD = math.radians(0.15)
_SHARED_S = 0.02
"""Most that the delay believed moves at once."""


_MODELS, _TILT = slice(None), slice(2)
"""Of the axes of an answer, which are roll, pitch and yaw."""
_COUNT: Matrix = np.arange(_MOST_STEPS + 1.0)


class _Kept:
    """The answers of the last seconds, for each model."""

    def __init__(self, models: int) -> None:
        self._times: Matrix = np.zeros(2 * _KEPT)
        self._answers: Matrix = np.zeros((2 * _KEPT, models, 3))
        self._count = 0

    @property
    def oldest_ns(self) -> float:
        """Where they begin; infinite while there are fewer than two."""
        return float(self._times[0]) if self._count > 1 else math.inf

    def add(self, now_ns: int, answer: Matrix) -> None:
        if self._count == len(self._times):
            self._times[:_KEPT], self._answers[:_KEPT] = self._times[_KEPT:], self._answers[_KEPT:]
            self._count = _KEPT
        self._times[self._count], self._answers[self._count] = now_ns, answer
        self._count += 1

    def at(self, times_ns: Matrix, *of: int | slice) -> Matrix:
        """(N, ...) the undelayed answers at (N,) times, `of` a model or these models and axes; beyond what is
        kept its first and last."""
        times = self._times[: self._count]
        after = times.searchsorted(times_ns)
        np.maximum(
            np.minimum(after, self._count - 1, out=after), 1, out=after
        )  # np.clip takes five times as long
        earlier = after - 1
        old_ns = times[earlier]
        share = (times_ns - old_ns) / (times[after] - old_ns)
        np.maximum(np.minimum(share, 1.0, out=share), 0.0, out=share)
        before = self._answers.take(earlier, axis=0)[:, *of]
        between: Matrix = self._answers.take(after, axis=0)[:, *of]
        between -= before
        between *= share.reshape(-1, *[1] * (between.ndim - 1))
        between += before
        return between


class AttitudeResponse:
    """Call `sent` at each tick, `told` with each sample, then `foreseen`."""

    def __init__(self) -> None:
        models = len(_BANDWIDTHS_RADPS)
        self._now_ns: int | None = None
        self._answer: Matrix = np.zeros((models, 3))
        self._speed: Matrix = np.zeros((models, 3))
        self._kept = _Kept(models)
        self._told: Attitude | None = None
        self._wanted: Matrix = np.zeros(2)
        self._steady: Matrix = np.zeros((len(_DELAYS_S), models, 2))
        self._square: Matrix = np.zeros((len(_DELAYS_S), models))
        self._seen_s = self._settled_s = 0.0
        off_delay = (_DELAYS_S - _FIRST_DELAY_S) / _DELAY_SIGMA_S
        off_bandwidth = np.log(_BANDWIDTHS_RADPS / _FIRST_BANDWIDTH_RADPS) / _BANDWIDTH_SIGMA
        self._prior: Matrix = 0.5 * (off_delay[:, None] ** 2 + off_bandwidth[None, :] ** 2)
        self.delay_s, self.delay_sigma_s = _FIRST_DELAY_S, _DELAY_SIGMA_S
        """From a setpoint's sending to the first of its answer, as telemetry's stamps have it."""
        self._model = int(np.abs(_BANDWIDTHS_RADPS - _FIRST_BANDWIDTH_RADPS).argmin())

    @property
    def bandwidth_radps(self) -> float:
        """Of the attitude loop, as far as is known."""
        return float(_BANDWIDTHS_RADPS[self._model])

    @property
    def lead_s(self) -> float:
        """So long after its sending a setpoint has most of its effect."""
        return self.delay_s + _LAG_SHARE * 2.0 / self.bandwidth_radps

    def sent(self, now_ns: int, setpoint: AttitudeSetpoint | None) -> None:
        """What was in force since the last call; None: nothing was sent, and the vehicle does as it likes."""
        last_ns, self._now_ns = self._now_ns, now_ns
        if last_ns is None or now_ns <= last_ns:
            return
        told = self._told
        if setpoint is not None:
            self._move((now_ns - last_ns) * 1e-9, setpoint)
        elif told is not None:
            self._wanted = np.array([told.roll_rad, told.pitch_rad])
            self._answer[:, _TILT] = self._wanted
            self._speed[:] = 0.0
        self._kept.add(now_ns, self._answer)

    def told(self, sample: Attitude, *, obeys: bool) -> None:
        """Take a sample of telemetry; of a vehicle that does not obey the setpoints nothing is learnt."""
        last, self._told = self._told, sample
        if not obeys or last is None:
            self._settled_s = 0.0
            return
        dt_s = (sample.stamp_ns - last.stamp_ns) * 1e-9
        reaches_back = sample.stamp_ns - self._kept.oldest_ns > _DELAYS_NS[-1]
        if 0.0 < dt_s < _STEADY_S and reaches_back:
            self._learn(sample, dt_s)

    def foreseen(self, now_ns: int) -> list[Attitude]:
        """The attitude from the newest told one on, for `lead_s` were the setpoint before to stay in force;
        empty while none was told or nothing was sent."""
        told = self._told
        if told is None or math.isinf(self._kept.oldest_ns):
            return []
        ahead_ns = min(now_ns + round(self.lead_s * 1e9) - told.stamp_ns, _FORESEEN_NS)
        steps = min(math.ceil(ahead_ns * 1e-9 / _STEP_S), _MOST_STEPS)
        if steps <= 0 or told.stamp_ns < self._kept.oldest_ns:
            return []
        after_ns = _COUNT[: steps + 1] * (ahead_ns / steps)
        after_ns[-1] = ahead_ns
        sent_ns = told.stamp_ns + after_ns - self.delay_s * 1e9
        answers = self._kept.at(sent_ns, self._model)
        to_come = int(sent_ns.searchsorted(now_ns, side="right"))
        answers[to_come:, _TILT] = self._to_come((sent_ns[to_come:, None] - now_ns) * 1e-9)
        gained = (answers - answers[0]).tolist()
        return [
            Attitude(
                told.stamp_ns + round(after),
                told.roll_rad + roll,
                told.pitch_rad + pitch,
                wrap_pi(told.yaw_rad + yaw),
            )
            for after, (roll, pitch, yaw) in zip(after_ns[1:].tolist(), gained[1:], strict=True)
        ]

    # How

    def _move(self, dt_s: float, setpoint: AttitudeSetpoint) -> None:
        """Answer the setpoint for a while."""
        self._wanted = np.array([setpoint.roll_rad, setpoint.pitch_rad])
        off, speed = self._answer[:, _TILT] - self._wanted, self._speed[:, _TILT]
        off, self._speed[:, _TILT] = _settled(off, speed, _BANDWIDTHS_RADPS[:, None], dt_s)
        self._answer[:, _TILT] = self._wanted + off
        turn = self._speed[:, 2] + (setpoint.yaw_rate_radps - self._speed[:, 2]) * (
            1.0 - math.exp(-dt_s / _YAW_LAG_S)
        )
        self._answer[:, 2] += 0.5 * (self._speed[:, 2] + turn) * dt_s
        self._speed[:, 2] = turn

    def _to_come(self, after_s: Matrix) -> Matrix:
        """(N, 2) roll and pitch, undelayed, (N, 1) seconds after the newest answer."""
        answer, speed = self._answer[self._model, _TILT], self._speed[self._model, _TILT]
        if not len(after_s):
            return np.zeros((0, 2))
        return self._wanted + _settled(answer - self._wanted, speed, self.bandwidth_radps, after_s)[0]

    def _learn(self, sample: Attitude, dt_s: float) -> None:
        answers = self._kept.at(sample.stamp_ns - _DELAYS_NS, _MODELS, _TILT)
        errors = np.array([sample.roll_rad, sample.pitch_rad]) - answers
        self._settled_s += dt_s
        self._steady += min(dt_s / min(_STEADY_S, self._settled_s), 1.0) * (errors - self._steady)
        speed_radps = max(map(abs, self._speed[self._model, _TILT].tolist()))
        told_s = dt_s * min((speed_radps / _MOVED_RADPS) ** 2, 1.0)
        if not told_s or self._settled_s < 0.5:
            return
        self._seen_s = min(self._seen_s + told_s, _MEMORY_S)
        squares = np.square(errors - self._steady)
        off = (squares[..., 0] + squares[..., 1]) / 2.0
        self._square += min(told_s / self._seen_s, 1.0) * (off - self._square)
        self._believe()

    def _believe(self) -> None:
        least = max(float(self._square.min()), _LEAST_RAD**2)
        cost = self._prior + 0.5 * self._seen_s * _INDEPENDENT_PER_S * self._square / least
        odds = np.exp(cost.min() - cost)
        self._model = int(odds.sum(axis=0).argmax())
        odds = odds[:, self._model]
        odds = odds / odds.sum()
        mean_s = float(odds @ _DELAYS_S)
        self.delay_sigma_s = math.sqrt(float(odds @ np.square(_DELAYS_S - mean_s)))
        self.delay_s += min(max(mean_s - self.delay_s, -_SHARED_S), _SHARED_S)


def _settled(
    off: Matrix, speed: Matrix, bandwidth_radps: Matrix | float, after_s: Matrix | float
) -> tuple[Matrix, Matrix]:
    """What is left of an error and its rate: critically damped, exactly."""
    fade, push = np.exp(-bandwidth_radps * after_s), speed + bandwidth_radps * off
    return (off + push * after_s) * fade, (speed - bandwidth_radps * push * after_s) * fade
