"""The types of a flight that is played back.  Times are seconds since the first message of the flight."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from flightd.core.geometry import Lens
from flightd.core.types import EventLevel, Phase
from flightd.replay.playback.decimation import TimeGrid
from flightd.site.site import Site

Array: TypeAlias = NDArray[np.float64]
Segment: TypeAlias = tuple[float, float, float, float]
"""x0, y0, x1, y1 on the map, m."""


@dataclass(frozen=True, slots=True)
class Moment:
    """What the mission said, from `t_s` until the next one."""

    t_s: float
    phase: Phase
    reason: str
    node: str
    goal: str
    nodes_done: int
    nodes_planned: int


@dataclass(frozen=True, slots=True)
class PlayedEvent:
    """An event of the flight."""

    t_s: float
    level: EventLevel
    name: str
    text: str


@dataclass(frozen=True, slots=True)
class Leg:
    """From `t_s` on the drone makes for `via` and its goal, the last of them; None: it never did."""

    t_s: float | None
    via: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class PoseTrack:
    """Poses on the map, arrays of one length, times rising; sigmas are standard deviations, NaN where there
    are none.  Of the truth there are no sigmas."""

    t_s: Array
    x_m: Array
    y_m: Array
    yaw_rad: Array
    sigma_x_m: Array
    sigma_y_m: Array
    sigma_yaw_rad: Array


@dataclass(frozen=True, slots=True)
class SeenFloor:
    """The painted lines that the drone saw at a time, where it took them to be on the map."""

    t_s: float
    lines: tuple[Segment, ...]


@dataclass(frozen=True, slots=True)
class Playback:
    """`columns` hold the quantities by name, each at `grid.times_s()`, float32, NaN where it is unknown.
    `damage` is "" for a whole log.  `estimated` are figures by the estimate, for flights without a judge."""

    start_ns: int
    duration_s: float
    damage: str
    metadata: Mapping[str, str]
    site: Site | None
    map_error: str
    lens: Lens | None
    moments: tuple[Moment, ...]
    events: tuple[PlayedEvent, ...]
    legs: tuple[Leg, ...]
    track: PoseTrack
    truth: PoseTrack | None
    seen: tuple[SeenFloor, ...]
    grid: TimeGrid
    columns: Mapping[str, NDArray[np.float32]]
    estimated: Mapping[str, float]
