"""The filter of motion and sensors: honest sigmas, wind, false lines, and what it learns of the sensors."""

from __future__ import annotations

import math
import random
from dataclasses import replace

import pytest

from flightd.config.tracking import MotionNoise, SensorPriors
from flightd.core.learnt import Learnt
from flightd.tracking.floor_filter import FloorFilter
from flightd.tracking.line_sight import FeatureSight, LineSight, Rates, feature_sight
from flightd.tracking.motion_model import DELAY, FIRST_LINE, MOUNT_PITCH, MOUNT_ROLL, PITCH, PSI, PUSH_X, VX

FRAME_NS = 33_333_333
STILL = Rates(0.0, 0.0, 0.0)
SURE = SensorPriors(
    attitude_deg=1e-4,
    leak_per_s=1e-6,
    mount_deg=1e-4,
    delay_s=1e-6,
    scale_share=1e-6,
    height_share=1e-6,
    shake_deg=0.03,
    most_shake_deg=0.031,
)
"""Nothing is unknown of the sensors."""


def sight(offset_m: float, sigma_m: float = 0.005) -> LineSight:
    """A line across x, straight below."""
    level = (0.0, 0.0)
    return LineSight(0, offset_m, math.nan, sigma_m, 0.01, 0.075, -0.5, 0.5, 0.0, level, level, level, level)


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


@pytest.mark.parametrize("askew_deg", [3.0, -3.9])
def test_a_line_askew_tells_no_tilt(askew_deg: float) -> None:
    """Beside two that are not: by its direction the drone would be pitched by a degree for good."""
    floor = FloorFilter(MotionNoise(), SensorPriors(), gate_m=0.35, forget_ns=10**9)
    along, askew_per_pitch = (0.0, 1.6), (0.0, 0.4)
    for step in range(150):
        pitched_rad, psi_rad = floor.mean(PITCH) + floor.mean(MOUNT_PITCH), floor.mean(PSI)
        straight = sight(-0.2 + 1.6 * pitched_rad)._replace(
            offset_per_tilt=along, offset_per_mount=along, turn_rad=psi_rad, sigma_theta_rad=0.004
        )
        askew = sight(0.67)._replace(
            axis=1,
            turn_rad=psi_rad + 0.4 * pitched_rad + math.radians(askew_deg),
            sigma_theta_rad=0.004,
            turn_per_tilt=askew_per_pitch,
            turn_per_mount=askew_per_pitch,
        )
        floor.predict(1 / 30, 0.0, 0.0, 0.0)
        other = straight._replace(offset_m=straight.offset_m + 1.0)
        floor.update([straight, other, askew] if step >= 60 else [straight, other], STILL, step * FRAME_NS)
    for state in (PITCH, MOUNT_PITCH, PSI):
        assert abs(math.degrees(floor.mean(state))) < 0.2


@pytest.mark.parametrize("turned_deg", [3.0, -3.0])
@pytest.mark.parametrize("lines", [1, 2])
def test_a_heading_that_is_told_wrong_from_one_moment_on_is_soon_put_right(
    lines: int, turned_deg: float
) -> None:
    """All lines contradict it, as one that is askew does."""
    floor, turned_rad = FloorFilter(MotionNoise(), SensorPriors(), 0.35, 10**9), 0.0
    for step in range(240):
        turned_rad = math.radians(turned_deg) if step >= 180 else 0.0
        seen = [
            sight(0.2 + line)._replace(turn_rad=floor.mean(PSI) + turned_rad, sigma_theta_rad=0.004)
            for line in range(lines)
        ]
        floor.predict(1 / 30, 0.0, 0.0, 0.0)
        floor.update(seen, STILL, step * FRAME_NS)
    assert abs(math.degrees(floor.mean(PSI) + turned_rad)) < 0.5


