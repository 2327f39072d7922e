"""Attitude, height and clock: the value at any recent time."""

from __future__ import annotations

import math
import random

import numpy as np
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
    history = AttitudeHistory()
    assert history.at(0) is None
    history.add(Attitude(1000, 0.0, 0.0, 0.0))
    assert history.at(999) is None
    assert history.at(150_001_000) is not None
    assert history.at(150_001_001) is None


def test_a_sample_from_the_past_is_ignored() -> None:
    history = AttitudeHistory()
    history.add(Attitude(100, 0.1, 0.0, 0.0))
    history.add(Attitude(50, 9.0, 0.0, 0.0))
    assert history.newest == Attitude(100, 0.1, 0.0, 0.0)


def test_what_is_assumed_gives_way_to_the_next_measured_sample_however_late() -> None:
    history = AttitudeHistory()
    history.add(Attitude(100, 0.1, 0.0, 0.0))
    history.assume(Attitude(stamp_ns, 0.5, 0.0, 0.0) for stamp_ns in (300, 320, 340))
    assert history.is_assumed(310)
    assert history.measured_ns == 100
    assert not history.is_assumed(100)
    history.add(Attitude(200, 0.2, 0.0, 0.0))
    assert history.newest == Attitude(200, 0.2, 0.0, 0.0)
    assert not history.is_assumed(200)
    history.assume([Attitude(360, 0.5, 0.0, 0.0)])
    assert history.is_assumed(250)
    assert not history.is_assumed(150)


def test_a_silence_longer_than_the_memory_leaves_only_what_is_assumed() -> None:
    history = AttitudeHistory(keep_ns=100)
    history.add(Attitude(100, 0.1, 0.0, 0.0))
    history.assume(Attitude(stamp_ns, 0.5, 0.0, 0.0) for stamp_ns in range(120, 500, 20))
    assert history.is_assumed(490)
    history.add(Attitude(500, 0.2, 0.0, 0.0))
    assert history.newest == Attitude(500, 0.2, 0.0, 0.0)
    assert history.at(450) is None


def test_height_follows_the_climb_past_the_newest_sample_but_not_for_long() -> None:
    history = HeightHistory()
    history.add(0, 1.0, 1.0)
    history.add(100_000_000, 1.1, 1.0)
    history.add(150_000_000, math.nan, 0.5)
    assert history.at(50_000_000) == pytest.approx(1.05)
    assert history.at(200_000_000) == pytest.approx(1.2)
    assert math.isnan(history.at(1_200_000_000))


@pytest.mark.parametrize("scatter_m", [0.005, 0.04])
def test_a_noisy_range_finder_is_averaged_over_by_the_climb_rate(scatter_m: float) -> None:
    history, rng = HeightHistory(), random.Random(1)
    raw, told = [], []
    for step in range(400):
        true_m = 1.0 + 0.3 * math.sin(0.05 * step)
        climb_mps = 0.3 * 0.05 * math.cos(0.05 * step) / 0.05
        off_m = rng.gauss(0.0, scatter_m)
        history.add(step * 50_000_000, true_m + off_m, climb_mps)
        raw.append(off_m)
        told.append(history.at(step * 50_000_000) - true_m)
    rms, raw_rms = (math.sqrt(math.fsum(x * x for x in of[100:]) / 300) for of in (told, raw))
    assert rms < 0.6 * raw_rms if scatter_m > 0.01 else rms < raw_rms
    assert history.sigma_m == pytest.approx(scatter_m, rel=0.4)
    assert 0.4 * rms < history.error_m < 2.5 * rms


def test_another_floor_is_taken_at_once() -> None:
    history = HeightHistory()
    for step in range(40):
        history.add(step * 50_000_000, 1.6, 0.0)
    history.add(40 * 50_000_000, 1.2, 0.0)
    assert history.at(40 * 50_000_000) == 1.2


@given(
    offset=st.integers(-(10**12), 10**12),
    delays=st.lists(st.integers(0, 10_000_000), min_size=5, max_size=60),
)
def test_jitter_leaves_the_mapped_time_within_the_least_delay_seen(offset: int, delays: list[int]) -> None:
    clock = DeviceClock(latency_ns=60_000_000)
    for i, delay in enumerate([0, *delays]):
        taken = i * 33_000_000
        stamp = clock.to_ours(taken + offset, taken + 60_000_000 + delay)
        assert stamp is not None
        assert 0 <= stamp - taken < 700_000  # what two clocks may drift apart, 300 ppm


MS = 1_000_000


@pytest.mark.parametrize("ppm", [-200, 200])
def test_frames_of_a_clock_that_drifts_grow_no_older_in_ten_minutes(ppm: int) -> None:
    clock = DeviceClock(latency_ns=60 * MS)
    jitter = np.random.default_rng(3).integers(0, 10 * MS, 18_000)
    errors = []
    for k, late_ns in enumerate(jitter.tolist()):
        taken = k * 33 * MS
        stamp = clock.to_ours(round(taken * (1.0 + ppm * 1e-6)), taken + 60 * MS + late_ns)
        assert stamp is not None
        errors.append(stamp - taken)
    assert np.percentile(np.abs(errors[300:]), 99) < 2 * MS


