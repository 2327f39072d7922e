"""The numbers of a log as they come, in columns; what a hostile or endless log holds is bounded."""

from __future__ import annotations

import math
from array import array
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from flightd.core.types import AttitudeSetpoint, GridPose, Status, VehicleState

Array: TypeAlias = NDArray[np.float64]

MOST_SAMPLES = 2_000_000
"""Of each stream: nine hours at 60 Hz; what comes later is left out."""


class Table:
    """Rows of numbers with a stamp each, eight bytes a number."""

    def __init__(self, *names: str) -> None:
        self._names = names
        self._stamps = array("q")
        self._values = array("d")

    def add(self, stamp_ns: int, *values: float) -> None:
        if len(self._stamps) < MOST_SAMPLES and -(2**63) <= stamp_ns < 2**63:
            self._stamps.append(stamp_ns)
            self._values.extend(values)

    def column_set(self, start_ns: int) -> dict[str, Array]:
        """The columns by name and `t_s`, seconds since `start_ns`, in the order of time."""
        stamps = np.frombuffer(self._stamps, np.int64) if self._stamps else np.zeros(0, np.int64)
        rows = np.frombuffer(self._values, np.float64) if self._values else np.zeros(0)
        order = np.argsort(stamps, kind="stable")
        rows = rows.reshape(len(stamps), len(self._names))[order]
        t_s: Array = (stamps[order] - start_ns).astype(np.float64) * 1e-9
        return {"t_s": t_s, **{name: rows[:, place] for place, name in enumerate(self._names)}}


def pose_table() -> Table:
    return Table("x_m", "y_m", "yaw_rad", "height_m", "speed_mps", "sigma_x_m", "sigma_y_m", "sigma_yaw_rad")


def add_pose(table: Table, pose: GridPose) -> None:
    table.add(
        pose.stamp_ns,
        pose.x_m,
        pose.y_m,
        pose.yaw_rad,
        pose.height_m,
        math.hypot(pose.vx_mps, pose.vy_mps),
        *(_sigma(pose.covariance, place) for place in (0, 4, 8)),
    )


def vehicle_table() -> Table:
    return Table("roll_rad", "pitch_rad", "height_m", "battery_frac")


def add_vehicle(table: Table, state: VehicleState) -> None:
    attitude = state.attitude
    table.add(attitude.stamp_ns, attitude.roll_rad, attitude.pitch_rad, state.height_m, state.battery_frac)


def setpoint_table() -> Table:
    return Table("roll_rad", "pitch_rad")


def add_setpoint(table: Table, setpoint: AttitudeSetpoint) -> None:
    table.add(setpoint.stamp_ns, setpoint.roll_rad, setpoint.pitch_rad)


def status_table() -> Table:
    return Table("latency_ms", "height_goal_m")


def add_status(table: Table, status: Status) -> None:
    goal_m = math.nan if status.height_goal_m is None else status.height_goal_m
    table.add(status.stamp_ns, status.latency_ms.get("total", math.nan), goal_m)


def _sigma(covariance: tuple[float, ...], place: int) -> float:
    variance = covariance[place] if len(covariance) > place else math.nan
    return math.sqrt(variance) if 0.0 <= variance < math.inf else math.nan