def test_a_line_is_placed_by_the_heading_that_its_own_frame_has_corrected() -> None:
    """Five degrees wrong on the pad; the first frame tells.  What it places is not moved by the next."""
    wrong = math.radians(5.0)
    floor = FloorFilter(MotionNoise(), SensorPriors(), gate_m=0.35, forget_ns=10**9)
    floor.turn_to(wrong, math.radians(5.0))
    along_m = 0.6
    for step in range(3):
        held_rad = floor.mean(PSI)
        turned = sight(0.2 - along_m * held_rad)._replace(
            offset_per_yaw=-along_m, turn_rad=held_rad, sigma_theta_rad=0.004
        )
        floor.predict(1 / 30, 0.0, 0.0, 0.0)
        floor.update([turned], STILL, step * FRAME_NS)
        offset_m, sigma_m = floor.offset(0)
        assert abs(offset_m - 0.2) < 3.0 * sigma_m
        assert abs(floor.mean(VX)) < 0.05


def test_lines_dropped_leave_the_others_and_a_covariance_that_is_one() -> None:
    floor = floor_filter(MotionNoise(), forget_ns=10**9)
    for step in range(10):
        floor.predict(1 / 30, 0.0, 0.0, 0.0)
        floor.update([sight(-0.8), sight(0.1), sight(0.9)], STILL, step * FRAME_NS)
    for step in range(10, 60):
        floor.predict(1 / 30, 0.0, 0.0, 0.0)
        floor.update([sight(-0.8), sight(0.9)], STILL, step * FRAME_NS)
    assert sorted(round(floor.offset(line)[0], 2) for line in range(len(floor.held))) == [-0.8, 0.9]
    assert all(floor.sigma(state) > 0.0 for state in range(FIRST_LINE + 2))


def test_a_delay_is_never_believed_beyond_what_can_be() -> None:
    floor = FloorFilter(MotionNoise(), SensorPriors(), gate_m=0.35, forget_ns=10**9, latency_s=0.04)
    for step in range(200):
        floor.predict(1 / 30, 0.0, 0.0, 0.0)
        swing = math.sin(step * 0.3)
        seen = sight(0.2 + 0.3 * swing)._replace(offset_per_tilt=(-1.6, 0.0), sigma_m=0.001)
        floor.update([seen], Rates(-3.0 * swing, 0.0, 0.0), step * FRAME_NS)
        assert -0.12 <= floor.mean(DELAY) <= 0.04
        assert abs(floor.mean(PUSH_X)) <= MotionNoise().max_disturbance_mps2


def test_what_was_learnt_is_begun_with_but_less_surely() -> None:
    first = FloorFilter(MotionNoise(), SensorPriors(), gate_m=0.35, forget_ns=10**9)
    for step in range(60):
        off = 0.8 * (first.mean(MOUNT_ROLL) - 0.02)
        left = sight(0.4)._replace(turn_per_mount=(0.8, 0.0), turn_rad=off)
        right = sight(-0.4)._replace(turn_per_mount=(-0.8, 0.0), turn_rad=-off)
        first.predict(1 / 30, 0.0, 0.0, 0.0)
        first.update([left, right], STILL, step * FRAME_NS)
    assert first.mean(MOUNT_ROLL) == pytest.approx(0.02, abs=0.002)
    second = FloorFilter(MotionNoise(), SensorPriors(), gate_m=0.35, forget_ns=10**9)
    second.begin_with(first.learnt())
    assert second.mean(MOUNT_ROLL) == first.mean(MOUNT_ROLL) != 0.0
    assert first.sigma(MOUNT_ROLL) < second.sigma(MOUNT_ROLL) < SensorPriors().mount_rad
    third = FloorFilter(MotionNoise(), SensorPriors(), gate_m=0.35, forget_ns=10**9)
    third.begin_with(replace(first.learnt(), means=(math.nan,) * len(Learnt)))
    assert third.mean(MOUNT_ROLL) == 0.0, "what is no number is not begun with"


def test_of_an_attitude_that_is_only_assumed_nothing_is_learnt_for_good() -> None:
    floor = FloorFilter(MotionNoise(), SensorPriors(), gate_m=0.35, forget_ns=10**9)
    for step in range(30):
        floor.predict(1 / 30, 0.0, 0.0, 0.0)
        told = sight(0.2 + 0.01 * step)._replace(offset_per_mount=(-1.6, 0.0))
        floor.update([told], Rates(1.0, 0.0, 0.0), step * FRAME_NS, assumed=True)
    assert [floor.mean(state) for state in (MOUNT_ROLL, DELAY)] == [0.0, 0.0]
    assert floor.mean(VX) != 0.0


