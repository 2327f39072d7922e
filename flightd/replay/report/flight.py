"""What a flight's log tells, as arrays over time: the report's only view of the data.

Times are seconds since the first message that the flight clock stamped.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import msgspec
import numpy as np
from numpy.typing import NDArray

from flightd.config.site_file import parse_site
from flightd.core.errors import InputError
from flightd.core.topics import FOR_PEOPLE, RETAINED, Document, Topic
from flightd.core.types import AttitudeSetpoint, Event, GridPose, LineSet, Phase, Status, VehicleState
from flightd.grid.site import Site
from flightd.replay.log import FlightLog, read_log

Array: TypeAlias = NDArray[np.float64]
Summary: TypeAlias = dict[str, object]

NS_PER_S = 1e9
FLYING = frozenset({Phase.ACQUIRE, Phase.FOLLOW, Phase.HOVER, Phase.TURN, Phase.HOLD})
"""Phases in which the drone holds on to a line."""

_WINDOW_S = 0.6
"""The direction of flight is judged over twice this time."""

_SHORTEST_STOP_S = 0.2
"""A hover that the mission leaves at once is no stop."""

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
    """A stop at a node; errors are horizontal distances from the node, NaN where unknown."""

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
class Telemetry:
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
class Flight:
    """A flight as the report shows it.  `truth` and `summary` are there if their files are."""

    log: FlightLog
    start_ns: int
    duration_s: float
    site: Site | None
    map_error: str
    phases: tuple[PhaseSpan, ...]
    visits: tuple[Visit, ...]
    estimate: Track
    truth: Track | None
    telemetry: Telemetry
    setpoints: Setpoints
    latency: Latency
    events: tuple[Event, ...]
    last_status: Status | None
    line_sets: dict[int, LineSet]
    config: str
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


def load_flight(path: Path) -> Flight:
    """Read a log, and `truth.mcap` and `summary.json` if they lie beside it.  Raises InputError."""
    log = read_log(path, FOR_PEOPLE)
    truths = _truth_messages(path.with_name("truth.mcap"))
    statuses = log.messages(Status)
    stamps_ns = [entry.stamp_ns for entry in log.entries if entry.topic not in RETAINED]
    start_ns, end_ns = min(stamps_ns, default=0), max(stamps_ns, default=0)

    def seconds(stamps_ns: Iterable[int]) -> Array:
        return (np.fromiter(stamps_ns, np.float64) - start_ns) / NS_PER_S

    estimate = _estimate(log.messages(GridPose), seconds)
    truth = _truth(truths, seconds) if truths else None
    site, map_error = _site(log)
    phases = tuple(_phase_spans(statuses, start_ns))
    return Flight(
        log=log,
        start_ns=start_ns,
        duration_s=max(0.0, (end_ns - start_ns) / NS_PER_S),
        site=site,
        map_error=map_error,
        phases=phases,
        visits=tuple(_visits(statuses, start_ns, site, estimate, truth)),
        estimate=estimate,
        truth=truth,
        telemetry=_telemetry(log.messages(VehicleState), seconds),
        setpoints=_setpoints(log.messages(AttitudeSetpoint), seconds),
        latency=_latency(statuses, seconds),
        events=tuple(log.messages(Event)),
        last_status=statuses[-1] if statuses else None,
        line_sets={lines.frame_seq: lines for lines in log.messages(LineSet)},
        config="\n".join(document.text for document in log.messages(Document, Topic.CONFIG)),
        summary=_summary(path.with_name("summary.json")),
    )


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


def _summary(path: Path) -> Summary:
    try:
        summary = msgspec.json.decode(path.read_bytes(), type=dict[str, object])
    except FileNotFoundError:
        return {}
    except (OSError, msgspec.DecodeError) as err:
        raise InputError(f"{path}: not a readable summary ({err}); repair or remove it") from None
    return summary


def _site(log: FlightLog) -> tuple[Site | None, str]:
    """The recorded map, or None and why it cannot be drawn: a report without it is worth having."""
    maps = log.messages(Document, Topic.MAP)
    if not maps:
        return None, ""
    try:
        return parse_site(maps[-1].text, "the recorded map"), ""
    except InputError as err:
        return None, str(err)


class _TruthSample(msgspec.Struct, frozen=True):
    stamp_ns: int
    x_m: float
    y_m: float
    height_m: float
    yaw_rad: float


def _truth_messages(path: Path) -> list[_TruthSample]:
    if not path.exists():
        return []
    try:
        return [
            msgspec.convert(entry.message, _TruthSample) for entry in read_log(path, {Topic.TRUTH}).entries
        ]
    except msgspec.ValidationError as err:
        raise InputError(f"{path}: a message on {Topic.TRUTH} is not a true pose ({err})") from None


_Seconds: TypeAlias = Callable[[Iterable[int]], Array]


def _column(values: Iterable[float]) -> Array:
    return np.fromiter(values, np.float64)


def _truth(samples: Sequence[_TruthSample], seconds: _Seconds) -> Track:
    return Track(
        seconds(sample.stamp_ns for sample in samples),
        _column(sample.x_m for sample in samples),
        _column(sample.y_m for sample in samples),
        _column(sample.height_m for sample in samples),
        _column(sample.yaw_rad for sample in samples),
    )


def _estimate(poses: Sequence[GridPose], seconds: _Seconds) -> Track:
    return Track(
        seconds(pose.stamp_ns for pose in poses),
        _column(pose.x_m for pose in poses),
        _column(pose.y_m for pose in poses),
        _column(pose.height_m for pose in poses),
        _column(pose.yaw_rad for pose in poses),
    )


def _telemetry(states: Sequence[VehicleState], seconds: _Seconds) -> Telemetry:
    return Telemetry(
        seconds(state.attitude.stamp_ns for state in states),
        _column(state.attitude.roll_rad for state in states),
        _column(state.attitude.pitch_rad for state in states),
        _column(state.height_m for state in states),
        _column(state.battery_frac for state in states),
    )


def _setpoints(setpoints: Sequence[AttitudeSetpoint], seconds: _Seconds) -> Setpoints:
    return Setpoints(
        seconds(setpoint.stamp_ns for setpoint in setpoints),
        _column(setpoint.roll_rad for setpoint in setpoints),
        _column(setpoint.pitch_rad for setpoint in setpoints),
    )


def _latency(statuses: Sequence[Status], seconds: _Seconds) -> Latency:
    """One row for each frame: a status repeats the newest frame's times until the next one comes."""
    fresh = [
        status
        for before, status in itertools.pairwise([None, *statuses])
        if status is not None and status.latency_ms and (before is None or before.frames != status.frames)
    ]
    names: dict[str, None] = {}
    for status in fresh:
        names.update(dict.fromkeys(status.latency_ms))
    stages = tuple(sorted(names, key=lambda name: name == "total"))
    rows = [[status.latency_ms.get(stage, math.nan) for stage in stages] for status in fresh]
    values = np.array(rows, np.float64).reshape(len(rows), len(stages))
    return Latency(seconds(status.stamp_ns for status in fresh), stages, values)


