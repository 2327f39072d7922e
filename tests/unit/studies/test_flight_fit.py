"""The parts of a fit over whole flights, against what can be had in other ways."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.config.tracking import MotionNoise
from flightd.core.camera_view import CameraView, Viewpoint
from flightd.core.geometry import GRAVITY_MPS2, Lens, Mount
from flightd.studies.flight_fit.bordered_chain import BorderedChain
from flightd.studies.flight_fit.camera_model import SeenFrom, ends_off
from flightd.studies.flight_fit.motion import (
    PITCH,
    PUSH_X,
    ROLL,
    SENSORS,
    STATES,
    VX,
    VY,
    Motion,
    Sensor,
    X,
    Y,
)
from flightd.studies.flight_fit.record import Series

LENS = Lens(640, 360, 381.4, 380.0, 322.0, 178.0)


@pytest.mark.parametrize(("states", "shared"), [(1, 2), (2, 1), (7, 5)])
def test_the_chain_is_solved_as_the_whole_would_be(states: int, shared: int) -> None:
    rng, size = np.random.default_rng(states), 3
    total = states * size + shared
    rows = rng.normal(size=(4 * total, total))
    for row, state in enumerate(
        rng.integers(0, states, 4 * total)
    ):  # each sees two neighbours and the shared
        near = np.zeros(total, bool)
        near[state * size : (state + 2) * size] = near[states * size :] = True
        rows[row, ~near] = 0.0
    normal, rhs = rows.T @ rows + np.eye(total), rng.normal(size=total)
    chain = BorderedChain.empty(states, size, shared)
    for k in range(states):
        part, after = slice(k * size, (k + 1) * size), slice((k + 1) * size, (k + 2) * size)
        chain.own[k], chain.own_rhs[k] = normal[part, part], rhs[part]
        chain.border[k] = normal[part, states * size :]
        if k + 1 < states:
            chain.link[k] = normal[part, after]
    chain.shared[:], chain.shared_rhs[:] = normal[states * size :, states * size :], rhs[states * size :]
    left = chain.eliminate()
    covariance = np.linalg.inv(left.shared)
    step = covariance @ left.rhs
    whole = np.linalg.solve(normal, rhs)
    assert step == pytest.approx(whole[states * size :])
    assert left.substitute(step).ravel() == pytest.approx(whole[: states * size])
    assert covariance == pytest.approx(np.linalg.inv(normal)[states * size :, states * size :])


angle = st.floats(-0.3, 0.3)


@settings(deadline=None)
@given(angle, angle, st.floats(-3.0, 3.0), angle, angle, st.floats(-3.0, 3.0), st.floats(0.0, math.pi))
def test_points_of_a_line_lie_on_it_in_the_picture(
    roll: float, pitch: float, yaw: float, mount_roll: float, mount_pitch: float, mount_yaw: float, way: float
) -> None:
    mount = Mount(0.3, (0.05, -0.02, 0.03), 0.01, -0.02)
    really = Mount(0.3 + mount_yaw, mount.offset_m, 0.01 + mount_roll, -0.02 + mount_pitch)
    view = CameraView(LENS, Viewpoint.at(1.0, 2.0, 1.5, roll, pitch, yaw, really))
    along = np.array([[math.cos(way), math.sin(way), 0.0]])
    points = np.array([[1.2, 1.9, 0.0]]) + along * np.array([[-0.4], [0.5]])
    ends = view.project_ideal(points)
    if not np.isfinite(ends).all():
        return
    one = {name: np.array([value]) for name, value in {
        "x_m": 1.0, "y_m": 2.0, "height_m": 1.5, "roll_rad": roll, "pitch_rad": pitch, "yaw_rad": yaw,
        "mount_roll_rad": mount_roll, "mount_pitch_rad": mount_pitch, "mount_yaw_rad": mount_yaw,
        "log_focal": 0.0, "bend": 0.0, "line_x_m": 1.2, "line_y_m": 1.9, "direction_rad": way,
    }.items()}  # fmt: skip
    assert ends_off(ends[None], LENS, mount, SeenFrom(**one)) == pytest.approx(np.zeros((1, 2)), abs=1e-6)


def test_an_end_lies_off_a_line_by_its_pixels() -> None:
    level = {name: np.zeros(1) for name in SeenFrom.__dataclass_fields__}
    seen = SeenFrom(**level | {"height_m": np.array([2.0]), "line_x_m": np.array([0.0])})
    lens = Lens(640, 360, 400.0, 400.0, 319.5, 179.5)
    ends = np.array([[[319.5 + 4.0, 100.0], [319.5 + 6.0, 300.0]]])
    assert np.abs(ends_off(ends, lens, Mount(), seen)) == pytest.approx(np.array([[4.0, 6.0]]))


def still(seconds: float = 10.0) -> Series:
    return Series(np.linspace(-1.0, seconds, 200), np.zeros((200, 3)))


def test_a_tilt_that_is_not_told_accelerates() -> None:
    motion = Motion(still(), np.zeros(1), np.array([0.1]), MotionNoise(drag_per_s=0.0))
    states = np.zeros((1, STATES))
    states[0, PITCH], states[0, ROLL] = -0.1, 0.05  # nose down: forward; right side down: to the right
    end = motion.after(states, np.zeros(SENSORS))[0]
    assert end[VX] == pytest.approx(GRAVITY_MPS2 * math.tan(0.1) * 0.1)
    assert end[VY] == pytest.approx(GRAVITY_MPS2 * math.tan(0.05) * 0.1)
    assert end[X] == pytest.approx(end[VX] * 0.05)
    assert end[Y] == pytest.approx(end[VY] * 0.05)


def test_a_leaking_attitude_settles_at_its_bias() -> None:
    motion = Motion(still(), np.zeros(1), np.array([0.05]), MotionNoise(drag_per_s=0.0))
    sensors = np.zeros(SENSORS)
    sensors[Sensor.LEAK], sensors[Sensor.BIAS_ROLL] = 0.5, 0.02
    state = np.zeros((1, STATES))
    for _ in range(400):
        state = motion.after(state, sensors)
        state[:, [X, Y, VX, VY]] = 0.0
        state[:, PUSH_X + 1] = -GRAVITY_MPS2 * math.tan(state[0, ROLL])  # what holds it still
    assert state[0, ROLL] == pytest.approx(0.02, abs=1e-4)


def test_derivatives_are_those_of_the_motion() -> None:
    told = Series(np.linspace(0.0, 2.0, 101), np.random.default_rng(1).normal(scale=0.05, size=(101, 3)))
    motion = Motion(told, np.array([0.5, 1.0]), np.array([0.03, 0.04]), MotionNoise())
    rng = np.random.default_rng(2)
    states, sensors = rng.normal(scale=0.1, size=(2, STATES)), np.abs(rng.normal(scale=0.02, size=SENSORS))
    step = rng.normal(scale=1e-4, size=(2, STATES))
    told_step = np.einsum("sab,sb->sa", motion.by_states(states, sensors), step)
    moved = motion.after(states + step, sensors) - motion.after(states, sensors)
    assert moved == pytest.approx(told_step, abs=2e-7)
    turn = np.zeros(SENSORS)
    turn[[Sensor.BIAS_ROLL, Sensor.DRAUGHT_X, Sensor.LEAK]] = 1e-4, -2e-4, 1e-4
    moved = motion.after(states, sensors + turn) - motion.after(states, sensors)
    assert moved == pytest.approx(motion.by_sensors(states, sensors) @ turn, abs=1e-9)
