"""The simulated airframe responds as measured on a real autopilot, and repeats itself."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import pytest

from flightd.sim.autopilot.climb_loop import ClimbLoop
from flightd.sim.plant.airframe import Airframe, AirframeCommand, AirframeParams
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.plant.truth_history import TruthHistory
from flightd.sim.plant.wind import Wind, WindParams
from flightd.sim.sensors.instruments import SensorParams, Sensors
from tests.rigs.vehicles import CALM

DT_S = 0.0025
EXACT = SensorParams(
    heading_offset_rad=0.0, tilt_bias_rad=0.0, tilt_wander_rad=0.0, baro_wander_m=0.0, climb_noise_mps=0.0
)


def fly(
    airframe: Airframe,
    duration_s: float,
    wish: Callable[[float], tuple[float, float, float]],
    sensors: SensorParams = EXACT,
) -> list[Kinematics]:
    """Fly `wish(t) -> roll, pitch, climb` for a while; the truth after each step."""
    eyes, climb = Sensors(sensors, 1), ClimbLoop()
    eyes.update(DT_S, airframe)
    path = []
    for i in range(round(duration_s / DT_S)):
        roll, pitch, climb_mps = wish(i * DT_S)
        collective = climb.step(
            DT_S,
            climb_mps,
            height_m=eyes.height_m,
            speed_mps=eyes.climb_mps,
            accel_mps2=eyes.accel_mps2,
            tilt_cos=airframe.tilt_cos,
        )
        airframe.step(
            DT_S, AirframeCommand(motors=True, roll_rad=roll, pitch_rad=pitch, collective=collective)
        )
        eyes.update(DT_S, airframe)
        path.append(airframe.kinematics(round((i + 1) * DT_S * 1e9)))
    return path


def at(path: list[Kinematics], t_s: float) -> Kinematics:
    return path[round(t_s / DT_S) - 1]


def test_a_roll_step_follows_the_measured_response() -> None:
    airframe = Airframe(wind=CALM)
    start_s = 5.0
    path = fly(
        airframe,
        9.0,
        lambda t: (math.radians(8.0) if t >= start_s else 0.0, 0.0, 0.5 if t < 3.0 else 0.0),
    )
    assert math.degrees(at(path, start_s + 0.25).roll_rad) == pytest.approx(5.9, abs=0.1)
    assert math.degrees(at(path, start_s + 0.5).roll_rad) == pytest.approx(7.8, abs=0.1)
    assert math.degrees(at(path, start_s + 2.0).roll_rad) == pytest.approx(8.0, abs=0.05)
    assert at(path, start_s + 3.0).vy_mps == pytest.approx(2.5, abs=0.1)
    heights = [k.height_m for k in path if k.stamp_ns > start_s * 1e9]
    assert max(heights) - min(heights) < 0.04


@pytest.mark.parametrize("hover", [0.25, 0.34, 0.45])
def test_the_climb_rate_settles_within_half_a_second_and_zero_holds_the_height(hover: float) -> None:
    """What hovers the loop finds by itself, while it stands."""
    airframe = Airframe(AirframeParams(hover_collective=hover), CALM)
    path = fly(airframe, 14.0, lambda t: (0.0, 0.0, 0.5 if t < 4.0 or 6.0 < t < 8.0 else 0.0))
    lifted_s = next(k.stamp_ns for k in path if k.height_m > 0.101) * 1e-9
    assert 0.2 < lifted_s < 1.0
    assert max(k.climb_mps for k in path) < 0.9
    assert abs(at(path, 4.5).climb_mps) < 0.12
    assert at(path, 6.5).climb_mps == pytest.approx(0.5, abs=0.07)
    assert at(path, 8.0).climb_mps == pytest.approx(0.5, abs=0.03)
    held = [k.height_m for k in path if k.stamp_ns > 10e9]
    assert max(held) - min(held) < 0.02


@pytest.mark.parametrize(
    ("roll", "pitch", "yaw", "x", "y"),
    [
        (5, 0, 0, 0, 1),
        (-5, 0, 0, 0, -1),
        (0, -5, 0, 1, 0),
        (0, 5, 0, -1, 0),
        (0, -5, 90, 0, 1),
        (5, 0, 90, -1, 0),
    ],
)
def test_tilt_accelerates_in_its_direction(roll: float, pitch: float, yaw: float, x: float, y: float) -> None:
    airframe = Airframe(AirframeParams(yaw_gain_per_s=0.0), CALM, yaw_rad=math.radians(yaw))

    def wish(t: float) -> tuple[float, float, float]:
        tilted = t > 2.0
        return math.radians(roll) * tilted, math.radians(pitch) * tilted, 0.5

    path = fly(airframe, 3.5, wish)
    reached = 9.80665 * math.tan(math.radians(5.0))  # m/s after one second without drag
    for speed, sign in ((path[-1].vx_mps, x), (path[-1].vy_mps, y)):
        assert speed == pytest.approx(sign * reached, abs=0.3 * reached if sign else 0.02)


def test_yaw_turns_to_the_target_and_a_rate_alone_only_shifts_it() -> None:
    airframe = Airframe(wind=CALM)
    airframe.height_m, airframe.on_floor = 2.0, False
    hover = airframe.params.hover_collective
    for _ in range(800):
        airframe.step(DT_S, AirframeCommand(motors=True, collective=hover, yaw_rad=math.radians(40.0)))
    assert math.degrees(airframe.yaw_rad) == pytest.approx(40.0, abs=0.5)
    fixed = AirframeCommand(
        motors=True, collective=hover, yaw_rad=math.radians(40.0), yaw_rate_radps=math.radians(30.0)
    )
    for _ in range(800):
        airframe.step(DT_S, fixed)
    assert math.degrees(airframe.yaw_rad) == pytest.approx(46.0, abs=1.0)  # measured: about 6 degrees


def test_the_floor_stops_the_fall_and_rubs_off_the_speed() -> None:
    airframe = Airframe(wind=CALM)
    airframe.height_m, airframe.on_floor = 0.5, False
    airframe.vx_mps = 1.0
    for _ in range(800):
        airframe.step(DT_S, AirframeCommand())
        assert airframe.height_m >= airframe.params.rest_height_m
    assert airframe.on_floor
    assert airframe.touchdown_mps == pytest.approx(math.sqrt(2 * 9.8 * 0.4), rel=0.05)
    assert airframe.vx_mps == 0.0
    assert airframe.climb_mps == 0.0


def test_it_stands_as_its_legs_do_and_flies_level() -> None:
    legs = math.radians(1.0), math.radians(-0.7)
    airframe = Airframe(AirframeParams(rest_tilt_rad=legs), wind=CALM)
    for _ in range(100):
        airframe.step(DT_S, AirframeCommand())
    assert (airframe.roll_rad, airframe.pitch_rad) == pytest.approx(legs)
    risen = fly(airframe, 2.0, lambda _: (0.0, 0.0, 0.5))[-1]
    assert (risen.roll_rad, risen.pitch_rad) == pytest.approx((0.0, 0.0), abs=1e-4)
    for _ in range(1500):
        airframe.step(DT_S, AirframeCommand())
    assert airframe.on_floor
    assert (airframe.roll_rad, airframe.pitch_rad) == pytest.approx(legs, abs=1e-3)


def test_the_battery_drains_with_thrust_and_its_end_stops_the_motors() -> None:
    airframe = Airframe(AirframeParams(battery_capacity_ah=0.02), CALM)
    full_v = airframe.battery_v
    fly(airframe, 3.0, lambda t: (0.0, 0.0, 0.3))
    assert airframe.battery_frac < 0.6
    assert airframe.battery_v < full_v
    fly(airframe, 10.0, lambda t: (0.0, 0.0, 0.3))
    assert airframe.battery_frac == 0.0
    assert airframe.on_floor


def test_the_same_seed_flies_the_same_flight_and_another_seed_does_not() -> None:
    def end(seed: int) -> Kinematics:
        return fly(Airframe(seed=seed), 5.0, lambda t: (0.0, 0.0, 0.3), SensorParams())[-1]

    assert end(3) == end(3)
    assert end(3) != end(4)


def test_gusts_have_the_asked_strength_whatever_the_step() -> None:
    for dt_s in (0.0025, 0.1):
        wind = Wind(WindParams(mean_x_mps=1.0, gust_rms_mps=0.3), seed=5)
        samples = []
        for _ in range(20_000):
            wind.step(dt_s)
            samples.append(wind.x_mps - 1.0)
        if dt_s == 0.1:  # 2000 s: a thousand correlation times
            assert math.sqrt(sum(s * s for s in samples) / len(samples)) == pytest.approx(0.3, rel=0.15)
        steps = [b - a for a, b in itertools.pairwise(samples)]
        rms = math.sqrt(sum(s * s for s in steps) / len(steps))
        assert rms == pytest.approx(0.3 * math.sqrt(2 * (1 - math.exp(-dt_s / 2.0))), rel=0.05)


def test_the_range_finder_counts_centimetres_along_the_body_and_drops_out() -> None:
    airframe = Airframe(wind=CALM)
    airframe.height_m, airframe.roll_rad = 2.0, math.radians(20.0)
    sensors = Sensors(SensorParams(range_dropout=0.1), seed=2)
    samples = [sensors.range_m(airframe) for _ in range(1000)]
    heard = [s for s in samples if s > 0]
    assert 0.05 < 1 - len(heard) / len(samples) < 0.15
    assert sum(heard) / len(heard) == pytest.approx(2.0 / math.cos(math.radians(20.0)), abs=0.002)
    assert all(abs(s * 100 - round(s * 100)) < 1e-6 for s in heard)
    airframe.height_m = 30.0
    assert sensors.range_m(airframe) == 0.0


def test_truth_is_read_between_its_samples_across_the_turn_of_yaw() -> None:
    history = TruthHistory(3)
    with pytest.raises(LookupError):
        history.latest()
    for i in range(5):
        yaw = math.radians(178.0 + 2.0 * i)
        yaw = yaw - math.tau if yaw >= math.pi else yaw
        history.add(Kinematics(i * 10, float(i), 0, 0, 0, 0, 0, 0, 0, yaw, 0, 0, 0))
    middle = history.at(35)
    assert middle.stamp_ns == 35
    assert middle.x_m == 3.5
    assert middle.yaw_rad == pytest.approx(math.radians(185.0 - 360.0))
    assert history.at(0).x_m == 2.0  # older than the record
    assert history.at(99).x_m == 4.0
    with pytest.raises(ValueError, match="not after"):
        history.add(history.latest())


def test_the_truth_goes_on_beyond_its_newest_sample_by_one_step_and_no_more() -> None:
    history = TruthHistory(3)
    frame = Airframe()
    for n in range(2):
        frame.x_m, frame.roll_rad = 0.1 * n, 0.02 * n
        history.add(frame.kinematics(n * 5_000_000))
    ahead, far = history.at(7_500_000), history.at(20_000_000)
    assert (ahead.x_m, ahead.roll_rad) == pytest.approx((0.15, 0.03))
    assert (far.x_m, far.stamp_ns) == (0.1, 20_000_000)
