"""The camera's delay from rocking the drone by hand."""

from __future__ import annotations

import math
import random
from functools import partial

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.core.geometry import Lens, Mount, ground_homography, normalise_line
from flightd.core.types import Attitude, Line
from flightd.tracking.delay_by_tilt import DelayByTilt, FollowedLines, delay_by_tilt

LENS = Lens(640, 360, 381.4, 381.4, 319.5, 179.5)
SECONDS, START_S = 12.0, 100.0


class Hand:
    """Holds a drone over two crossing lines and rocks it about its wrist, drifting as hands do."""

    def __init__(self, seed: int, rocks_rad: float = math.radians(7.0), ahead_m: float = 0.0) -> None:
        rng = random.Random(seed)
        self._rocks_rad, self._ahead_m = rocks_rad, ahead_m
        self._hz = [rng.uniform(0.5, 1.3) for _ in range(2)]
        self._phase = [rng.uniform(0.0, math.tau) for _ in range(2)]
        self._drift = [rng.uniform(0.02, 0.06) for _ in range(2)]
        self._slow_hz = [rng.uniform(0.05, 0.15) for _ in range(2)]
        self._wrist_m = rng.uniform(-0.3, 0.3)

    def tilt(self, t: float) -> tuple[float, float]:
        roll, pitch = (
            self._rocks_rad * math.sin(math.tau * hz * t + phase)
            for hz, phase in zip(self._hz, self._phase, strict=True)
        )
        return roll, pitch

    def place(self, t: float) -> tuple[float, float]:
        """Forward and right of the lines' crossing, m."""
        roll, pitch = self.tilt(t)
        slow = [
            size * math.sin(math.tau * hz * t) for size, hz in zip(self._drift, self._slow_hz, strict=True)
        ]
        return slow[0] - self._wrist_m * pitch - self._ahead_m, slow[1] + self._wrist_m * roll


def pixel(hand: Hand, t: float, mount: Mount, place: tuple[float, float]) -> tuple[float, float]:
    """Where a place on the floor (from the lines' crossing, m) is seen at that time, 1.1 m up."""
    homography, (forward, right) = ground_homography(LENS, mount, *hand.tilt(t)), hand.place(t)
    u, v, w = homography @ ((place[0] - forward) / 1.1, (place[1] - right) / 1.1, 1.0)
    return u / w - LENS.cx_px, v / w - LENS.cy_px


def seen_by(
    hand: Hand, t: float, noise_px: float, rng: random.Random, mount: Mount, readout_s: float = 0.0
) -> list[Line]:
    """The two lines as the camera has them whose middle row is exposed then."""
    lines = []
    for direction in ((1.0, 0.0), (0.0, 1.0)):
        pixels = []
        for along in (-0.3, 0.3):
            place, row_s = (along * direction[0], along * direction[1]), 0.0
            for _ in range(4):  # a point is seen when the row that it is seen in is exposed
                x, y = pixel(hand, t + row_s, mount, place)
                row_s = y / LENS.height_px * readout_s
            pixels.append((x, y))
        (ax, ay), (bx, by) = pixels
        normal = math.atan2(bx - ax, -(by - ay))
        rho = ax * math.cos(normal) + ay * math.sin(normal) + rng.gauss(0.0, noise_px)
        lines.append(Line(*normalise_line(rho, normal), 20.0, -150.0, 150.0, 1.0, 0.1, 0.001))
    return lines


def measured(
    delay_s: float,
    seed: int = 1,
    rocks_rad: float = math.radians(7.0),
    noise_px: float = 0.5,
    attitude_hz: float = 50.0,
    lost: float = 0.05,
    ahead_m: float = 0.0,
    readout_s: float = 0.0,
    configured_readout_s: float = 0.0,
) -> DelayByTilt:
    """What is told where frames are exposed so much later than their stamps say."""
    hand, rng = Hand(seed, rocks_rad, ahead_m), random.Random(seed)
    mount = Mount(yaw_rad=0.3, roll_rad=0.02)
    attitudes = [
        Attitude(round((START_S + n / attitude_hz) * 1e9), *hand.tilt(n / attitude_hz), 1.0)
        for n in range(round(SECONDS * attitude_hz))
    ]
    followed = FollowedLines(LENS, configured_readout_s)
    for n in range(round(SECONDS * 30)):
        t = n / 30
        lines = seen_by(hand, t + delay_s, noise_px, rng, mount, readout_s)
        followed.add(round((START_S + t) * 1e9), [line for line in lines if rng.random() >= lost])
    return delay_by_tilt(followed.runs, attitudes)


@given(delay_s=st.floats(-0.12, 0.25), seed=st.integers(1, 10_000))
@settings(max_examples=25, deadline=None)
def test_the_delay_is_told_to_milliseconds_whatever_the_hand_does_besides(delay_s: float, seed: int) -> None:
    told = measured(delay_s, seed)
    assert told.is_known
    assert told.delay_s == pytest.approx(delay_s, abs=0.005)
    assert told.explained > 0.9


def test_slow_telemetry_tells_it_too() -> None:
    assert measured(0.06, attitude_hz=10.0).delay_s == pytest.approx(0.06, abs=0.015)


def test_its_sigma_covers_what_noise_does() -> None:
    told = [measured(0.04, seed, noise_px=4.0) for seed in range(1, 21)]
    within = [abs(one.delay_s - 0.04) < 2.0 * one.sigma_s + 0.002 for one in told]
    assert sum(within) >= 18
    assert all(one.sigma_s < 0.01 for one in told)


@pytest.mark.parametrize("rocks_deg", [0.0, 0.5])
def test_a_drone_that_was_not_rocked_tells_nothing(rocks_deg: float) -> None:
    assert not measured(0.04, rocks_rad=math.radians(rocks_deg)).is_known


def test_a_delay_beyond_what_is_searched_is_not_guessed() -> None:
    told = measured(0.9, seed=3)
    assert not told.is_known or told.explained < 0.95


def test_without_attitude_or_lines_nothing_is_told() -> None:
    assert not delay_by_tilt([], []).is_known
    attitudes = [Attitude(n * 20_000_000, 0.1 * math.sin(n / 10), 0.0, 0.0) for n in range(500)]
    assert not delay_by_tilt([], attitudes).is_known


@pytest.mark.parametrize("ahead_m", [-0.3, 0.0, 0.3])
def test_a_line_far_from_the_middle_row_is_seen_when_its_own_row_is_exposed(ahead_m: float) -> None:
    rolling = partial(measured, 0.06, ahead_m=ahead_m, readout_s=0.03)
    assert rolling(configured_readout_s=0.03).delay_s == pytest.approx(0.06, abs=0.002)
    taken_at_once_s = rolling().delay_s - 0.06
    assert abs(taken_at_once_s) > 0.004 or not ahead_m
