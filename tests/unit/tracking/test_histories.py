"""Attitude, height and clock: the value at any recent time."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.core.types import Attitude
from flightd.tracking.attitude_history import AttitudeHistory
from flightd.tracking.device_clock import DeviceClock
from flightd.tracking.height_history import HeightHistory


def test_attitude_is_interpolated_across_the_wrap_of_yaw() -> None:
    history = AttitudeHistory()
    history.add(Attitude(0, 0.0, 0.1, math.pi - 0.1))
    history.add(Attitude(100, 0.2, 0.3, -math.pi + 0.1))
    middle = history.at(50)
    assert middle is not None
    assert middle.roll_rad == pytest.approx(0.1)
    assert middle.pitch_rad == pytest.approx(0.2)
    assert abs(abs(middle.yaw_rad) - math.pi) < 1e-9


def test_attitude_is_not_invented_before_the_first_or_long_after_the_last_sample() -> None:
    history = AttitudeHistory(hold_ns=100)
    assert history.at(0) is None
    history.add(Attitude(1000, 0.0, 0.0, 0.0))
    assert history.at(999) is None
    assert history.at(1100) is not None
    assert history.at(1101) is None


def test_a_sample_from_the_past_is_ignored() -> None:
    history = AttitudeHistory()
    history.add(Attitude(100, 0.1, 0.0, 0.0))
    history.add(Attitude(50, 9.0, 0.0, 0.0))
    assert history.newest == Attitude(100, 0.1, 0.0, 0.0)


def test_what_is_assumed_gives_way_to_the_next_measured_sample_however_late() -> None:
    history = AttitudeHistory()
    history.add(Attitude(100, 0.1, 0.0, 0.0))
    for stamp_ns in (300, 320, 340):
        history.assume(Attitude(stamp_ns, 0.5, 0.0, 0.0))
    assert history.is_assumed(310)
    assert not history.is_assumed(100)
    history.add(Attitude(200, 0.2, 0.0, 0.0))
    assert history.newest == Attitude(200, 0.2, 0.0, 0.0)
    assert not history.is_assumed(200)
    history.assume(Attitude(360, 0.5, 0.0, 0.0))
    assert history.is_assumed(250)
    assert not history.is_assumed(150)


def test_a_silence_longer_than_the_memory_leaves_only_what_is_assumed() -> None:
    history = AttitudeHistory(keep_ns=100)
    history.add(Attitude(100, 0.1, 0.0, 0.0))
    for stamp_ns in range(120, 500, 20):
        history.assume(Attitude(stamp_ns, 0.5, 0.0, 0.0))
    assert history.is_assumed(490)
    history.add(Attitude(500, 0.2, 0.0, 0.0))
    assert history.newest == Attitude(500, 0.2, 0.0, 0.0)
    assert history.at(450) is None


def test_height_follows_the_climb_past_the_newest_sample_but_not_for_long() -> None:
    history = HeightHistory()
    history.add(0, 1.0, 0.5)
    history.add(100_000_000, 1.1, 0.5)
    history.add(150_000_000, math.nan, 0.5)
    assert history.at(50_000_000) == pytest.approx(1.05)
    assert history.at(200_000_000) == pytest.approx(1.15)
    assert math.isnan(history.at(1_200_000_000))


@given(
    offset=st.integers(-(10**12), 10**12),
    delays=st.lists(st.integers(0, 10_000_000), min_size=5, max_size=60),
)
def test_jitter_leaves_the_mapped_time_within_the_least_delay_seen(offset: int, delays: list[int]) -> None:
    clock = DeviceClock(latency_ns=60_000_000)
    stamps = []
    for i, delay in enumerate([0, *delays]):
        taken = i * 33_000_000
        stamps.append(clock.to_ours(taken + offset, taken + 60_000_000 + delay) - taken)
    assert all(0 <= error < 200_000 for error in stamps)  # drift allowance only: 50 ppm


def test_a_device_clock_that_starts_again_is_taken_anew() -> None:
    clock = DeviceClock(latency_ns=0)
    clock.to_ours(10**12, 500)
    assert clock.to_ours(5, 2000) == 2000
