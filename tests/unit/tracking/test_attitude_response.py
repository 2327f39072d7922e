"""What becomes of setpoints: delay and bandwidth are found, and the attitude to come is foreseen."""

from __future__ import annotations

import math
import random
from collections.abc import Iterator

import pytest

from flightd.core.types import Attitude, AttitudeSetpoint
from flightd.tracking.attitude_history import AttitudeHistory
from flightd.tracking.attitude_response import AttitudeResponse

TICK_NS = 20_000_000
START_NS = 1_000_000_000_000


class Vehicle:
    """Obeys setpoints after `delay_s` by an attitude loop like the simulated airframe's, and tells of it
    after `told_s`; it holds `trim_rad` more roll than it is asked for."""

    def __init__(self, delay_s: float, told_s: float, omega: float = 10.0, trim_rad: float = 0.0) -> None:
        self._delay, self._told, self._omega = round(delay_s / 0.02), round(told_s / 0.02), omega
        self._trim_rad = trim_rad
        self._sent: list[AttitudeSetpoint] = []
        self.samples: list[Attitude] = []
        self._state = [0.0, 0.0, 0.0, 0.0]
        self._yaw_rad = self._yaw_rate = 0.0

    def step(self, now_ns: int, setpoint: AttitudeSetpoint) -> Attitude | None:
        """What is heard at that time."""
        self._sent.append(setpoint)
        if len(self._sent) > self._delay:
            obeyed = self._sent[-1 - self._delay]
            for _ in range(10):
                self._turn(obeyed, 0.002)
        roll, _, pitch, _ = self._state
        self.samples.append(Attitude(now_ns, roll + self._trim_rad, pitch, self._yaw_rad))
        return self.samples[-1 - self._told] if len(self.samples) > self._told else None

    def _turn(self, wanted: AttitudeSetpoint, dt_s: float) -> None:
        s, w = self._state, self._omega
        for at, target in ((0, wanted.roll_rad), (2, wanted.pitch_rad)):
            s[at + 1] += (w * w * (target - s[at]) - 1.88 * w * s[at + 1]) * dt_s
            s[at] += s[at + 1] * dt_s
        self._yaw_rate += (wanted.yaw_rate_radps - self._yaw_rate) * dt_s / 0.2
        self._yaw_rad += self._yaw_rate * dt_s


def wishes(seed: int = 1) -> Iterator[AttitudeSetpoint]:
    """Setpoints as a position loop makes them, wandering within some degrees."""
    rng, roll, pitch = random.Random(seed), 0.0, 0.0
    while True:
        roll += -0.04 * roll + rng.gauss(0.0, 0.008)
        pitch += -0.04 * pitch + rng.gauss(0.0, 0.008)
        yield AttitudeSetpoint(0, roll, pitch, 0.3)


def flown(vehicle: Vehicle, seconds: float, *, obeys: bool = True) -> tuple[AttitudeResponse, int]:
    response, now_ns, setpoint = AttitudeResponse(), START_NS, None
    for _, wish in zip(range(round(seconds / 0.02)), wishes(), strict=False):
        now_ns += TICK_NS
        response.sent(now_ns, setpoint)
        heard = vehicle.step(now_ns, setpoint or AttitudeSetpoint(0))
        if heard is not None:
            response.told(heard, obeys=obeys)
        setpoint = wish
    return response, now_ns


@pytest.mark.parametrize("delay_s", [0.0, 0.06, 0.12, 0.2])
def test_the_delay_is_found_within_seconds_of_flight(delay_s: float) -> None:
    response, _ = flown(Vehicle(delay_s, told_s=0.1), 8.0)
    lag_s = response.delay_s + 2.0 / response.bandwidth_radps
    assert lag_s == pytest.approx(delay_s + 0.188, abs=0.025), "delay and lag of the loop together"
    assert response.delay_sigma_s < 0.02


@pytest.mark.parametrize("told_s", [0.02, 0.12, 0.3])
def test_the_attitude_that_is_not_told_yet_is_foreseen(told_s: float) -> None:
    """Better by far than the newest that was told, at every moment until a new setpoint acts."""
    vehicle = Vehicle(0.08, told_s)
    response, now_ns = flown(vehicle, 8.0)
    off, stale = [], []
    setpoint = AttitudeSetpoint(0)
    for wish in (wish for _, wish in zip(range(100), wishes(7), strict=False)):
        now_ns += TICK_NS
        response.sent(now_ns, setpoint)
        heard = vehicle.step(now_ns, setpoint)
        assert heard is not None
        response.told(heard, obeys=True)
        foreseen = response.foreseen(now_ns)
        assert foreseen[-1].stamp_ns == pytest.approx(now_ns + response.lead_s * 1e9, abs=1e6)
        history = AttitudeHistory()
        history.add(heard)
        history.assume(foreseen)
        now = history.at(now_ns)
        assert now is not None
        truth = vehicle.samples[-1]
        off.append(math.hypot(now.roll_rad - truth.roll_rad, now.pitch_rad - truth.pitch_rad))
        stale.append(math.hypot(heard.roll_rad - truth.roll_rad, heard.pitch_rad - truth.pitch_rad))
        setpoint = wish
    rms, rms_stale = (math.sqrt(math.fsum(x * x for x in of) / len(of)) for of in (off, stale))
    assert rms < max(0.35 * rms_stale, math.radians(0.15))


