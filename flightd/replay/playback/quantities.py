"""The quantities that are plotted of a flight, each over its own times."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from flightd.core.types import Phase
from flightd.replay.playback.cross_track import cross_track_m
from flightd.replay.playback.flight import Array, Leg, Moment
from flightd.site.site import Site

Columns: TypeAlias = Mapping[str, Array]
Curve: TypeAlias = tuple[Array, Array]
"""Times in seconds and values."""


def quantities(
    site: Site | None,
    moments: Sequence[Moment],
    legs: Sequence[Leg],
    poses: Columns,
    truth: Columns | None,
    vehicle: Columns,
    setpoints: Columns,
    statuses: Columns,
) -> dict[str, Curve]:
    """By name, in SI units and radians; `true_…` by the simulator's truth, empty where there is none."""

    def of(columns: Columns, name: str) -> Curve:
        return columns["t_s"], columns[name]

    nothing = (np.zeros(0), np.zeros(0))
    tilt = np.hypot(vehicle["roll_rad"], vehicle["pitch_rad"])
    found = {
        "height_m": of(vehicle, "height_m"),
        "height_goal_m": of(statuses, "height_goal_m"),
        "true_height_m": of(truth, "height_m") if truth is not None else nothing,
        "speed_mps": of(poses, "speed_mps"),
        "cross_track_m": (poses["t_s"], _cross_track(site, moments, legs, poses)),
        "true_cross_track_m": nothing,
        "hover_error_m": (poses["t_s"], hover_error_m(site, moments, poses)),
        "true_hover_error_m": nothing,
        "tilt_rad": (vehicle["t_s"], tilt),
        "tilt_goal_rad": (setpoints["t_s"], np.hypot(setpoints["roll_rad"], setpoints["pitch_rad"])),
        "roll_rad": of(vehicle, "roll_rad"),
        "pitch_rad": of(vehicle, "pitch_rad"),
        "battery_frac": of(vehicle, "battery_frac"),
        "latency_s": (statuses["t_s"], statuses["latency_ms"] * 1e-3),
    }
    if truth is not None:
        found["true_cross_track_m"] = (truth["t_s"], _cross_track(site, moments, legs, truth))
        found["true_hover_error_m"] = (truth["t_s"], hover_error_m(site, moments, truth))
    return found


def _cross_track(site: Site | None, moments: Sequence[Moment], legs: Sequence[Leg], poses: Columns) -> Array:
    """Beside the leg while it is followed; over a node the hover error tells."""
    if site is None:
        return np.full(poses["t_s"].shape, math.nan)
    start = next((moment.node for moment in moments if moment.node), "")
    offset = cross_track_m(site, start, legs, poses["t_s"], poses["x_m"], poses["y_m"])
    offset[~in_phases(moments, poses["t_s"], {Phase.FOLLOW})] = math.nan
    return offset


def hover_error_m(site: Site | None, moments: Sequence[Moment], poses: Columns) -> Array:
    """How far from the node it hovers over each pose is; NaN in other phases, and where that is unknown."""
    error = np.full(poses["t_s"].shape, math.nan)
    if site is None or not moments:
        return error
    place = _moment_at(moments, poses["t_s"])
    hovers = in_phases(moments, poses["t_s"], {Phase.HOVER})
    for index in np.unique(place[hovers]):
        node = site.nodes.get(moments[index].goal or moments[index].node)
        if node is not None:
            part = hovers & (place == index)
            error[part] = np.hypot(poses["x_m"][part] - node.x_m, poses["y_m"][part] - node.y_m)
    return error


def in_phases(moments: Sequence[Moment], t_s: Array, phases: Collection[Phase]) -> NDArray[np.bool_]:
    """Which of these times fall into one of these phases."""
    if not moments:
        return np.zeros(t_s.shape, bool)
    inside = np.array([moment.phase in phases for moment in moments])
    place = _moment_at(moments, t_s)
    found: NDArray[np.bool_] = inside[np.maximum(place, 0)] & (place >= 0)
    return found


def _moment_at(moments: Sequence[Moment], t_s: Array) -> NDArray[np.intp]:
    """The place of the moment at each time; -1 before the first."""
    begins = np.array([moment.t_s for moment in moments])
    return np.searchsorted(begins, t_s, side="right") - 1


def rms(values: Array) -> float:
    """The root mean square of those that are numbers; NaN where there are none."""
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else math.nan


def within(values: Array, percent: float) -> float:
    """That percentile of those that are numbers; NaN where there are none."""
    known = values[np.isfinite(values)]
    return float(np.percentile(known, percent)) if len(known) else math.nan
