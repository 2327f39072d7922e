"""Features are believed once they move as lines say that the floor does."""

from __future__ import annotations

import itertools
import random
from collections.abc import Callable

import pytest

from flightd.tracking.feature_trust import FeatureTrust, SeenFrame
from flightd.tracking.held_lines import SeenLine

FRAME_NS, DT_S = 33_333_333, 1 / 30
HOVER_M = 1.5


def floor(x_m: float, height_m: float) -> float:
    """Where a point of the floor is that was right below."""
    return -x_m


def flies_along(angle: float) -> Callable[[float, float], float]:
    """Dust on the lens, the drone's own shadow or, straight below, its image: always at the same angle."""
    return lambda x_m, height_m: angle * height_m


def share_of(share: float) -> Callable[[float, float], float]:
    return lambda x_m, height_m: -share * x_m


def flown(
    placed: Callable[[float, float], float],
    frames: int = 60,
    *,
    speed_mps: float = 0.6,
    climb_mps: float = 0.0,
    shake_rad: float = 0.0,
    sure: bool = True,
    leap: float = 1.0,
    detectors: int = 1,
) -> FeatureTrust:
    """Along x beside a line, by features that are so placed by way and height; from half way on the height is
    told `leap` times too great; each of several detectors in turn follows features of its own."""
    trust, rng = FeatureTrust(), random.Random(2)
    first_m = HOVER_M if climb_mps == 0.0 else 0.4
    for n in range(frames):
        x_m, height_m = speed_mps * DT_S * n, first_m + climb_mps * DT_S * n
        told = leap if n >= frames // 2 else 1.0
        shaken_m = height_m * rng.gauss(0.0, shake_rad)
        at_m = placed(x_m, height_m) + shaken_m
        seen = {
            10 * (n % detectors) + id_: (
                told * (at_m + rng.gauss(0, 0.004)),
                told * rng.gauss(0, 0.004),
            )
            for id_ in range(5)
        }
        line = SeenLine(0, told * (0.3 - x_m + shaken_m), sure)
        trust.step(SeenFrame(n * FRAME_NS, told * height_m, seen, {3: line}, (speed_mps, None)))
    return trust


def test_what_moves_with_the_floor_is_believed() -> None:
    assert flown(floor).holds
    assert flown(floor, climb_mps=0.8).holds
    assert flown(floor, shake_rad=0.009).holds


def test_a_few_centimetres_beside_a_line_are_enough() -> None:
    assert flown(floor, 15, speed_mps=0.25, climb_mps=0.8).holds


def test_two_detectors_in_turn_tell_as_much() -> None:
    assert flown(floor, detectors=2).holds


@pytest.mark.parametrize("share", [0.0, 0.2, 2.0])
def test_dust_shadows_and_mirrored_lamps_are_not(share: float) -> None:
    assert not flown(share_of(share)).holds


@pytest.mark.parametrize("angle", [-0.4, -0.3, -0.2, 0.0, 0.2, 0.3, 0.4])
@pytest.mark.parametrize("climb_mps", [0.0, 0.6, 1.0])
def test_what_flies_along_is_not_however_the_drone_climbs(angle: float, climb_mps: float) -> None:
    """By the height alone it seems to move, and with the line where the camera shakes."""
    for speed_mps, shake_rad in itertools.product((0.2, 0.3, 0.5), (0.0, 0.009)):
        for frames in range(10, 60, 5):
            along = flies_along(angle)
            trust = flown(along, frames, speed_mps=speed_mps, climb_mps=climb_mps, shake_rad=shake_rad)
            assert not trust.holds


@pytest.mark.parametrize("speed_mps", [0.0, 0.1, 0.2])
def test_a_camera_that_shakes_moves_all_of_it_and_proves_nothing(speed_mps: float) -> None:
    for frames in range(10, 120, 10):
        assert not flown(flies_along(0.0), frames, speed_mps=speed_mps, shake_rad=0.009).holds


@pytest.mark.parametrize("angle", [0.0, 0.3])
def test_nor_does_a_height_that_leaps(angle: float) -> None:
    for frames in range(10, 60, 5):
        assert not flown(flies_along(angle), frames, speed_mps=0.05, leap=1.3).holds


def test_nothing_is_believed_before_lines_have_told_a_way() -> None:
    assert not flown(floor, speed_mps=0.01).holds
    assert not flown(floor, sure=False).holds
    assert not FeatureTrust().holds