def test_a_trim_that_lasts_is_no_delay_and_stays() -> None:
    vehicle = Vehicle(0.08, told_s=0.1, trim_rad=0.03)
    response, now_ns = flown(vehicle, 8.0)
    assert response.delay_s + 2.0 / response.bandwidth_radps == pytest.approx(0.268, abs=0.025)
    foreseen = [one.roll_rad for one in response.foreseen(now_ns)]
    assert foreseen[0] == pytest.approx(vehicle.samples[-6].roll_rad, abs=0.01)


def test_a_vehicle_that_does_not_obey_teaches_nothing() -> None:
    response, _ = flown(Vehicle(0.2, told_s=0.1), 8.0, obeys=False)
    first = AttitudeResponse()
    assert (response.delay_s, response.delay_sigma_s) == (first.delay_s, first.delay_sigma_s)


def test_a_silent_one_is_foreseen_to_lean_and_turn_as_it_was_told() -> None:
    response, now_ns = flown(Vehicle(0.04, told_s=0.02), 8.0)
    asked = AttitudeSetpoint(0, -0.1, 0.02, 0.5)
    for _ in range(75):
        now_ns += TICK_NS
        response.sent(now_ns, asked)
    last = response.foreseen(now_ns)[-1]
    assert (last.roll_rad, last.pitch_rad) == pytest.approx((-0.1, 0.02), abs=0.02)


def test_nothing_is_foreseen_before_anything_was_told_or_sent() -> None:
    response = AttitudeResponse()
    assert response.foreseen(START_NS) == []
    response.told(Attitude(START_NS, 0.0, 0.0, 0.0), obeys=True)
    assert response.foreseen(START_NS) == []


def test_a_vehicle_that_fell_silent_for_long_is_still_known_by_what_it_told_last() -> None:
    response, history = AttitudeResponse(), AttitudeHistory()
    told = Attitude(START_NS, 0.02, -0.01, 0.3)
    for n in range(1_000):  # twenty seconds
        now_ns = START_NS - 1_000_000_000 + n * TICK_NS
        response.sent(now_ns, AttitudeSetpoint(now_ns, roll_rad=0.05))
        if now_ns == START_NS:
            history.add(told)
            response.told(told, obeys=True)
        history.assume(response.foreseen(now_ns))
        if now_ns >= START_NS:
            assert history.newest is not None
            assert history.measured_ns == START_NS


def test_what_a_setpoint_makes_of_the_attitude_is_foreseen_into_the_lag_of_the_loop() -> None:
    """As it will be if the newest setpoint stays in force: nearer by far than the last that acts by then."""
    vehicle = Vehicle(0.08, told_s=0.1)
    response, now_ns = flown(vehicle, 8.0)
    setpoint = AttitudeSetpoint(0, 0.15, -0.1)
    for _ in range(5):
        now_ns += TICK_NS
        response.sent(now_ns, setpoint)
        response.told(vehicle.step(now_ns, setpoint) or vehicle.samples[0], obeys=True)
    foreseen = response.foreseen(now_ns)
    reached, begun = (
        foreseen[-1],
        next(one for one in foreseen if one.stamp_ns > now_ns + response.delay_s * 1e9),
    )
    for _ in range(round(response.lead_s / 0.02)):
        now_ns += TICK_NS
        vehicle.step(now_ns, setpoint)
    truth = vehicle.samples[-1]
    assert abs(truth.roll_rad - reached.roll_rad) < 0.25 * abs(truth.roll_rad - begun.roll_rad)
    assert abs(truth.pitch_rad - reached.pitch_rad) < 0.25 * abs(truth.pitch_rad - begun.pitch_rad)


def test_of_a_vehicle_that_somebody_else_flies_no_answer_is_foreseen() -> None:
    """To the last setpoint that was in force, perhaps a steep one, it answers no more."""
    response, now_ns = flown(Vehicle(0.08, told_s=0.1), 4.0)
    for n in range(50):
        now_ns += TICK_NS
        response.sent(now_ns, AttitudeSetpoint(now_ns, 0.15) if n < 10 else None)
        response.told(Attitude(now_ns, 0.0, 0.0, 0.0), obeys=n < 10)
    assert all(abs(one.roll_rad) < 1e-6 for one in response.foreseen(now_ns))