def feature(id_: int, x_m: float, y_m: float) -> FeatureSight:
    return feature_sight(id_, (x_m, y_m), 0.0, (0.0, 0.0), 1.6, 0.004)


def blown(carried: bool, lines_until: int = 60, frames: int = 150) -> tuple[float, FloorFilter, int]:
    """A filter that has seen a line, then none while a gust pushes the drone: the error of its offset."""
    rng, dt, x, v, ids = random.Random(4), 1 / 30, 0.0, 0.0, 0
    floor = FloorFilter(MotionNoise(drag_per_s=0.0), SURE, gate_m=0.35, forget_ns=2_500_000_000)
    points = [(n, rng.uniform(-0.6, 3.0), rng.uniform(-0.5, 0.5)) for n in range(40)]
    for step in range(frames):
        push = 0.4 if step > lines_until else 0.0
        x, v = x + v * dt + 0.5 * push * dt * dt, v + push * dt
        if step:
            floor.predict(dt, 0.0, 0.0, 0.0)
        sights = [sight(0.5 - x + rng.gauss(0, 0.005))] if step < lines_until else []
        near = [
            feature(n, px - x + rng.gauss(0, 0.003), py + rng.gauss(0, 0.003))
            for n, px, py in points
            if abs(px - x) < 0.6
        ]
        ids += len(floor.update(sights, STILL, step * FRAME_NS, near[:6] if carried else []))
    lines = [n for n, held in enumerate(floor.held) if held.feature is None]
    return (abs(floor.offset(lines[0])[0] - (0.5 - x)) if lines else math.inf), floor, ids


def test_features_carry_a_line_that_is_no_longer_seen() -> None:
    error_m, floor, _ = blown(carried=True)
    (line,) = [n for n, held in enumerate(floor.held) if held.feature is None]
    assert error_m < 0.06
    assert error_m < 3.0 * floor.offset(line)[1]
    alone_m, *_ = blown(carried=False)
    assert alone_m > 10 * error_m  # forgotten, or far off


def test_a_feature_that_is_no_point_of_the_floor_is_refused_while_it_is_told() -> None:
    floor = floor_filter(MotionNoise())
    for step in range(40):
        if step:
            floor.predict(1 / 30, 0.0, 0.0, 0.0)
        jump_m = 0.3 if step >= 20 else 0.0
        places = [(1, 0.2, 0.1), (2, 0.1 + jump_m, -0.2), (3, -0.2, 0.3)]
        told = floor.update([], STILL, step * FRAME_NS, [feature(*place) for place in places])
        assert abs(floor.mean(VX)) < 0.02
        assert told == ({0, 1} if step else frozenset())
        assert {held.feature for held in floor.held} >= {1, 3}
    assert 2 not in {held.feature for held in floor.held}


def test_detectors_that_take_turns_carry_a_line_as_one_does() -> None:
    """Each follows points of its own, in every second frame."""
    floor = FloorFilter(MotionNoise(drag_per_s=0.0), SURE, gate_m=0.35, forget_ns=1_000_000_000)
    for step in range(200):
        x = 0.004 * max(step - 30, 0)
        if step:
            floor.predict(1 / 30, 0.0, 0.0, 0.0)
        own = 10 * (step % 2)
        seen = [feature(own + n, 0.2 * n - x, 0.1 * n) for n in range(4)]
        told = floor.update([sight(0.5 - x)] if step < 30 else [], STILL, step * FRAME_NS, seen)
        if step > 40:
            assert told == {0, 1}
    (line,) = [n for n, held in enumerate(floor.held) if held.feature is None]
    assert floor.offset(line)[0] == pytest.approx(0.5 - x, abs=0.03)


