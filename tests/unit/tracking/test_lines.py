"""Line tracks: velocity from tilt and lines, late pictures, false lines, heading modulo 90 degrees."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from flightd.config.tracking import MotionNoise, TrackingConfig, TrackingExpert
from flightd.core.geometry import GRAVITY_MPS2, Lens, Mount, wrap_pi
from flightd.core.types import Attitude, Line, LineSet
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.random_sites import random_site
from flightd.tracking.line_tracker import LineTracker
from tests.sim.ideal.ideal_sight import EyeErrors, IdealEye

LENS = Lens(640, 360, 381.4, 381.4, 319.5, 179.5)
HEIGHT_M = 1.6
SITE = random_site(3)
FRAME_NS = 33_333_333
LATE_NS = 70_000_000


def flown(
    tilt_rad: float, seconds: float, yaw_offset_rad: float = 0.0
) -> tuple[LineTracker, Kinematics, int]:
    """A drone that accelerates along the first aisle by a constant pitch, without drag; its pictures
    come late, its own yaw is off by `yaw_offset_rad`."""
    no_drag = TrackingConfig(expert=TrackingExpert(noise=MotionNoise(drag_per_s=0.0)))
    tracker = LineTracker(LENS, Mount(), SITE.line_width_m, 0.0, config=no_drag)
    eye = IdealEye(SITE, LENS, Mount(), EyeErrors(0.1, 0.0002), 1)
    accel = GRAVITY_MPS2 * math.tan(tilt_rad)
    start = SITE.nodes["A1"]
    waiting: list[tuple[int, LineSet]] = []
    next_frame, now_ns = 0, 0
    k = Kinematics(0, start.x_m, start.y_m, HEIGHT_M, 0, 0, 0, 0, -tilt_rad, 0, 0, 0, 0)
    while now_ns < seconds * 1e9:
        now_ns += 10_000_000
        t = now_ns * 1e-9
        k = Kinematics(
            now_ns,
            start.x_m + accel * t * t / 2,
            start.y_m,
            HEIGHT_M,
            accel * t,
            0,
            0,
            0,
            -tilt_rad,
            0,
            0,
            0,
            0,
        )
        tracker.attitude(Attitude(now_ns, 0.0, -tilt_rad, yaw_offset_rad))
        if now_ns >= next_frame:
            next_frame += FRAME_NS
            waiting.append((now_ns + LATE_NS, eye.see(k, next_frame, now_ns)))
        while waiting and waiting[0][0] <= now_ns:
            tracker.frame(waiting.pop(0)[1], HEIGHT_M)
    return tracker, k, now_ns


@pytest.mark.parametrize("tilt_deg", [0.0, 2.0, -3.0])
def test_velocity_and_offsets_are_those_of_now_although_pictures_are_late(tilt_deg: float) -> None:
    tracker, k, now_ns = flown(math.radians(tilt_deg), 1.5)
    tracks = tracker.at(now_ns)
    assert tracks is not None
    assert tracks.vx_mps == pytest.approx(k.vx_mps, abs=0.06)
    assert tracks.vy_mps == pytest.approx(0.0, abs=0.04)
    truth = sorted(line.x0_m for line in SITE.lines if line.x0_m == line.x1_m)
    for track in tracks.across_x:
        assert min(abs(k.x_m + track.offset_m - at) for at in truth) < 0.02
    assert any(abs(track.offset_m) < 0.01 for track in tracks.across_y), "the aisle line below"


def test_while_no_picture_comes_the_doubt_of_motion_and_lines_grows() -> None:
    tracker, _, now_ns = flown(0.0, 2.0)
    seen, later = tracker.at(now_ns), tracker.at(now_ns + 2 * 10**9)
    assert seen is not None
    assert later is not None
    assert min(later.velocity_sigma_mps) > 3.0 * max(seen.velocity_sigma_mps)
    assert min(line.sigma_m for line in later.across_x + later.across_y) > 0.1


def test_the_vehicles_own_heading_may_start_anywhere() -> None:
    tracker, _, now_ns = flown(0.0, 1.0, yaw_offset_rad=2.3)
    tracks = tracker.at(now_ns)
    assert tracks is not None
    assert tracks.yaw_rad == pytest.approx(0.0, abs=math.radians(0.3))


def test_a_frame_older_than_the_last_or_without_attitude_is_refused() -> None:
    tracker, _, now_ns = flown(0.0, 0.5)
    old = LineSet(0, now_ns - 300_000_000, 640, 360, (), (), "ideal")
    future = LineSet(0, now_ns + 10**9, 640, 360, (), (), "ideal")
    assert not tracker.frame(old, HEIGHT_M)
    assert not tracker.frame(future, HEIGHT_M)
    assert not tracker.frame(LineSet(0, now_ns, 640, 360, (), (), "ideal"), math.nan)


def test_a_line_of_another_width_is_not_paint() -> None:
    tracker = LineTracker(LENS, Mount(), 0.075, 0.0)
    for i in range(1, 10):
        tracker.attitude(Attitude(i * FRAME_NS, 0.0, 0.0, 0.0))
        wide = Line(0.0, 0.0, 60.0, -180.0, 180.0, 1.0, 0.1, 0.001)
        tracker.frame(LineSet(i, i * FRAME_NS, 640, 360, (wide,), (), "test"), HEIGHT_M)
    tracks = tracker.at(9 * FRAME_NS)
    assert tracks is not None
    assert not tracks.across_y
    assert tracks.lines_ns == 0


def test_before_a_line_is_seen_a_lean_that_is_told_moves_nothing() -> None:
    """A drone on its pad whose told attitude is off was believed to slide away, and leant against it."""
    tracker = LineTracker(LENS, Mount(), SITE.line_width_m, 0.0)
    for i in range(1, 90):
        tracker.attitude(Attitude(i * FRAME_NS, math.radians(2.0), 0.0, 0.0))
        tracker.frame(LineSet(i, i * FRAME_NS, 640, 360, (), (), "ideal"), 0.2)
    now_ns = 89 * FRAME_NS
    tracks = tracker.at(now_ns + LATE_NS)
    assert tracks is not None
    assert (tracks.vx_mps, tracks.vy_mps) == (0.0, 0.0)
    assert tracker.lead(now_ns, now_ns + 150_000_000)[:4] == (0.0, 0.0, 0.0, 0.0)
    assert tracker.unleant(now_ns) == (0.0, 0.0)


def test_what_rises_without_a_line_is_dead_reckoned_again() -> None:
    tracker = LineTracker(LENS, Mount(), SITE.line_width_m, 0.0)
    for i in range(1, 90):
        tracker.attitude(Attitude(i * FRAME_NS, math.radians(2.0), 0.0, 0.0))
        tracker.frame(LineSet(i, i * FRAME_NS, 640, 360, (), (), "ideal"), 0.2 if i < 60 else 1.0)
    tracks = tracker.at(89 * FRAME_NS)
    assert tracks is not None
    assert tracks.vy_mps == pytest.approx(GRAVITY_MPS2 * math.tan(math.radians(2.0)), abs=0.1)


@pytest.mark.parametrize("rates", [True, False])
def test_a_compass_that_steel_bends_turns_the_heading_only_where_no_gyro_tells(rates: bool) -> None:
    """No line in sight, so nothing else says how the drone heads."""
    tracker, _, now_ns = flown(0.0, 1.0)
    for i in range(1, 60):
        at_ns = now_ns + i * FRAME_NS
        felt_radps = 1e-4 * math.sin(i) if rates else math.nan
        tracker.attitude(Attitude(at_ns, 0.0, 0.0, math.radians(0.3 * i), felt_radps))
        tracker.frame(LineSet(99 + i, at_ns, 640, 360, (), (), "ideal"), HEIGHT_M)
    tracks = tracker.at(now_ns + 59 * FRAME_NS)
    assert tracks is not None
    assert math.degrees(tracks.yaw_rad) == pytest.approx(0.0 if rates else 17.7, abs=2.0)
    motion = tracker.exposure_motion(now_ns + 59 * FRAME_NS)
    assert motion is not None
    assert math.degrees(motion.attitude.yaw_rad) == pytest.approx(17.7, abs=0.3), "the vehicle's own, as told"


@pytest.mark.parametrize(
    ("felt", "turns", "most_deg"),
    [
        pytest.param(lambda r: r, True, 1.0, id="right"),
        pytest.param(lambda r: -r, True, 35.0, id="wrong sign"),
        pytest.param(lambda _: 0.0, True, 20.0, id="feels nothing"),
        pytest.param(lambda r: r + math.radians(20.0), False, 20.0, id="biased"),
        pytest.param(lambda r: r + math.radians(40.0), False, 30.0, id="biased worse"),
    ],
)
def test_lines_find_out_gyros_that_are_wrong_and_the_told_heading_counts(
    felt: Callable[[float], float], turns: bool, most_deg: float
) -> None:
    """Lines alone would leave such a heading wrong by a right angle."""
    tracker = LineTracker(LENS, Mount(), SITE.line_width_m, 0.0)
    eye, start = IdealEye(SITE, LENS, Mount(), EyeErrors(0.1, 0.0002), 1), SITE.nodes["A1"]
    waiting: list[tuple[int, LineSet]] = []
    next_frame, yaw_rad, errors = 0, 0.0, []
    for now_ns in range(20_000_000, 8_000_000_000, 20_000_000):
        from_s = now_ns * 1e-9 - 2.0
        rate_radps = 0.5 if turns and 0.0 < from_s < math.pi else 0.0
        yaw_rad += rate_radps * 0.02
        noise = 1e-3 * math.sin(now_ns)
        told_radps = noise + (felt(rate_radps) if from_s > 0.0 else rate_radps)
        tracker.attitude(Attitude(now_ns, 0.0, 0.0, yaw_rad, told_radps))
        if now_ns >= next_frame:
            next_frame += FRAME_NS
            k = Kinematics(now_ns, start.x_m, start.y_m, HEIGHT_M, 0, 0, 0, 0, 0, yaw_rad, 0, 0, 0)
            waiting.append((now_ns + LATE_NS, eye.see(k, next_frame, now_ns)))
        while waiting and waiting[0][0] <= now_ns:
            tracker.frame(waiting.pop(0)[1], HEIGHT_M)
        tracks = tracker.at(now_ns)
        if tracks is not None:
            errors.append(abs(math.degrees(wrap_pi(tracks.yaw_rad - yaw_rad))))
    assert max(errors) < most_deg
    assert errors[-1] < 6.0
    assert (tracker.heading_error_rad != 0.0) is (most_deg > 1.0), "it is told, too"
