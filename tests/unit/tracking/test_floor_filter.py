"""The filter of motion and sensors: honest sigmas, wind, false lines, and what it learns of the sensors."""

from __future__ import annotations

import math
import random

from flightd.config.tracking import MotionNoise, SensorPriors
from flightd.tracking.floor_filter import FIRST_LINE, PUSH_X, VX, FloorFilter
from flightd.tracking.line_sight import LineSight, Rates

FRAME_NS = 33_333_333
STILL = Rates(0.0, 0.0, 0.0)
SURE = SensorPriors(
    attitude_deg=1e-4, mount_deg=1e-4, delay_s=1e-6, scale_share=1e-6, shake_deg=0.03, most_shake_deg=0.031
)
"""Nothing is unknown of the sensors."""


def sight(offset_m: float, sigma_m: float = 0.005) -> LineSight:
    """A line across x, straight below."""
    return LineSight(0, offset_m, 0.0, math.nan, sigma_m, 0.01, 0.075, -0.5, 0.5, *[(0.0, 0.0)] * 4)


def floor_filter(noise: MotionNoise, forget_ns: int = 10**10) -> FloorFilter:
    return FloorFilter(noise, SURE, gate_m=0.35, forget_ns=forget_ns)


def test_tracked_sigmas_are_honest() -> None:
    """Normalised errors of one axis over many runs have a spread near one."""
    noise = MotionNoise()
    errors: list[float] = []
    for seed in range(300):
        rng = random.Random(seed)
        floor = floor_filter(noise)
        x = 0.0
        v, push = rng.gauss(0, noise.start_velocity_mps), rng.gauss(0, noise.start_disturbance_mps2)
        dt = 1 / 30
        for step in range(60):
            if step:
                accel = rng.gauss(0, noise.accel_mps2 / dt**0.5)
                push += rng.gauss(0, noise.disturbance_mps2 * dt**0.5)
                x += v * dt + 0.5 * (accel + push) * dt * dt
                v += (accel + push - noise.drag_per_s * v) * dt
                floor.predict(dt, 0.0, 0.0, 0.0)
            if step < 40:
                floor.update([sight(0.5 - x + rng.gauss(0, 0.01), 0.01)], STILL, step)
        offset_m, sigma_m = floor.offset(0)
        errors.append((offset_m - (0.5 - x)) / sigma_m)
    spread = (sum(e * e for e in errors) / len(errors)) ** 0.5
    assert 0.8 < spread < 1.25


def test_wind_that_sets_in_is_soon_known_and_calm_air_stays_calm() -> None:
    rng = random.Random(1)
    floor = floor_filter(MotionNoise(drag_per_s=0.0))
    dt = 1 / 30
    x = v = 0.0
    felt = []
    for step in range(120):
        push = 0.9 if step >= 90 else 0.0
        x += v * dt + 0.5 * push * dt * dt
        v += push * dt
        floor.predict(dt, 0.0, 0.0, 0.0)
        floor.update([sight(0.5 - x + rng.gauss(0, 0.004))], STILL, step * FRAME_NS)
        felt.append(floor.mean(PUSH_X))
    assert max(map(abs, felt[30:90])) < 0.2
    assert max(felt[:107]) > 0.6, "half a second after it began"
    assert 0.7 < felt[-1] < 1.1


def test_a_false_line_nearby_starts_a_track_of_its_own() -> None:
    floor = floor_filter(MotionNoise(), forget_ns=10**9)
    for step in range(20):
        floor.predict(1 / 30, 0.0, 0.0, 0.0)
        floor.update([sight(0.2), sight(0.9)], STILL, step * FRAME_NS)
    first = [round(floor.offset(line)[0], 2) for line in range(len(floor.held))]
    floor.update([sight(0.2), sight(0.5)], STILL, 21 * FRAME_NS)
    assert sorted(first) == [0.2, 0.9]
    assert len(floor.held) == 3
    floor.update([], STILL, 10**10)
    assert floor.held == [], "lines not seen for long are forgotten"


def test_who_knows_no_line_any_more_still_knows_his_sensors() -> None:
    floor = FloorFilter(MotionNoise(), SensorPriors(), gate_m=0.35, forget_ns=10**9)
    tilted = sight(0.2)._replace(offset_per_tilt=(-1.6, 0.0), offset_per_mount=(-1.6, 0.0))
    for step in range(60):
        floor.predict(1 / 30, 0.0, 0.0, 0.0)
        floor.update([tilted], STILL, step * FRAME_NS)
    before = [floor.mean(state) for state in range(PUSH_X + 2, FIRST_LINE)]
    floor.forget()
    assert floor.mean(VX) == 0.0
    assert [floor.mean(state) for state in range(PUSH_X + 2, FIRST_LINE)] == before
    assert floor.held == []