def test_points_that_leave_the_picture_make_room_for_those_that_come() -> None:
    """Six at a time, all others a third of a second later: no gap in what is told."""
    floor, untold = floor_filter(MotionNoise()), 0
    for step in range(120):
        if step:
            floor.predict(1 / 30, 0.0, 0.0, 0.0)
        seen = [feature(100 * (step // 10) + n, 0.2 * n - 0.5, 0.1 * n) for n in range(6)]
        untold = 0 if floor.update([], STILL, step * FRAME_NS, seen) == {0, 1} else untold + 1
        assert untold <= 2


def test_what_only_shows_now_and_then_is_no_line() -> None:
    floor = floor_filter(MotionNoise())
    for step in range(90):
        if step:
            floor.predict(1 / 30, 0.0, 0.0, 0.0)
        floor.update([sight(0.4)] if step % 12 == 0 else [], STILL, step * FRAME_NS)
        assert all(held.hits < 3 for held in floor.held)


def blind(floor: FloorFilter, frames: int, at: int) -> int:
    for _ in range(frames):
        at += 1
        floor.predict(FRAME_NS * 1e-9, 0.0, 0.0, 0.0)
        floor.update([], STILL, at * FRAME_NS)
    return at


def after_a_second_without(frames: int = 30) -> tuple[FloorFilter, int]:
    """A line held at 0.1 m by a drone at rest, not seen for so long since."""
    floor, at = floor_filter(MotionNoise()), 0
    for at in range(1, 40):
        floor.predict(FRAME_NS * 1e-9, 0.0, 0.0, 0.0)
        floor.update([sight(0.1)], STILL, at * FRAME_NS)
    return floor, blind(floor, frames, at)


def test_a_stain_that_shows_for_a_frame_where_a_lost_line_may_be_tells_no_motion() -> None:
    floor, at = after_a_second_without()
    assert floor.offset(0)[1] > 0.1, "the line may well be there"
    for stain_m in (0.4, 0.12 + 0.25, -0.15):
        floor.predict(FRAME_NS * 1e-9, 0.0, 0.0, 0.0)
        floor.update([sight(stain_m)], STILL, (at + 1) * FRAME_NS)
        at = blind(floor, 9, at + 1)
        assert abs(floor.mean(VX)) < 0.05
    assert floor.offset(0)[0] == pytest.approx(0.1, abs=0.03)


@pytest.mark.parametrize("found_m", [0.38, 0.11, -0.2])
def test_a_line_found_again_beside_where_it_was_reckoned_is_the_one_that_was_lost(found_m: float) -> None:
    floor, at = after_a_second_without()
    line = floor.held[0].id
    for _ in range(3):
        at += 1
        floor.predict(FRAME_NS * 1e-9, 0.0, 0.0, 0.0)
        floor.update([sight(found_m)], STILL, at * FRAME_NS)
    assert [held.id for held in floor.held] == [line]
    offset_m, sigma_m = floor.offset(0)
    assert offset_m == pytest.approx(found_m, abs=0.02)
    assert sigma_m < 0.02
    assert abs(floor.mean(VX)) < 0.35, "it has drifted there since, however fast"


def test_a_line_found_too_far_away_is_another_one() -> None:
    floor, at = after_a_second_without()
    for _ in range(4):
        at += 1
        floor.predict(FRAME_NS * 1e-9, 0.0, 0.0, 0.0)
        floor.update([sight(0.1 + 0.5)], STILL, at * FRAME_NS)
    assert sorted(round(floor.offset(n)[0], 1) for n in range(len(floor.held))) == [0.1, 0.6]


def test_a_feature_is_refused_through_the_frames_of_another_detector() -> None:
    floor = floor_filter(MotionNoise())
    for step in range(60):
        if step:
            floor.predict(1 / 30, 0.0, 0.0, 0.0)
        own = 10 * (step % 2)
        jump_m = 0.3 if step >= 20 else 0.0
        places = [(1, 0.2, 0.1), (2, 0.1 + jump_m * (own == 0), -0.2), (3, -0.2, 0.3)]
        floor.update([], STILL, step * FRAME_NS, [feature(own + n, x, y) for n, x, y in places])
        if step > 20:
            assert 2 not in {held.feature for held in floor.held}
