"""Read a log for its playback: once from front to back, nothing of it held but numbers and changes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from flightd.core.errors import InputError
from flightd.core.flight_order import ChosenPlan, FlightOrder
from flightd.core.topics import RETAINED, Document, Topic
from flightd.core.types import AttitudeSetpoint, Event, GridPose, Status, VehicleState
from flightd.replay.log import Entry, LogReader
from flightd.replay.playback.decimation import TimeGrid, decimated
from flightd.replay.playback.flight import Array, Moment, Playback, PlayedEvent, PoseTrack
from flightd.replay.playback.legs import legs_of
from flightd.replay.playback.pictures import recorded_lens
from flightd.replay.playback.quantities import hover_error_m, quantities, rms, within
from flightd.replay.playback.samples import (
    Table,
    add_pose,
    add_setpoint,
    add_status,
    add_vehicle,
    pose_table,
    setpoint_table,
    status_table,
    vehicle_table,
)
from flightd.replay.playback.seen_floor import seen_floor
from flightd.replay.recorded_map import recorded_map
from flightd.site.site import Site

_TOPICS = frozenset(
    {
        Topic.POSE, Topic.VEHICLE, Topic.SETPOINT, Topic.STATUS, Topic.EVENT, Topic.MAP, Topic.CONFIG,
        Topic.ORDER, Topic.PLAN,
    }
)  # fmt: skip
_FINEST_S = 0.01
_MOST_STRETCHES = 40_000
"""Longer flights than seven minutes are kept more coarsely than they were recorded, peaks included."""
_MOST_VALUE = 1e30
"""No quantity is larger, whatever a log says; float32 holds it."""
_MOST_POSES = 4000
_MOST_EVENTS = 5000
_MOST_MOMENTS = 20_000
_TRUTH = ("x_m", "y_m", "height_m", "yaw_rad")

Columns: TypeAlias = Mapping[str, Array]


@dataclass
class _Gathered:
    poses: Table = field(default_factory=pose_table)
    vehicle: Table = field(default_factory=vehicle_table)
    setpoints: Table = field(default_factory=setpoint_table)
    statuses: Table = field(default_factory=status_table)
    moments: list[tuple[int, Status]] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    maps: list[Document] = field(default_factory=list)
    configs: list[Document] = field(default_factory=list)
    nodes: tuple[str, ...] = ()
    chosen: tuple[str, ...] = ()
    first_ns: int | None = None
    last_ns: int = 0

    def take(self, entry: Entry) -> None:
        if entry.topic not in RETAINED:
            self.first_ns = min(entry.stamp_ns if self.first_ns is None else self.first_ns, entry.stamp_ns)
            self.last_ns = max(self.last_ns, entry.stamp_ns)
        match entry.message:
            case GridPose():
                add_pose(self.poses, entry.message)
            case VehicleState():
                add_vehicle(self.vehicle, entry.message)
            case AttitudeSetpoint():
                add_setpoint(self.setpoints, entry.message)
            case Status():
                self._take_status(entry.message)
            case Event() if len(self.events) < _MOST_EVENTS:
                self.events.append(entry.message)
            case Document():
                kept = self.maps if entry.topic == Topic.MAP else self.configs
                kept[:] = [entry.message]
            case FlightOrder():
                self.nodes = entry.message.nodes
            case ChosenPlan():
                self.chosen = entry.message.nodes

    def _take_status(self, status: Status) -> None:
        add_status(self.statuses, status)
        if len(self.moments) < _MOST_MOMENTS and (
            not self.moments or _said(self.moments[-1][1]) != _said(status)
        ):
            self.moments.append((status.stamp_ns, status))


def load_playback(path: Path) -> Playback:
    """Read a log, and `truth.mcap` if it lies beside it.  InputError as `read_log`."""
    reader, gathered = LogReader(path), _Gathered()
    for entry in reader.entries(_TOPICS):
        gathered.take(entry)
    start_ns = gathered.first_ns or 0
    duration_s = max((gathered.last_ns - start_ns) * 1e-9, _FINEST_S)
    site, map_error = recorded_map(gathered.maps)
    if not gathered.maps:
        map_error = "no map was recorded"
    moments = _moments(gathered.moments, start_ns)
    poses = gathered.poses.column_set(start_ns)
    truth = _truth(path.with_name("truth.mcap"), start_ns)
    vehicle, setpoints, statuses = (
        table.column_set(start_ns) for table in (gathered.vehicle, gathered.setpoints, gathered.statuses)
    )
    legs = legs_of(site, ((moment.t_s, moment.goal) for moment in moments), gathered.chosen or gathered.nodes)
    with np.errstate(over="ignore", invalid="ignore"):  # what overflows is told as unknown
        found = quantities(site, moments, legs, poses, truth, vehicle, setpoints, statuses)
        estimated = _estimated(site, moments, poses, found)
    stretches = min(max(math.ceil(duration_s / _FINEST_S), 1), _MOST_STRETCHES)
    grid = TimeGrid(0.0, duration_s, stretches)
    return Playback(
        start_ns=start_ns,
        duration_s=duration_s,
        damage=reader.damage,
        metadata=reader.metadata,
        site=site,
        map_error=map_error,
        lens=recorded_lens(gathered.configs, path),
        moments=moments,
        events=tuple(
            PlayedEvent((event.stamp_ns - start_ns) * 1e-9, event.level, event.name, event.text)
            for event in gathered.events
        ),
        legs=legs,
        track=_track(poses),
        truth=_track(truth) if truth is not None else None,
        seen=seen_floor(path, start_ns, duration_s),
        grid=grid,
        columns={
            name: np.clip(decimated(t_s, values, grid), -_MOST_VALUE, _MOST_VALUE).astype(np.float32)
            for name, (t_s, values) in found.items()
        },
        estimated=estimated,
    )


def _said(status: Status) -> tuple[object, ...]:
    return (status.phase, status.reason, status.node, status.goal, status.nodes_done, status.nodes_planned)


def _moments(told: Sequence[tuple[int, Status]], start_ns: int) -> tuple[Moment, ...]:
    return tuple(
        Moment(
            (stamp_ns - start_ns) * 1e-9,
            status.phase,
            status.reason,
            status.node,
            status.goal,
            status.nodes_done,
            status.nodes_planned,
        )
        for stamp_ns, status in sorted(told, key=lambda one: one[0])
    )


def _truth(path: Path, start_ns: int) -> Columns | None:
    """What the simulator's truth was; None where it was not recorded, or cannot be read."""
    if not path.is_file() or path.is_symlink():
        return None
    table = Table(*_TRUTH, *_NO_SIGMAS)
    try:
        for entry in LogReader(path).entries({Topic.TRUTH}):
            if isinstance(entry.message, dict):
                numbers = (float(entry.message[name]) for name in _TRUTH)
                table.add(int(entry.message["stamp_ns"]), *numbers, *(math.nan for _ in _NO_SIGMAS))
    except (InputError, KeyError, TypeError, ValueError):
        return None
    found = table.column_set(start_ns)
    return found if len(found["t_s"]) else None


_NO_SIGMAS = ("sigma_x_m", "sigma_y_m", "sigma_yaw_rad")


def _track(poses: Columns) -> PoseTrack:
    known = np.isfinite(poses["x_m"]) & np.isfinite(poses["y_m"])
    places: NDArray[np.intp] = np.flatnonzero(known)
    if len(places) > _MOST_POSES:
        places = places[np.linspace(0, len(places) - 1, _MOST_POSES).astype(np.intp)]
    names = ("t_s", "x_m", "y_m", "yaw_rad", "sigma_x_m", "sigma_y_m", "sigma_yaw_rad")
    return PoseTrack(*(poses[name][places] for name in names))


def _estimated(
    site: Site | None,
    moments: Sequence[Moment],
    poses: Columns,
    found: Mapping[str, tuple[Array, Array]],
) -> dict[str, float]:
    figures = {
        "cross_track_rms_m": rms(found["cross_track_m"][1]),
        "hover_error_p95_m": within(hover_error_m(site, moments, poses), 95),
    }
    return {name: value for name, value in figures.items() if math.isfinite(value)}
