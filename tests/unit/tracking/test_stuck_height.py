from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flightd.tracking.stuck_height import StuckHeight

TICK_NS = 20_000_000


def found_after(heights_m: list[float], climbs_mps: list[float], wanted_mps: float = 0.6) -> float | None:
    """Seconds until the height was found to be stuck; None if it never was."""
    check = StuckHeight()
    for i, (height_m, climb_mps) in enumerate(zip(heights_m, climbs_mps, strict=True)):
        if check.step(i * TICK_NS, height_m, climb_mps, wanted_mps):
            return i * TICK_NS * 1e-9
    return None


@pytest.mark.parametrize("climb_mps", [0.5, 0.8, -0.6])
def test_a_height_that_stands_still_is_found_within_a_second_of_climb(climb_mps: float) -> None:
    after_s = found_after([0.1] * 200, [climb_mps] * 200)
    assert after_s is not None
    assert after_s <= 1.0


def test_an_autopilot_that_tells_no_climb_is_bounded_by_what_was_commanded() -> None:
    after_s = found_after([0.1] * 400, [math.nan] * 400)
    assert after_s == pytest.approx(5.0, abs=0.1)


def test_a_vehicle_that_raises_its_thrust_on_the_floor_is_not_taken_for_it() -> None:
    assert found_after([0.1] * 200, [0.0] * 200) is None  # 4 s


@given(
    climb_mps=st.floats(0.2, 0.8),
    noise=st.lists(st.floats(-0.03, 0.03), min_size=300, max_size=300),
    step_m=st.floats(-1.2, 1.2),
)
def test_a_height_that_follows_is_believed_over_goods_and_with_noise(
    climb_mps: float, noise: list[float], step_m: float
) -> None:
    heights = [0.1 + climb_mps * i * 0.02 + noise[i] + (step_m if i > 150 else 0.0) for i in range(300)]
    assert found_after(heights, [climb_mps] * 300, climb_mps) is None


def test_what_stuck_once_is_not_believed_again() -> None:
    check = StuckHeight()
    for i in range(100):
        check.step(i * TICK_NS, 0.1, 0.6, 0.6)
    assert check.step(101 * TICK_NS, 1.4, 0.6, 0.6)


@pytest.mark.parametrize("readings_m", [(0.1, 0.22), (0.1, 0.15, 0.3, 0.1), (0.4, 0.1)])
@pytest.mark.parametrize("ticks", [1, 3, 10])
def test_a_height_that_swings_in_place_is_found_soon_too(readings_m: tuple[float, ...], ticks: int) -> None:
    heights = [readings_m[i // ticks % len(readings_m)] for i in range(400)]
    after_s = found_after(heights, [0.6] * 400)
    assert after_s is not None
    assert 0.6 * after_s < 1.0, "metres climbed until then"


@pytest.mark.parametrize("share", [0.1, 0.35, 0.5, 0.6])
def test_a_height_that_follows_in_part_is_found_before_it_matters(share: float) -> None:
    climbed = [0.6 * 0.02 * i for i in range(400)]
    after_s = found_after([0.1 + share * metres for metres in climbed], [0.6] * 400)
    assert after_s is not None
    assert 0.6 * after_s * (1.0 - share) < 0.7, "metres that the drone was higher than it was told"
