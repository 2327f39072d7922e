"""Whole flights fitted by frames whose rows were exposed one after the other."""

from __future__ import annotations

import functools
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flightd.config.schema import Config, load_config
from flightd.core.errors import RunError
from flightd.core.geometry import GRAVITY_MPS2, Mount
from flightd.core.tracks import NOT_SEEN
from flightd.core.types import LineSet
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.random_sites import random_site
from flightd.site.painted_lines import PaintMap
from flightd.studies.flight_fit.fit import LineBelief, fit_flights
from flightd.studies.flight_fit.motion import BELIEVED, Sensor
from flightd.studies.flight_fit.record import FlightRecord, Series
from flightd.studies.sensor_fit import fit_sensors
from flightd.tracking.rolling_shutter import ImageMotion, as_of_one_moment
from tests.sim.ideal.ideal_sight import EyeErrors, IdealEye

SITE = random_site(3)
READOUT_S = 0.03
HEIGHT_M = 1.6


def config(readout_s: float) -> Config:
    plain = load_config(Path(__file__).parents[3] / "configs" / "sim.toml")
    mount = {"mount_yaw_deg": 0.0, "mount_roll_deg": 0.0, "mount_pitch_deg": 0.0, "mount_offset_m": (0, 0, 0)}
    return plain.with_values(camera={**mount, "readout_s": readout_s})


def pose(at_s: float, drag_per_s: float) -> Kinematics:
    """A drone that swings along and across an aisle while it turns to and fro, as its lean accelerates it."""
    start = SITE.nodes["A1"]
    along, across, turn = (0.5, 1.7), (0.12, 2.9), (0.06, 2.2)
    x_m, vx_mps, ax_mps2 = swing(at_s, *along)
    y_m, vy_mps, ay_mps2 = swing(at_s, *across)
    yaw_rad, yaw_rate_radps, _ = swing(at_s, *turn)
    push_x, push_y = ax_mps2 + drag_per_s * vx_mps, ay_mps2 + drag_per_s * vy_mps
    forward = math.cos(yaw_rad) * push_x + math.sin(yaw_rad) * push_y
    right = -math.sin(yaw_rad) * push_x + math.cos(yaw_rad) * push_y
    roll_rad, pitch_rad = math.atan(right / GRAVITY_MPS2), -math.atan(forward / GRAVITY_MPS2)
    still = Kinematics(0, 0, 0, HEIGHT_M, 0, 0, 0, 0, 0, 0, 0, 0, 0)
    return replace(
        still, stamp_ns=round(at_s * 1e9), x_m=start.x_m + x_m, y_m=start.y_m + y_m, vx_mps=vx_mps,
        vy_mps=vy_mps, roll_rad=roll_rad, pitch_rad=pitch_rad, yaw_rad=yaw_rad, yaw_rate_radps=yaw_rate_radps,
    )  # fmt: skip


def swing(at_s: float, size: float, per_s: float) -> tuple[float, float, float]:
    """Place, speed and acceleration."""
    sin, cos = math.sin(per_s * at_s), math.cos(per_s * at_s)
    return size * sin, size * per_s * cos, -size * per_s**2 * sin


@functools.cache
def flown() -> FlightRecord:
    """Ten seconds of it, by a camera whose rows are exposed within READOUT_S."""
    truth = config(READOUT_S)
    drag_per_s, lens = truth.tracking.expert.noise.drag_per_s, truth.camera.lens()
    eye = IdealEye(SITE, lens, Mount(), EyeErrors(0.05, 0.0001), 1)
    told_s = np.arange(-0.5, 10.5, 0.01)
    told = [pose(at_s, drag_per_s) for at_s in told_s.tolist()]
    attitudes = Series(told_s, np.array([(k.roll_rad, k.pitch_rad, k.yaw_rad) for k in told]))
    poses = Series(told_s, np.array([(k.x_m, k.y_m, k.yaw_rad) for k in told]))
    frame_s = np.arange(0.0, 10.0, 0.05)
    frames: list[LineSet] = []
    for number, at_s in enumerate(frame_s.tolist()):
        k = pose(at_s, drag_per_s)
        rates = (attitudes.at(np.array([at_s + 1e-2])) - attitudes.at(np.array([at_s - 1e-2])))[0] / 0.02
        motion = ImageMotion.of(tuple(rates.tolist()), (k.vx_mps, k.vy_mps), k.yaw_rad, k.height_m, Mount())
        frames.append(as_of_one_moment(eye.see(k, number, k.stamp_ns), lens, motion, -READOUT_S))
    heights = Series(told_s, np.full((len(told_s), 1), HEIGHT_M))
    return FlightRecord(Path("made.mcap"), attitudes, heights, poses, tuple(frames), frame_s, NOT_SEEN, 0.0)


def misfit_and_off_rad(readout_s: float) -> tuple[float, float]:
    """By how much the lines do not fit, and by how much the mount found is off: it is as configured."""
    count = sum(len(axis.at_m) for axis in PaintMap.of(SITE).axes)
    sensors = BELIEVED.copy()
    sensors[[Sensor.FOCAL, Sensor.HEIGHT, Sensor.BEND]] = 0.0
    belief = LineBelief(np.zeros(count), np.zeros(count))
    fit = fit_flights([flown()], [config(readout_s)], SITE, belief, sensors)
    mount = fit.flights[0].sensors[[Sensor.MOUNT_ROLL, Sensor.MOUNT_PITCH, Sensor.MOUNT_YAW]]
    return fit.misfit, float(np.abs(mount).max())


def test_rows_exposed_one_after_the_other_are_taken_for_what_they_are() -> None:
    as_if_at_once, off_rad = misfit_and_off_rad(0.0)
    as_exposed, left_rad = misfit_and_off_rad(READOUT_S)
    assert as_exposed < 0.2 * as_if_at_once
    assert math.degrees(off_rad) > 0.2
    assert math.degrees(left_rad) < 0.05


def test_a_flight_in_which_no_line_is_one_of_the_map_is_refused() -> None:
    painted_wider = replace(SITE, line_width_m=4.0 * SITE.line_width_m)
    with pytest.raises(
        RunError, match=r"^made\.mcap: lines of the map .* in 0 of 200 frames, 50 are needed; "
    ):
        fit_sensors(flown(), config(READOUT_S), painted_wider)