def _phase_spans(statuses: Sequence[Status], start_ns: int) -> Iterator[PhaseSpan]:
    runs = [list(run) for _, run in itertools.groupby(statuses, key=lambda status: status.phase)]
    for run, following in itertools.zip_longest(runs, runs[1:]):
        end = following[0] if following else run[-1]
        yield PhaseSpan(
            run[0].phase, (run[0].stamp_ns - start_ns) / NS_PER_S, (end.stamp_ns - start_ns) / NS_PER_S
        )


def _visits(
    statuses: Sequence[Status], start_ns: int, site: Site | None, estimate: Track, truth: Track | None
) -> Iterator[Visit]:
    numbers = itertools.count(1)
    for phase, grouped in itertools.groupby(statuses, key=lambda status: status.phase):
        if phase != Phase.HOVER:
            continue
        run = list(grouped)
        node = Counter(status.node for status in run).most_common(1)[0][0]
        start_s, end_s = ((status.stamp_ns - start_ns) / NS_PER_S for status in (run[0], run[-1]))
        if end_s - start_s < _SHORTEST_STOP_S:
            continue
        yield Visit(
            next(numbers),
            node,
            start_s,
            end_s,
            _error_p95_m(estimate, site, node, start_s, end_s),
            _error_p95_m(truth, site, node, start_s, end_s),
        )


def _error_p95_m(track: Track | None, site: Site | None, node: str, start_s: float, end_s: float) -> float:
    if track is None or site is None or node not in site.nodes:
        return math.nan
    inside = (track.t_s >= start_s) & (track.t_s <= end_s)
    if not inside.any():
        return math.nan
    place = site.nodes[node]
    distances = np.hypot(track.x_m[inside] - place.x_m, track.y_m[inside] - place.y_m)
    return float(np.percentile(distances, 95))
