"""What a flight's log tells, as arrays over time: the report's only view of the data.

Times are seconds since the first message that the flight clock stamped.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from flightd.core.tracks import SensorEstimate
from flightd.core.types import Event, LineSet, Phase, Status
from flightd.replay.log import FlightLog
from flightd.replay.playback.cross_track import cross_track_m
from flightd.replay.playback.flight import Leg
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
_AT_A_VIEW = frozenset({Phase.CLIMB, Phase.SCAN})
"""Of these, those that it may spend beside its leg, where it looks at a shelf from."""


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
    estimate judged afterwards.  `legs` begin at the node `start`, the first that was told.  `sensors` is what
    the lines said last of the drone's own sensors; `nodes` are those that were ordered, none: all of them."""

    log: FlightLog
    start_ns: int
    duration_s: float
    site: Site | None
    map_error: str
    phases: tuple[PhaseSpan, ...]
    start: str
    legs: tuple[Leg, ...]
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
        return self._within(t_s, FLYING)

    def _within(self, t_s: Array, phases: Collection[Phase]) -> NDArray[np.bool_]:
        inside = np.zeros(t_s.shape, bool)
        for span in self.phases:
            if span.phase in phases:
                inside |= (t_s >= span.start_s) & (t_s <= span.end_s)
        return inside

    def cross_track_m(self, track: Track) -> Array:
        """Signed distance of a track from the way of the leg that is flown: + towards +y on an aisle, towards
        +x on a cross line; NaN on the floor, where a shelf is looked at, and without a map."""
        if self.site is None:
            return np.full(track.t_s.shape, math.nan)
        distance = cross_track_m(self.site, self.start, self.legs, track.t_s, track.x_m, track.y_m)
        distance[~self._within(track.t_s, FLYING - _AT_A_VIEW)] = math.nan
        return distance
