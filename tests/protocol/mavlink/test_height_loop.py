"""Our own height loop: lift-off, flight, touch-down, and what it does not believe."""

from __future__ import annotations

import math

import pytest

from flightd.adapters.vehicle.mavlink.height_loop import HeightLoop
from flightd.sim.plant.airframe import Airframe, AirframeCommand
from tests.rigs.vehicles import CALM


def fly_loop(
    loop: HeightLoop,
    airframe: Airframe,
    wishes: list[tuple[float, float]],
    *,
    blind: bool = False,
    liar: bool = False,
) -> list[tuple[float, float]]:
    """Fly (climb, duration) pairs; (thrust, height) at each 20 ms.  The autopilot says that it
    stands until it lifts off, a `liar` always."""
    path, now_ns, told = [], 0, True
    for climb, duration_s in wishes:
        for _ in range(round(duration_s / 0.02)):
            now_ns += 20_000_000
            thrust = loop.step(
                now_ns,
                climb,
                climb_mps=airframe.climb_mps,
                height_m=math.nan if blind else airframe.height_m,
                tilt_cos=1.0,
                armed=True,
                on_floor=told,
            )
            for _ in range(5):
                airframe.step(0.004, AirframeCommand(motors=True, collective=thrust))
            told = liar or (told and airframe.climb_mps < 0.15)
            path.append((thrust, airframe.height_m))
    return path


@pytest.mark.parametrize("blind", [False, True])
def test_touch_down_is_felt_with_and_without_a_range_finder(blind: bool) -> None:
    airframe = Airframe(wind=CALM)
    path = fly_loop(HeightLoop(), airframe, [(0.5, 4.0), (0.0, 2.0), (-0.4, 9.0)], blind=blind)
    assert max(height for _, height in path) > 1.0
    last_thrust = max(i for i, (thrust, _) in enumerate(path) if thrust > 0.0)
    assert last_thrust < len(path) - 50
    assert path[last_thrust][1] == pytest.approx(0.1)  # it was not cut in the air


def test_slow_sinking_and_hovering_near_the_floor_are_no_touch_down() -> None:
    airframe = Airframe(wind=CALM)
    path = fly_loop(HeightLoop(), airframe, [(0.3, 3.0), (-0.06, 4.0), (0.0, 5.0)])
    assert min(thrust for thrust, _ in path[-300:]) > 0.2
    assert path[-1][1] > 0.3


def test_without_a_climb_rate_the_hover_thrust_is_kept() -> None:
    loop, airframe = HeightLoop(), Airframe(wind=CALM)
    fly_loop(loop, airframe, [(0.4, 3.0), (0.0, 2.0)])
    thrust = loop.step(
        6_000_000_000, 0.5, climb_mps=math.nan, height_m=math.nan, tilt_cos=1.0, armed=True, on_floor=False
    )
    assert thrust == pytest.approx(loop.hover, rel=0.05)
    assert thrust == pytest.approx(airframe.params.hover_collective, rel=0.1)


@pytest.mark.parametrize("climb_mps", [0.6, -0.6, -0.9, 0.0])
def test_a_climb_that_is_told_no_longer_ends_and_is_not_answered_for_ever(climb_mps: float) -> None:
    """Thrust went on against a rate of a second ago: a sinking vehicle rose by metres."""
    loop, airframe = HeightLoop(), Airframe(wind=CALM)
    fly_loop(loop, airframe, [(0.8, 5.0), (0.0, 3.0), (climb_mps, 1.0)])
    begun_m, now_ns = airframe.height_m, 9_000_000_000
    for tick in range(150):
        now_ns += 20_000_000
        told_mps = airframe.climb_mps if tick == 0 else math.nan
        thrust = loop.step(
            now_ns,
            0.0,
            climb_mps=told_mps,
            height_m=airframe.height_m,
            tilt_cos=1.0,
            armed=True,
            on_floor=False,
        )
        for _ in range(5):
            airframe.step(0.004, AirframeCommand(motors=True, collective=thrust))
    assert abs(airframe.climb_mps) < 0.5
    assert abs(airframe.height_m - begun_m) < (0.1 if climb_mps == 0.0 else 1.0)


def test_a_flight_taken_over_in_the_air_starts_at_the_guessed_hover_thrust() -> None:
    loop = HeightLoop()
    loop.hover = 0.4
    first = loop.step(
        1_000_000_000, 0.0, climb_mps=0.0, height_m=1.5, tilt_cos=1.0, armed=True, on_floor=False
    )
    assert first == pytest.approx(0.4)


def test_a_waiting_vehicle_gets_no_thrust() -> None:
    loop = HeightLoop()
    for i in range(50):
        for armed in (False, True):
            thrust = loop.step(
                i * 20_000_000,
                0.0,
                climb_mps=0.0,
                height_m=0.1,
                tilt_cos=1.0,
                armed=armed,
                on_floor=True,
            )
            assert thrust == 0.0


