"""What the lines tell of the drone's own sensors while it swings about over a crossing."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass, replace

import pytest

from flightd.config.tracking import TrackingConfig
from flightd.core.geometry import GRAVITY_MPS2, Lens, Mount
from flightd.core.tracks import SensorEstimate
from flightd.core.types import Attitude
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.random_sites import random_site
from flightd.tracking.line_tracker import LineTracker
from tests.sim.ideal.ideal_sight import EyeErrors, IdealEye

DEFAULTS = TrackingConfig()
LENS = Lens(640, 360, 381.4, 381.4, 319.5, 179.5)
HEIGHT_M = 1.6
SITE = random_site(3)
XS_M = sorted({node.x_m for node in SITE.nodes.values()})
TICK_S, FRAME_S, ARRIVES_S = 0.02, 1 / 30, 0.1
DRAG_PER_S = 0.25
WAVES_X = ((0.15, 2.6, 0.0), (0.15, 1.1, 0.5), (0.05, 4.1, 2.0))
WAVES_Y = ((0.15, 2.1, 1.0), (0.15, 0.9, 2.5), (0.05, 3.7, 0.3))
"""Amplitude (m), rate (rad/s) and phase: of one rate alone a leaking attitude looks like a late one."""


@dataclass(frozen=True)
class Truth:
    """What is wrong with the drone: true less told."""

    delay_s: float = 0.0
    leap_s: float = 0.0
    leaps_at_s: float = 15.0
    """From when on it is later by `leap_s`."""
    mount_roll_deg: float = 0.0
    mount_pitch_deg: float = 0.0
    told_roll_deg: float = 0.0
    leak_per_s: float = 0.0
    focal_share: float = 1.0
    """The focal length as a share of the configured one."""
    height_share: float = 0.0
    """The told height is too small by this share of it."""
    shake_deg: float = 0.0
    """The camera shakes by so much on its mount, of each frame anew, rms."""
    swings: float = 1.0
    """The share of its usual way by which the drone swings."""


def swung(waves: tuple[tuple[float, float, float], ...], t: float) -> tuple[float, float, float]:
    """Place, speed, and the acceleration that the lean has to make of it against the drag."""
    x = sum(a * math.sin(w * t + p) for a, w, p in waves)
    v = sum(a * w * math.cos(w * t + p) for a, w, p in waves)
    accel = sum(-a * w * w * math.sin(w * t + p) for a, w, p in waves)
    return x, v, accel + DRAG_PER_S * v


def swinging(t: float, share: float = 1.0) -> Kinematics:
    """To and fro along both axes, leaned as that needs, with drag."""
    node = SITE.nodes["A2"]
    (x, vx, ax), (y, vy, ay) = ([share * value for value in swung(waves, t)] for waves in (WAVES_X, WAVES_Y))
    roll, pitch = math.atan(ay / GRAVITY_MPS2), -math.atan(ax / GRAVITY_MPS2)
    at = round(t * 1e9)
    return Kinematics(at, node.x_m + x, node.y_m + y, HEIGHT_M, vx, vy, 0.0, roll, pitch, 0.0, 0.0, 0.0, 0.0)


def told(
    truth: Truth,
    seed: int,
    seconds: float = 20.0,
    look: Callable[[LineTracker, float], None] | None = None,
    config: TrackingConfig = DEFAULTS,
) -> SensorEstimate:
    """What the tracker says after so long; `look` sees it, and the time, after each frame."""
    tracker = LineTracker(LENS, Mount(), SITE.line_width_m, 0.0, config=config)
    turned = map(math.radians, (truth.mount_roll_deg, truth.mount_pitch_deg))
    lens = LENS.longer_by(truth.focal_share)
    eye = IdealEye(SITE, lens, Mount(0.0, (0.0, 0.0, 0.0), *turned), EyeErrors(), seed)
    waiting = []
    frame_s = 0.0
    leaked_roll = leaked_pitch = 0.0
    shakes, shake_rad = random.Random(seed), math.radians(truth.shake_deg)
    for n in range(round(seconds / TICK_S)):
        t = n * TICK_S
        k = swinging(t, truth.swings)
        leaked_roll -= truth.leak_per_s * TICK_S * (k.roll_rad + leaked_roll)
        leaked_pitch -= truth.leak_per_s * TICK_S * (k.pitch_rad + leaked_pitch)
        roll_rad = k.roll_rad + leaked_roll - math.radians(truth.told_roll_deg)
        tracker.attitude(Attitude(k.stamp_ns, roll_rad, k.pitch_rad + leaked_pitch, k.yaw_rad))
        if t >= frame_s:
            frame_s += FRAME_S
            roll_rad, pitch_rad = (
                angle + shakes.gauss(0.0, shake_rad) for angle in (k.roll_rad, k.pitch_rad)
            )
            shaken = replace(k, roll_rad=roll_rad, pitch_rad=pitch_rad)
            delay_s = truth.delay_s + (truth.leap_s if t > truth.leaps_at_s else 0.0)
            waiting.append((t + ARRIVES_S, eye.see(shaken, n, round((t - delay_s) * 1e9))))
        while waiting and waiting[0][0] <= t:
            tracker.frame(waiting.pop(0)[1], HEIGHT_M / (1.0 + truth.height_share))
            if look is not None:
                look(tracker, t)
    tracks = tracker.at(round(seconds * 1e9))
    assert tracks is not None
    assert tracks.sensors.is_known
    return tracks.sensors


def test_who_stands_tells_the_error_of_the_told_attitude_as_far_as_legs_are_level() -> None:
    tracker = LineTracker(LENS, Mount(), SITE.line_width_m, 0.0)
    told_rad = math.radians(1.5), math.radians(-0.6)
    for _ in range(50):
        level_rad = tracker.stands(told_rad)  # however often it is told: it is one floor on which it stands
    priors = DEFAULTS.expert.priors
    spread = priors.attitude_rad**2 + priors.stand_rad**2
    share = priors.attitude_rad**2 / spread
    assert level_rad == pytest.approx((share * told_rad[0], share * told_rad[1]))
    leans_rad = list[float]()
    for sigmas in (2.5, 3.0, 3.9, 4.1, 9.0):
        level_rad = tracker.stands((math.sqrt(spread) * sigmas, 0.0))
        assert level_rad is not None
        leans_rad.append(level_rad[0])
    assert leans_rad == sorted(leans_rad, reverse=True), "the more a leg on something explains it"
    assert leans_rad[0] == pytest.approx(2.5 * math.sqrt(spread) * share)
    assert leans_rad[3:] == [0.0, 0.0]


def test_once_lines_have_told_of_the_attitude_standing_says_no_more() -> None:
    seen = list[tuple[float, float] | None]()
    told(Truth(), 1, 1.0, lambda tracker, _: seen.append(tracker.stands((0.02, 0.0))))
    assert seen[-1] is None
    assert LineTracker(LENS, Mount(), SITE.line_width_m, 0.0).stands((0.02, 0.0)) is not None


def never_leaps(tracker: LineTracker, t: float) -> None:
    assert not tracker.delay_leaps, t


@pytest.mark.parametrize(
    ("leap_s", "shake_deg", "leaps_at_s", "within_s"),
    [(0.04, 0.15, 15.0, 1.0), (-0.033, 0.15, 15.0, 4.0), (0.033, 0.3, 40.0, 3.0)],
)
@pytest.mark.parametrize("seed", range(4))
def test_a_delay_that_leaps_is_told_and_learnt_anew(
    leap_s: float, shake_deg: float, leaps_at_s: float, within_s: float, seed: int
) -> None:
    """Where the drone leans meanwhile; where it hardly does that is learnt as slowly as ever."""
    leaps: list[tuple[float, int]] = []
    truth = Truth(delay_s=0.02, leap_s=leap_s, shake_deg=shake_deg, leaps_at_s=leaps_at_s)
    sensors = told(truth, seed, leaps_at_s + 8.0, lambda tracker, t: leaps.append((t, tracker.delay_leaps)))
    assert abs(sensors.delay_s - truth.delay_s - leap_s) < 0.01
    assert leaps[-1][1] == 1
    assert leaps_at_s < next(t for t, count in leaps if count) < leaps_at_s + within_s


@pytest.mark.parametrize("shake_deg", [0.3, 0.5])
def test_a_delay_that_stays_never_leaps_however_the_camera_shakes(shake_deg: float) -> None:
    for seed in (0, 1):
        told(Truth(delay_s=0.02, shake_deg=shake_deg), seed, 60.0, never_leaps)


@pytest.mark.parametrize("delay_ms", [-40, 0, 50])
def test_the_delay_is_found_and_its_sigma_is_honest(delay_ms: int) -> None:
    errors_ms, sigmas_ms = [], []
    for seed in range(4):
        sensors = told(Truth(delay_s=delay_ms / 1e3), seed, look=never_leaps)
        errors_ms.append(sensors.delay_s * 1e3 - delay_ms)
        sigmas_ms.append(sensors.delay_sigma_s * 1e3)
    assert max(sigmas_ms) < 6.0
    assert abs(sum(errors_ms) / len(errors_ms)) < 5.0
    assert all(abs(error) < 3.0 * sigma for error, sigma in zip(errors_ms, sigmas_ms, strict=True))


@pytest.mark.parametrize("delay_ms", [0, 50])
@pytest.mark.parametrize("shake_deg", [0.15, 0.3])
def test_a_camera_that_shakes_is_known_to_and_makes_no_delay(shake_deg: float, delay_ms: int) -> None:
    """Taken for steady, it made 28 ms of 0.3 degrees, at a sigma of 4."""
    sensors = told(Truth(delay_s=delay_ms / 1e3, shake_deg=shake_deg), 0)
    assert abs(sensors.delay_s * 1e3 - delay_ms) < 3.0 * sensors.delay_sigma_s * 1e3
    assert abs(sensors.delay_s * 1e3 - delay_ms) < 12.0
    assert 0.6 * shake_deg < math.degrees(sensors.shake_rad) < 1.3 * shake_deg


@pytest.mark.parametrize(("roll_deg", "pitch_deg"), [(1.5, 0.0), (0.0, -1.5), (-1.0, 2.0)])
def test_a_tilted_mount_is_found(roll_deg: float, pitch_deg: float) -> None:
    sensors = told(Truth(mount_roll_deg=roll_deg, mount_pitch_deg=pitch_deg), 1)
    roll = math.degrees(sensors.mount_roll_rad + sensors.tilt_roll_rad)
    pitch = math.degrees(sensors.mount_pitch_rad + sensors.tilt_pitch_rad)
    assert roll == pytest.approx(roll_deg, abs=0.2)
    assert pitch == pytest.approx(pitch_deg, abs=0.2)


def test_a_wrong_attitude_is_found_with_the_mount() -> None:
    sensors = told(Truth(mount_roll_deg=1.0, told_roll_deg=0.5), 1)
    roll = math.degrees(sensors.mount_roll_rad + sensors.tilt_roll_rad)
    assert roll == pytest.approx(1.5, abs=0.2)


def told_with_speed(
    truth: Truth, map_sigma_m: float = math.inf, config: TrackingConfig = DEFAULTS
) -> tuple[SensorEstimate, float]:
    """What the tracker says after 20 s, and the error of its speed from half time on, m/s rms; where its
    sigma is finite, a map tells how far apart the lines are."""
    squares: list[float] = []

    def look(tracker: LineTracker, t: float) -> None:
        tracks = tracker.at(round(t * 1e9))
        if tracks is not None and map_sigma_m < math.inf:
            at_m = SITE.nodes["A2"].x_m + swung(WAVES_X, t)[0]
            places_m = {
                line.id: min(XS_M, key=lambda x_m: abs(x_m - at_m - line.offset_m))
                for line in tracks.across_x
            }
            tracker.survey(0, places_m, map_sigma_m)
        if tracks is not None and t > 10.0:
            off_x, off_y = tracks.vx_mps - swung(WAVES_X, t)[1], tracks.vy_mps - swung(WAVES_Y, t)[1]
            squares.append(off_x**2 + off_y**2)

    sensors = told(truth, 1, look=look, config=config)
    return sensors, math.sqrt(sum(squares) / len(squares))


@pytest.mark.parametrize("focal_share", [0.96, 1.04])
def test_a_wrong_focal_length_is_found_and_makes_no_speed_of_a_lean(focal_share: float) -> None:
    """It moves what is seen away from where the camera looks, which swings with the drone, not from where the
    drone is: what scales lengths alone would leave a share of each lean as a way that was not flown."""
    sensors, off_mps = told_with_speed(Truth(focal_share=focal_share))
    assert abs(1.0 + sensors.scale_share - 1.0 / focal_share) < 2.0 * sensors.scale_sigma < 0.032
    assert off_mps < 3.5 * told_with_speed(Truth())[1]


@pytest.mark.parametrize(("shake_deg", "swings"), [(0.15, 0.0), (0.15, 0.15), (0.3, 0.1)])
def test_a_minute_of_hovering_with_a_camera_that_shakes_makes_no_length_longer(
    shake_deg: float, swings: float
) -> None:
    """A filter follows its own noise: what it held and by what it errs go together, and tell of no scale."""
    sensors = told(Truth(shake_deg=shake_deg, swings=swings), 1, seconds=60.0)
    assert abs(sensors.height_share) < 0.005
    assert abs(sensors.scale_share) < 2.0 * sensors.scale_sigma < 0.061


@pytest.mark.parametrize("height_share", [-0.06, 0.1])
def test_a_height_told_wrong_for_good_is_found_and_makes_no_speed_of_a_lean(height_share: float) -> None:
    """A range finder that is bent, or mounted lower than thought: the way that a lean moves the picture by is
    taken as too long, and each lean as a way that was flown."""
    truth = Truth(height_share=height_share)
    sure = DEFAULTS.with_values(
        expert=DEFAULTS.expert.with_values(priors=DEFAULTS.expert.priors.with_values(height_share=1e-6))
    )
    sensors, off_mps = told_with_speed(truth, 0.01)
    assert 0.35 < sensors.height_share / height_share < 1.1
    lengths = (1.0 + sensors.height_share) * (1.0 + sensors.scale_share)
    assert lengths == pytest.approx(1.0 + height_share, abs=0.015)
    assert off_mps < 0.7 * told_with_speed(truth, 0.01, sure)[1]
