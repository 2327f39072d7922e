"""RotorPy's quadcopter in the place of our airframe: the same signs, and nearly the same flight."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from flightd.sim.plant.airframe import Airframe, AirframeCommand, AirframeParams
from flightd.sim.plant.plant_kind import PlantKind, airframe_kind
from flightd.sim.plant.wind import Wind, WindParams

pytest.importorskip("rotorpy", reason="of the extra rotorpy")

DT_S = 0.0025
STILL_AIR = WindParams(gust_rms_mps=0.0, vertical_gust_rms_mps=0.0)
HOVER = AirframeParams().hover_collective


def made(kind: PlantKind, wind: WindParams = STILL_AIR, seed: int = 1, yaw_rad: float = 0.0) -> Airframe:
    """One that hovers at 1.5 m."""
    frame = airframe_kind(kind)(wind=wind, seed=seed, yaw_rad=yaw_rad)
    for _ in range(round(8.0 / DT_S)):
        frame.step(DT_S, held(frame, yaw_rad=yaw_rad))
    assert frame.height_m == pytest.approx(1.5, abs=0.1)
    return frame


def held(
    frame: Airframe, roll_rad: float = 0.0, pitch_rad: float = 0.0, yaw_rad: float = 0.0
) -> AirframeCommand:
    """That attitude at 1.5 m."""
    lift = 1.0 + (2.0 * (1.5 - frame.height_m) - 2.5 * frame.climb_mps) / 9.8
    collective = HOVER * max(lift, 0.2) / max(frame.tilt_cos, 0.5)
    return AirframeCommand(True, roll_rad, pitch_rad, yaw_rad, 0.0, collective)


def flown(frame: Airframe, seconds: float, law: Callable[[Airframe], AirframeCommand]) -> list[float]:
    """The x of each step."""
    places = []
    for _ in range(round(seconds / DT_S)):
        frame.step(DT_S, law(frame))
        places.append(frame.x_m)
    return places


@pytest.mark.parametrize("yaw_rad", [0.0, 1.0, -2.5])
def test_nose_down_is_forward_and_right_side_down_is_to_the_right(yaw_rad: float) -> None:
    for roll_rad, pitch_rad, way in ((0.0, -0.1, 0.0), (0.1, 0.0, math.pi / 2)):
        frame = made(PlantKind.ROTORPY, yaw_rad=yaw_rad)
        flown(frame, 1.5, lambda f, r=roll_rad, p=pitch_rad: held(f, r, p, yaw_rad))  # type: ignore[misc]
        assert frame.roll_rad == pytest.approx(roll_rad, abs=0.02)
        assert frame.pitch_rad == pytest.approx(pitch_rad, abs=0.02)
        speed = math.hypot(frame.vx_mps, frame.vy_mps)
        assert speed > 0.7
        heading = math.atan2(frame.vy_mps, frame.vx_mps)
        assert math.remainder(heading - yaw_rad - way, math.tau) == pytest.approx(0.0, abs=0.1)


def test_it_turns_to_the_heading_that_is_wanted() -> None:
    frame = made(PlantKind.ROTORPY)
    flown(frame, 4.0, lambda f: held(f, yaw_rad=1.5))
    assert frame.yaw_rad == pytest.approx(1.5, abs=0.02)
    assert frame.kinematics(0).yaw_rate_radps == pytest.approx(0.0, abs=0.05)


def test_it_stands_until_it_is_lifted_and_lands_again() -> None:
    frame = airframe_kind(PlantKind.ROTORPY)(wind=STILL_AIR)
    flown(frame, 1.0, lambda _: AirframeCommand(True, collective=0.5 * HOVER))
    assert (frame.on_floor, frame.height_m) == (True, frame.params.rest_height_m)
    flown(frame, 1.0, lambda _: AirframeCommand(True, collective=1.1 * HOVER))
    assert frame.height_m > 0.3
    flown(frame, 4.0, lambda _: AirframeCommand(True, collective=0.9 * HOVER))
    assert frame.on_floor
    assert frame.touchdown_mps > 0.1
    flown(frame, 1.0, lambda _: AirframeCommand())
    assert frame.collective == pytest.approx(0.0, abs=1e-6)


def test_it_stands_as_its_legs_do() -> None:
    frame = airframe_kind(PlantKind.ROTORPY)(AirframeParams(rest_tilt_rad=(0.02, -0.01)), wind=STILL_AIR)
    flown(frame, 0.5, lambda _: AirframeCommand())
    assert (frame.roll_rad, frame.pitch_rad) == (0.02, -0.01)


def test_the_same_seed_flies_the_same() -> None:
    places = [made(PlantKind.ROTORPY, WindParams(), seed=5).x_m for _ in range(2)]
    assert places[0] == places[1]
    assert places[0] != made(PlantKind.ROTORPY, WindParams(), seed=6).x_m


def stopping_m(kind: PlantKind) -> float:
    """From 1 m/s, leaning back by up to 8 degrees until it stands."""
    frame = made(kind)
    while frame.vx_mps < 1.0:
        frame.step(DT_S, held(frame, pitch_rad=-0.14))
    start_m = frame.x_m
    places = flown(frame, 3.0, lambda f: held(f, pitch_rad=min(max(0.3 * f.vx_mps, -0.14), 0.14)))
    return max(places) - start_m


def gust_offset_m(kind: PlantKind) -> float:
    """How far a wind of 1 m/s that begins suddenly pushes one that holds its place."""
    frame = made(kind)
    flown(frame, 0.1, held)
    frame.wind = Wind(WindParams(1.0, 0.0, 0.0, 0.0), seed=1)
    start_m = frame.x_m
    places = flown(frame, 4.0, lambda f: held(f, pitch_rad=0.15 * (f.x_m - start_m) + 0.2 * f.vx_mps))
    return max(places) - start_m


def test_a_drag_that_is_off_is_so_for_it_too() -> None:
    speeds = []
    for drag_per_s in (0.2, 0.335, 0.5):
        frame = airframe_kind(PlantKind.ROTORPY)(AirframeParams(drag_per_s=drag_per_s), wind=STILL_AIR)
        frame.height_m, frame.vx_mps, frame.on_floor = 1.5, 2.0, False
        flown(frame, 1.0, held)
        speeds.append(frame.vx_mps)
    assert speeds[0] - speeds[1] > 0.1
    assert speeds[1] - speeds[2] > 0.1


def test_it_stops_as_our_own_and_is_pushed_a_third_farther() -> None:
    """Its rotors' drag is 0.45 of its speed in a second, ours 0.335: that is what differs."""
    stop = stopping_m(PlantKind.ROTORPY) / stopping_m(PlantKind.OWN)
    push = gust_offset_m(PlantKind.ROTORPY) / gust_offset_m(PlantKind.OWN)
    assert stop == pytest.approx(1.0, abs=0.25)
    assert push == pytest.approx(0.446 / 0.335, abs=0.1)
