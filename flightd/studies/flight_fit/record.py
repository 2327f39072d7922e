"""What a fit takes from a flight log: attitudes and heights told, poses flown by, the lines of each frame."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flightd.core.errors import InputError
from flightd.core.geometry import Matrix
from flightd.core.tick import TickInput
from flightd.core.topics import Topic
from flightd.core.tracks import NOT_SEEN, SensorEstimate
from flightd.core.types import GridPose, LineSet, Status
from flightd.replay.log import FlightLog, recorded_tick

READ = frozenset({Topic.TICK, Topic.POSE, Topic.STATUS})
"""The topics that a record is made of."""
_LOWEST_M = 0.6
"""Nearer to the floor hardly a line is seen whole, and the range finder tells least."""
_LEAST_INTEGRITY = 0.9
_POSE_GAP_S, _ATTITUDE_GAP_S, _HEIGHT_GAP_S = 0.3, 0.15, 0.4
_KERNEL_S = 0.25
"""Told heights are averaged over so long, before and after."""
_LEAST_FRAMES = 100


@dataclass(frozen=True, slots=True)
class Series:
    """Samples of D quantities at T rising times: (T,) seconds and (T, D)."""

    at_s: Matrix
    values: Matrix

    def at(self, when_s: Matrix) -> Matrix:
        """(N, D), between samples along the straight line, beyond them the nearest."""
        columns = [np.interp(when_s, self.at_s, column) for column in self.values.T]
        return np.stack(columns, axis=-1)

    def gap_s(self, when_s: Matrix) -> Matrix:
        """(N,) the distance to the farther of the samples before and after; infinite beyond them."""
        after = np.searchsorted(self.at_s, when_s)
        bounds = np.concatenate([[-math.inf], self.at_s, [math.inf]])
        gap: Matrix = np.maximum(when_s - bounds[after], bounds[after + 1] - when_s)
        return gap


@dataclass(frozen=True, slots=True)
class FlightRecord:
    """One flight, times in seconds from its first tick.

    `attitudes` (roll, pitch, yaw, which goes on beyond pi) and `heights` are as told, `poses` (x, y, yaw) as
    flown by.  The K `frames` are those in flight that a fit can use, `frame_s` (K,) when they were
    exposed by their stamps.  `sensors` is what the flight's own filter said last, `clock_error_s` by how much
    the attitudes' times may be wrong."""

    path: Path
    attitudes: Series
    heights: Series
    poses: Series
    frames: tuple[LineSet, ...]
    frame_s: Matrix
    sensors: SensorEstimate
    clock_error_s: float


def flight_record(log: FlightLog) -> FlightRecord:
    """The record of a log read with READ.  InputError where nothing was flown by lines in it."""
    attitudes: list[tuple[float, float, float, float]] = []
    heights: list[tuple[float, float]] = []
    frames: list[LineSet] = []
    clock_errors: list[float] = []
    start_ns: int | None = None
    for tick in _ticks(log):
        start_ns = tick.now_ns if start_ns is None else start_ns
        for told in tick.attitudes:
            at_s = (told.stamp_ns - start_ns) * 1e-9
            if not attitudes or at_s > attitudes[-1][0]:
                attitudes.append((at_s, told.roll_rad, told.pitch_rad, told.yaw_rad))
        vehicle = tick.vehicle
        if vehicle is not None and vehicle.armed:
            at_s = (vehicle.height_stamp_ns - start_ns) * 1e-9
            if math.isfinite(vehicle.height_m) and (not heights or at_s > heights[-1][0]):
                heights.append((at_s, vehicle.height_m))
            if math.isfinite(vehicle.clock_error_s):
                clock_errors.append(vehicle.clock_error_s)
            frames += [seen for seen in tick.lines if not frames or seen.stamp_ns > frames[-1].stamp_ns]
    poses = _poses(log.messages(GridPose), start_ns or 0)
    if start_ns is None or not (attitudes and heights and len(poses.at_s)):
        raise InputError("nothing was flown by lines in it", file=log.path)
    turned = np.array(attitudes)
    turned[:, 3] = np.unwrap(turned[:, 3])
    attitude, height = Series(turned[:, 0], turned[:, 1:]), _smoothed(np.array(heights))
    frame_s = np.array([(seen.stamp_ns - start_ns) * 1e-9 for seen in frames])
    usable = _usable(frame_s, attitude, height, poses)
    if int(usable.sum()) < _LEAST_FRAMES:
        what = f"only {int(usable.sum())} frames in flight, {_LEAST_FRAMES} are needed"
        raise InputError(what, file=log.path)
    known = [status.sensors for status in log.messages(Status) if status.sensors.is_known]
    return FlightRecord(
        path=log.path,
        attitudes=attitude,
        heights=height,
        poses=poses,
        frames=tuple(seen for seen, use in zip(frames, usable, strict=True) if use),
        frame_s=frame_s[usable],
        sensors=known[-1] if known else NOT_SEEN,
        clock_error_s=float(np.median(clock_errors)) if clock_errors else 0.0,
    )


def _ticks(log: FlightLog) -> Iterator[TickInput]:
    for entry in log.entries:
        if entry.topic == Topic.TICK:
            yield recorded_tick(log.path, entry.message)


def _poses(poses: list[GridPose], start_ns: int) -> Series:
    sure = [pose for pose in poses if pose.integrity >= _LEAST_INTEGRITY]
    table = np.array([(pose.stamp_ns, pose.x_m, pose.y_m, pose.yaw_rad) for pose in sure]).reshape(-1, 4)
    at_s = np.array([(pose.stamp_ns - start_ns) * 1e-9 for pose in sure])
    rising = np.concatenate([[True], np.diff(at_s) > 0]) if len(at_s) else np.zeros(0, bool)
    table[:, 3] = np.unwrap(table[:, 3])
    return Series(at_s[rising], table[rising, 1:])


def _smoothed(heights: Matrix) -> Series:
    """The told heights averaged over neighbours, by how near they are in time: so no sample's noise is taken
    for motion, and a climb is not late."""
    at_s, told = heights.T
    first = np.searchsorted(at_s, at_s - _KERNEL_S)
    last = np.searchsorted(at_s, at_s + _KERNEL_S, side="right")
    mean = np.empty_like(told)
    for i, (low, high) in enumerate(zip(first, last, strict=True)):
        near_s = at_s[low:high] - at_s[i]
        weight = 1.0 - np.abs(near_s) / _KERNEL_S + 1e-3
        # a straight line through the neighbours: at the record's ends and over gaps they lie to one side
        centre = np.average(near_s, weights=weight)
        spread = np.average((near_s - centre) ** 2, weights=weight)
        level = np.average(told[low:high], weights=weight)
        slope = (
            np.average((near_s - centre) * told[low:high], weights=weight) / spread if spread > 1e-6 else 0
        )
        mean[i] = level - slope * centre
    return Series(at_s, mean[:, None])


def _usable(frame_s: Matrix, attitudes: Series, heights: Series, poses: Series) -> NDArray[np.bool_]:
    if not len(frame_s):
        return np.zeros(0, bool)
    near = attitudes.gap_s(frame_s) < _ATTITUDE_GAP_S
    near &= heights.gap_s(frame_s) < _HEIGHT_GAP_S
    near &= poses.gap_s(frame_s) < _POSE_GAP_S
    high: NDArray[np.bool_] = heights.at(frame_s)[:, 0] > _LOWEST_M
    return near & high