def test_a_message_that_comes_late_and_out_of_order_has_no_time_and_moves_nothing() -> None:
    clock = DeviceClock(latency_ns=0)
    assert [clock.to_ours(k * 33 * MS + 10**12, k * 33 * MS) for k in (0, 1, 2, 6)] == [
        k * 33 * MS for k in (0, 1, 2, 6)
    ]
    assert clock.to_ours(2 * 33 * MS + 10**12, 7 * 33 * MS) is None, "150 ms late"
    assert clock.to_ours(6 * 33 * MS + 10**12, 7 * 33 * MS) is None, "a second time"
    stamp = clock.to_ours(8 * 33 * MS + 10**12, 8 * 33 * MS + 5 * MS)
    assert stamp == pytest.approx(8 * 33 * MS, abs=30_000)


def test_a_lone_straggler_after_a_long_silence_is_no_device_that_counts_anew() -> None:
    clock = DeviceClock(latency_ns=0)
    clock.to_ours(10_000 * MS, 0)
    assert clock.to_ours(9_900 * MS, 3_000 * MS) is None
    assert clock.to_ours(13_033 * MS, 3_033 * MS) == pytest.approx(3_033 * MS, abs=MS)
    assert clock.to_ours(9_933 * MS, 6_000 * MS) is None
    assert clock.to_ours(9_966 * MS, 6_001 * MS) is None


def test_a_device_clock_that_starts_again_is_taken_anew_after_three_messages() -> None:
    clock = DeviceClock(latency_ns=0)
    clock.to_ours(10**12, 500 * MS)
    stamps = [clock.to_ours(k * 33 * MS, (2_000 + k * 33) * MS) for k in range(4)]
    assert stamps[:2] == [None, None]
    assert stamps[2:] == [(2_000 + k * 33) * MS for k in (2, 3)]


@given(order=st.permutations(range(12)))
def test_whatever_the_order_of_arrival_stamps_only_grow_and_are_true(order: list[int]) -> None:
    """Frames of 30 ms each, all there within 0.4 s: what is given a time has the true one or a later one by
    the delay of the first."""
    clock = DeviceClock(latency_ns=0)
    taken = [(k, clock.to_ours(k * 30 * MS, (i * 30 + 400) * MS)) for i, k in enumerate(order)]
    stamps = [(k, stamp) for k, stamp in taken if stamp is not None]
    assert [k for k, _ in stamps] == sorted(k for k, _ in stamps)
    first_delay = (400 - order[0] * 30) * MS
    assert all(stamp <= k * 30 * MS + first_delay + 200_000 for k, stamp in stamps)


@pytest.mark.parametrize("ahead_ms", [20, 100, 300])
@pytest.mark.parametrize("when", [0, 5, 40])
def test_a_lone_stamp_ahead_of_its_time_makes_no_later_frame_older(ahead_ms: int, when: int) -> None:
    clock, jitter = DeviceClock(latency_ns=60 * MS), np.random.default_rng(4).integers(0, 10 * MS, 90)
    for k, late_ns in enumerate(jitter.tolist()):
        taken = k * 33 * MS
        ahead, delay = (ahead_ms * MS, 0) if k == when else (0, late_ns)
        stamp = clock.to_ours(taken + ahead + 10**12, taken + 60 * MS + delay)
        if k == when > 10:
            assert stamp is None
        elif k > when + 20:
            assert stamp is not None
            assert abs(stamp - taken) < 10 * MS


def test_where_the_first_messages_come_late_none_is_left_out() -> None:
    clock = DeviceClock(latency_ns=0)
    for k in range(12):
        taken = k * 33 * MS
        stamp = clock.to_ours(taken + 10**12, taken + max(80 - 20 * k, 0) * MS)
        assert stamp == pytest.approx(taken + max(80 - 20 * k, 0) * MS, abs=MS)


def test_a_path_that_grows_faster_is_followed_after_three_messages() -> None:
    clock = DeviceClock(latency_ns=0)
    for k in range(40):
        taken = k * 33 * MS
        stamp = clock.to_ours(taken + 10**12, taken + (80 * MS if k < 20 else 0))
        if k in {20, 21}:
            assert stamp is None
        elif k >= 20:
            assert stamp == pytest.approx(taken, abs=MS)
    assert clock.offset_ns == pytest.approx(-(10**12), abs=MS)


def test_a_climb_rate_that_errs_does_not_carry_the_height_away_from_what_is_measured() -> None:
    heights, rng = HeightHistory(), random.Random(5)
    for n in range(150):
        t_s = n * 0.02
        heights.add(n * 20_000_000, 1.6 + 0.8 * t_s + rng.gauss(0.0, 0.01), 0.0)  # it tells that it hovers
        if n > 10:
            assert heights.at(n * 20_000_000) == pytest.approx(1.6 + 0.8 * t_s, abs=0.06)
    assert heights.sigma_m < 0.02
