"""What a flight's log tells, as arrays over time: the report's only view of the data.

Times are seconds since the first message that the flight clock stamped.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from flightd.core.tracks import SensorEstimate
from flightd.core.types import Event, LineSet, Phase, Status
from flightd.replay.log import FlightLog
from flightd.site.site import Site

Array: TypeAlias = NDArray[np.float64]
Summary: TypeAlias = dict[str, object]

NS_PER_S = 1e9
FLYING = frozenset(
    {
        Phase.ACQUIRE, Phase.FOLLOW, Phase.HOVER, Phase.TURN, Phase.CLIMB, Phase.SCAN, Phase.HOLD,
        Phase.RELOCATE,
    }
)  # fmt: skip
"""Phases in which the drone holds on to a line."""

_WINDOW_S = 0.6
"""The direction of flight is judged over twice this time."""

_STILL_M = 0.15
"""Who moved less in that time stands still."""


@dataclass(frozen=True, slots=True)
class PhaseSpan:
    """One unbroken stretch of a phase."""

    phase: Phase
    start_s: float
    end_s: float


@dataclass(frozen=True, slots=True)
class Visit:
    """A stop at a node, the scan there included; errors are horizontal distances from the node while it
    hovered over it (views of a scan are beside it), NaN where unknown."""

    number: int
    node: str
    start_s: float
    end_s: float
    believed_error_m: float
    true_error_m: float

    @property
    def dwell_s(self) -> float:
        return self.end_s - self.start_s


@dataclass(frozen=True, slots=True)
class Track:
    """Poses over time on the map: arrays of one length; angles in rad."""

    t_s: Array
    x_m: Array
    y_m: Array
    height_m: Array
    yaw_rad: Array

    def at(self, t_s: Array) -> tuple[Array, Array]:
        """x and y interpolated at other times; NaN outside of the track."""
        if not len(self.t_s):
            return np.full(t_s.shape, math.nan), np.full(t_s.shape, math.nan)
        x, y = (np.interp(t_s, self.t_s, values, math.nan, math.nan) for values in (self.x_m, self.y_m))
        return x, y


@dataclass(frozen=True, slots=True)
class TelemetrySeries:
    """The vehicle's own word over time; angles in rad, NaN where it did not know."""

    t_s: Array
    roll_rad: Array
    pitch_rad: Array
    height_m: Array
    battery_frac: Array


@dataclass(frozen=True, slots=True)
class Setpoints:
    t_s: Array
    roll_rad: Array
    pitch_rad: Array


@dataclass(frozen=True, slots=True)
class Latency:
    """Each frame's stages in ms, a row per frame; `stages` names the columns, "total" is the last."""

    t_s: Array
    stages: tuple[str, ...]
    values_ms: Array

    def stage(self, name: str) -> Array:
        """One stage's times, NaN where a frame has none."""
        column: Array = self.values_ms[:, self.stages.index(name)]
        return column


@dataclass(frozen=True, slots=True)
class RecordedFlight:
    """A flight as the report shows it.  `truth` and `summary` are there if their files are; `smoothed` is the
    estimate judged afterwards.  `sensors` is what the lines said last of the drone's
    own sensors; `nodes` are those that were ordered, none: all of them."""

    log: FlightLog
    start_ns: int
    duration_s: float
    site: Site | None
    map_error: str
    phases: tuple[PhaseSpan, ...]
    visits: tuple[Visit, ...]
    estimate: Track
    truth: Track | None
    smoothed: Track
    telemetry: TelemetrySeries
    setpoints: Setpoints
    latency: Latency
    events: tuple[Event, ...]
    last_status: Status | None
    sensors: SensorEstimate
    line_sets: dict[int, LineSet]
    config: str
    nodes: frozenset[str]
    summary: Summary

    def seconds(self, stamp_ns: int) -> float:
        """Report time of a stamp."""
        return (stamp_ns - self.start_ns) / NS_PER_S

    def phase_at(self, t_s: float) -> PhaseSpan | None:
        return next((span for span in self.phases if span.start_s <= t_s <= span.end_s), None)

    def flying(self, t_s: Array) -> NDArray[np.bool_]:
        """Which of these times fall into a phase in which the drone follows or holds a line."""
        inside = np.zeros(t_s.shape, bool)
        for span in self.phases:
            if span.phase in FLYING:
                inside |= (t_s >= span.start_s) & (t_s <= span.end_s)
        return inside

    def cross_track_m(self, track: Track) -> Array:
        """Signed distance of a track from the painted way it follows: + towards +y on an aisle, towards
        +x on a cross line; NaN outside of the flying phases and without a map."""
        distance = np.full(track.t_s.shape, math.nan)
        chosen = self.flying(track.t_s)
        if self.site is not None and chosen.any():
            along_x = _flies_along_x(track)
            for axis in (True, False):
                part = chosen & (along_x == axis)
                distance[part] = _offset_m(self.site, track.x_m[part], track.y_m[part], axis)
        return distance


def _flies_along_x(track: Track) -> NDArray[np.bool_]:
    """Whether the drone flies along x (an aisle) or y; while it stands still, as it came."""
    ahead_x, ahead_y = track.at(np.minimum(track.t_s + _WINDOW_S, track.t_s[-1]))
    behind_x, behind_y = track.at(np.maximum(track.t_s - _WINDOW_S, track.t_s[0]))
    moved_x, moved_y = np.abs(ahead_x - behind_x), np.abs(ahead_y - behind_y)
    moving = np.hypot(moved_x, moved_y) > _STILL_M
    if not moving.any():
        return np.ones(track.t_s.shape, bool)
    newest = np.maximum.accumulate(np.where(moving, np.arange(len(moving)), -1))
    newest[newest < 0] = int(np.argmax(moving))
    along_x: NDArray[np.bool_] = (moved_x >= moved_y)[newest]
    return along_x


def _offset_m(site: Site, x_m: Array, y_m: Array, along_x: bool) -> Array:
    """Signed distance across the nearest of the edges that run along x (or y); NaN if there is none."""
    nearest = np.full(x_m.shape, math.inf)
    offset = np.full(x_m.shape, math.nan)
    for edge in site.edges:
        a, b = site.nodes[edge.a], site.nodes[edge.b]
        if (abs(b.x_m - a.x_m) >= abs(b.y_m - a.y_m)) != along_x:
            continue
        if along_x:
            low, high, position, across = *sorted((a.x_m, b.x_m)), x_m, y_m - a.y_m
        else:
            low, high, position, across = *sorted((a.y_m, b.y_m)), y_m, x_m - a.x_m
        distance = np.hypot(position - np.clip(position, low, high), across)
        closer = distance < nearest
        nearest = np.where(closer, distance, nearest)
        offset = np.where(closer, across, offset)
    return offset
