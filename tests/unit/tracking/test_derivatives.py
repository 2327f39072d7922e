"""The filter's derivatives are those of what it computes: found again by small differences."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.config.control import TiltCompensation
from flightd.core.geometry import Lens, Mount
from flightd.core.types import Attitude, Line
from flightd.tracking.line_sight import LineSight, feature_sight, line_sight
from flightd.tracking.motion_model import FIRST_LINE, LEAK, Told, moved
from flightd.tracking.tilt_compensation import FloorView, floor_points, ground_lines

LENS = Lens(640, 360, 381.4, 381.4, 319.5, 179.5)
HEIGHT_M = 1.6
small = st.floats(-0.15, 0.15)


def number(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high)


@settings(max_examples=60)
@given(
    st.lists(number(-0.3, 0.3), min_size=FIRST_LINE, max_size=FIRST_LINE),
    number(0.0, 0.6),
    st.tuples(small, small, number(-3.0, 3.0)),
    number(0.005, 0.05),
)
def test_the_transition_is_derived_rightly(
    states: list[float], leak: float, told: tuple[float, float, float], dt_s: float
) -> None:
    x = np.array([*states, 0.4, -0.7])
    x[LEAK] = leak

    def end(at: np.ndarray) -> np.ndarray:
        return moved(at, (0, 1), Told(*told), dt_s, 0.25, 8.0).state

    jacobian, step = moved(x, (0, 1), Told(*told), dt_s, 0.25, 8.0).jacobian, 1e-6
    for column in range(len(x)):
        aside = np.eye(len(x))[column] * step
        difference = (end(x + aside) - end(x - aside)) / (2 * step)
        assert jacobian[:, column] == pytest.approx(difference, abs=2e-5)


def view(
    roll_rad: float,
    pitch_rad: float,
    mount_roll_rad: float = 0.0,
    mount_pitch_rad: float = 0.0,
    mount_yaw_rad: float = 0.0,
) -> FloorView:
    mount = Mount(mount_yaw_rad, (0.0, 0.0, 0.0), mount_roll_rad, mount_pitch_rad)
    attitude = Attitude(0, roll_rad, pitch_rad, 0.0)
    return FloorView(LENS, mount, attitude, HEIGHT_M, TiltCompensation.EXACT, 0.0)


def line_seen(theta_rad: float, rho_px: float, yaw_rad: float, seen: FloorView) -> LineSight | None:
    line = Line(rho_px, theta_rad, 18.0, -90.0, 90.0, 1.0, 0.2, 0.003)
    tilt = seen.attitude.roll_rad, seen.attitude.pitch_rad
    (placed,) = ground_lines([line], seen)
    return line_sight(placed, yaw_rad, 0.1, tilt, HEIGHT_M, 0.004)


def point_seen(x_px: float, y_px: float, yaw_rad: float, seen: FloorView) -> tuple[LineSight, LineSight]:
    tilt = seen.attitude.roll_rad, seen.attitude.pitch_rad
    (point,) = floor_points([(x_px, y_px)], seen)
    return feature_sight(1, point, yaw_rad, tilt, HEIGHT_M, 0.004).across


STEP = 1e-4
TURN, TILT, MOUNT, MOUNT_TURN = 0, (1, 2), (3, 4), 5
"""Places of yaw, of roll and pitch, and of the mount's roll, pitch and yaw among the angles."""


def slopes(offset: Callable[[tuple[float, ...]], float], at: tuple[float, ...]) -> list[float]:
    """What a radian more of each angle makes of the offset."""
    found = []
    for column in range(len(at)):
        aside = [STEP * (n == column) for n in range(len(at))]
        more = offset(tuple(angle + step for angle, step in zip(at, aside, strict=True)))
        less = offset(tuple(angle - step for angle, step in zip(at, aside, strict=True)))
        found.append((more - less) / (2 * STEP))
    return found


def assert_derived(sight: LineSight, told: list[float], near: float) -> None:
    assert sight.offset_per_yaw == pytest.approx(told[TURN], abs=near)
    assert sight.offset_per_tilt == pytest.approx([told[n] for n in TILT], abs=near)
    assert sight.offset_per_mount == pytest.approx([told[n] for n in MOUNT], abs=near)
    # of the first order in the tilt
    assert sight.offset_per_mount_yaw == pytest.approx(told[MOUNT_TURN], abs=near + 0.06)


@settings(max_examples=80)
@given(
    st.sampled_from([0.0, math.pi / 2]), number(-0.2, 0.2), number(-120, 120), small, small, number(-0.1, 0.1)
)
def test_what_tilt_and_turn_make_of_a_line_is_derived_rightly(
    along: float, skew: float, rho_px: float, roll: float, pitch: float, yaw: float
) -> None:
    """`along` a column or a row of the picture, which turns by `skew`."""

    def seen(angles: tuple[float, ...]) -> LineSight:
        sight = line_seen(max(along + skew, 0.0) % math.pi, rho_px, angles[0], view(*angles[1:]))
        assert sight is not None
        return sight

    at = (yaw, roll, pitch, 0.0, 0.0, 0.0)
    told = slopes(lambda angles: seen(angles).offset_m, at)
    # the middle of what is in view slides along a line that lies askew
    assert_derived(seen(at), told, near=0.12 * HEIGHT_M * (abs(skew) + abs(yaw)) + 0.04)


@settings(max_examples=80)
@given(number(-250, 250), number(-130, 130), small, small, number(-3, 3))
def test_what_tilt_and_turn_make_of_a_feature_is_derived_rightly(
    x_px: float, y_px: float, roll: float, pitch: float, yaw: float
) -> None:
    def seen(angles: tuple[float, ...]) -> tuple[LineSight, LineSight]:
        return point_seen(x_px, y_px, angles[0], view(*angles[1:]))

    at = (yaw, roll, pitch, 0.0, 0.0, 0.0)
    assert_derived(seen(at)[0], slopes(lambda angles: seen(angles)[0].offset_m, at), near=0.05)
    assert_derived(seen(at)[1], slopes(lambda angles: seen(angles)[1].offset_m, at), near=0.05)