@pytest.mark.parametrize("blind", [False, True])
def test_an_autopilot_that_says_it_stands_cannot_have_the_thrust_cut_in_the_air(blind: bool) -> None:
    airframe = Airframe(wind=CALM)
    wishes = [(0.5, 4.0), (0.0, 3.0), (-0.3, 2.0), (0.0, 2.0)]
    path = fly_loop(HeightLoop(), airframe, wishes, blind=blind, liar=True)
    assert min(thrust for thrust, height in path if height > 0.5) > 0.1
    assert path[-1][1] > 0.5


def test_told_that_it_stands_on_something_higher_it_cuts_the_thrust() -> None:
    loop, airframe = HeightLoop(), Airframe(wind=CALM)
    fly_loop(loop, airframe, [(0.4, 2.0)])
    ways = {}
    for told in (False, True):
        for i in range(50):  # on a pad 0.15 m high
            thrust = loop.step(
                (200 + 50 * told + i) * 20_000_000,
                -0.15,
                climb_mps=0.0,
                height_m=0.25,
                tilt_cos=1.0,
                armed=True,
                on_floor=told,
            )
        ways[told] = thrust
    assert ways[False] > 0.0
    assert ways[True] == 0.0


@pytest.mark.parametrize(("climb_mps", "height_m"), [(0.0, 1.5), (-0.5, 0.2), (0.4, math.nan)])
def test_taken_over_in_the_air_it_does_not_begin_on_the_floor_whatever_is_said(
    climb_mps: float, height_m: float
) -> None:
    loop = HeightLoop()
    thrust = loop.step(
        1, 0.0, climb_mps=climb_mps, height_m=height_m, tilt_cos=1.0, armed=True, on_floor=True
    )
    assert loop.in_air
    assert thrust > 0.1


def test_a_disarmed_vehicle_gets_no_thrust_however_it_was_left() -> None:
    loop, airframe = HeightLoop(), Airframe(wind=CALM)
    fly_loop(loop, airframe, [(0.4, 2.0)])
    for wanted_mps in (0.0, 0.5):
        thrust = loop.step(
            4_000_000_000,
            wanted_mps,
            climb_mps=0.0,
            height_m=math.nan,
            tilt_cos=1.0,
            armed=False,
            on_floor=True,
        )
        assert thrust == 0.0


def step_for(loop: HeightLoop, start_s: float, duration_s: float, **known: float | bool) -> list[float]:
    """Thrusts of a climb that is wanted while the vehicle stands on the floor."""
    stands: dict[str, float | bool] = {"climb_mps": 0.0, "height_m": 0.1, "on_floor": True, **known}
    return [
        loop.step(round((start_s + i * 0.02) * 1e9), 0.5, tilt_cos=1.0, armed=True, **stands)  # type: ignore[arg-type]
        for i in range(round(duration_s / 0.02))
    ]


def test_a_single_sample_of_climb_is_no_lift_off() -> None:
    loop = HeightLoop()
    step_for(loop, 0.0, 0.1)
    step_for(loop, 0.1, 0.06, climb_mps=4.8)
    step_for(loop, 0.16, 0.04)
    step_for(loop, 0.2, 0.06, height_m=1.5)
    assert not loop.in_air
    assert loop.hover == 0.5


def test_a_lift_off_that_never_was_costs_no_time_and_teaches_little() -> None:
    """Climb is told for a quarter of a second while the vehicle stands at a sixth of its weight's thrust."""
    loop = HeightLoop()
    step_for(loop, 0.0, 0.2)
    step_for(loop, 0.2, 0.3, climb_mps=4.8)
    assert loop.hover >= 0.2
    thrusts = step_for(loop, 0.5, 2.0)
    assert not loop.in_air
    assert thrusts[-1] > 0.45


def test_a_false_climb_at_lift_off_is_not_flown_on_with() -> None:
    loop, airframe = HeightLoop(), Airframe(wind=CALM)
    now_ns, highest_mps, in_air_ns = 0, 0.0, 0
    for _ in range(400):
        now_ns += 20_000_000
        false_mps = 2.3 if in_air_ns == 0 or now_ns - in_air_ns < 200_000_000 else 0.0
        thrust = loop.step(
            now_ns,
            0.4,
            climb_mps=airframe.climb_mps + (false_mps if airframe.climb_mps > 0.05 else 0.0),
            height_m=math.nan,
            tilt_cos=1.0,
            armed=True,
            on_floor=not loop.in_air,
        )
        in_air_ns = in_air_ns or (now_ns if loop.in_air else 0)
        for _ in range(5):
            airframe.step(0.004, AirframeCommand(motors=True, collective=thrust))
        highest_mps = max(highest_mps, airframe.climb_mps)
    assert loop.in_air
    assert highest_mps < 0.9
