"""Make a `RecordedFlight` of a log and of what lies beside it."""

from __future__ import annotations

import itertools
import json
import math
import tomllib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TypeAlias

import msgspec
import numpy as np

from flightd.core.errors import InputError
from flightd.core.flight_order import ChosenPlan, FlightOrder
from flightd.core.topics import FOR_PEOPLE, RETAINED, Document, Topic
from flightd.core.tracks import last_known
from flightd.core.types import (
    AT_STOP,
    AttitudeSetpoint,
    Event,
    GridPose,
    LineSet,
    Phase,
    Status,
    VehicleState,
)
from flightd.replay.log import FlightLog, read_log
from flightd.replay.playback.legs import legs_of
from flightd.replay.recorded_map import recorded_map
from flightd.replay.report.flight import (
    NS_PER_S,
    Array,
    Latency,
    PhaseSpan,
    RecordedFlight,
    Setpoints,
    Summary,
    TelemetrySeries,
    Track,
    Visit,
)
from flightd.replay.smoothed_flight import smooth
from flightd.site.site import Site

_SHORTEST_STOP_S = 0.2
"""A hover that the mission leaves at once is no stop."""


def load_flight(path: Path) -> RecordedFlight:
    """Read a log, and `truth.mcap` and `summary.json` if they lie beside it.  Raises InputError."""
    log = read_log(path, FOR_PEOPLE)
    truths = _truth_messages(path.with_name("truth.mcap"))
    statuses = log.messages(Status)
    stamps_ns = [entry.stamp_ns for entry in log.entries if entry.topic not in RETAINED]
    start_ns, end_ns = min(stamps_ns, default=0), max(stamps_ns, default=0)

    def seconds(stamps_ns: Iterable[int]) -> Array:
        return (np.fromiter(stamps_ns, np.float64) - start_ns) / NS_PER_S

    poses = log.messages(GridPose)
    estimate = _estimate(poses, seconds)
    truth = _truth(truths, seconds) if truths else None
    site, map_error = recorded_map(log.messages(Document, Topic.MAP))
    phases = tuple(_phase_spans(statuses, start_ns))
    return RecordedFlight(
        log=log,
        start_ns=start_ns,
        duration_s=max(0.0, (end_ns - start_ns) / NS_PER_S),
        site=site,
        map_error=map_error,
        phases=phases,
        start=next((status.node for status in statuses if status.node), ""),
        legs=legs_of(site, (((status.stamp_ns - start_ns) / NS_PER_S, status.goal) for status in statuses)),
        visits=tuple(_visits(statuses, start_ns, site, estimate, truth)),
        estimate=estimate,
        truth=truth,
        smoothed=_smoothed(poses, estimate, seconds),
        telemetry=_telemetry(log.messages(VehicleState), seconds),
        setpoints=_setpoints(log.messages(AttitudeSetpoint), seconds),
        latency=_latency(statuses, seconds),
        events=tuple(log.messages(Event)),
        last_status=statuses[-1] if statuses else None,
        sensors=last_known([status.sensors for status in statuses]),
        line_sets={lines.frame_seq: lines for lines in log.messages(LineSet)},
        config="\n".join(document.text for document in log.messages(Document, Topic.CONFIG)),
        nodes=_ordered_nodes(log),
        summary=_summary(path.with_name("summary.json")),
    )


def _summary(path: Path) -> Summary:
    try:
        summary = msgspec.json.decode(path.read_bytes(), type=dict[str, object])
    except FileNotFoundError:
        return {}
    except (OSError, msgspec.DecodeError) as err:
        raise InputError(f"{path}: not a readable summary ({err}); repair or remove it") from None
    return summary


def _ordered_nodes(log: FlightLog) -> frozenset[str]:
    """The nodes that the flight was to visit, empty where that is all of them or nobody knows.  A log without
    an order is of a time when the configuration was recorded with the order laid over it."""
    if (plans := log.messages(ChosenPlan)) and plans[-1].nodes:
        return frozenset(plans[-1].nodes)
    if orders := log.messages(FlightOrder):
        return frozenset(orders[-1].nodes)
    for document in reversed(log.messages(Document, Topic.CONFIG)):
        with suppress(ValueError):  # a configuration that cannot be read orders nothing
            is_json = document.text.lstrip().startswith("{")
            table = json.loads(document.text) if is_json else tomllib.loads(document.text)
            mission = table.get("mission") if isinstance(table, dict) else None
            nodes = mission.get("nodes") if isinstance(mission, dict) else None
            return frozenset(map(str, nodes)) if isinstance(nodes, list) else frozenset()
    return frozenset()


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


def _smoothed(poses: Sequence[GridPose], estimate: Track, seconds: _Seconds) -> Track:
    """The estimate with the positions that the whole flight speaks for."""
    if not poses:
        return estimate
    found = smooth(poses)
    t_s = seconds(found.stamp_ns)
    height_m, yaw_rad = (np.interp(t_s, estimate.t_s, of) for of in (estimate.height_m, estimate.yaw_rad))
    return Track(t_s, found.x_m, found.y_m, height_m, yaw_rad)


def _telemetry(states: Sequence[VehicleState], seconds: _Seconds) -> TelemetrySeries:
    return TelemetrySeries(
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
    """The stops: a hover, and the scan of the shelves there with all its views."""
    numbers = itertools.count(1)
    for stops, grouped in itertools.groupby(statuses, key=lambda status: status.phase in AT_STOP):
        run = list(grouped)
        seconds = [(status.stamp_ns - start_ns) / NS_PER_S for status in run]
        if not stops or seconds[-1] - seconds[0] < _SHORTEST_STOP_S:
            continue
        node = Counter(status.node for status in run).most_common(1)[0][0]
        hovers = [t_s for t_s, status in zip(seconds, run, strict=True) if status.phase == Phase.HOVER]
        yield Visit(
            next(numbers),
            node,
            seconds[0],
            seconds[-1],
            _error_p95_m(estimate, site, node, hovers),
            _error_p95_m(truth, site, node, hovers),
        )


def _error_p95_m(track: Track | None, site: Site | None, node: str, hovers_s: Sequence[float]) -> float:
    """How far from the node the drone was at these times, while it hovered over it; NaN where not known."""
    if track is None or site is None or node not in site.nodes or not hovers_s or not len(track.t_s):
        return math.nan
    place = site.nodes[node]
    x_m, y_m = (np.interp(hovers_s, track.t_s, values) for values in (track.x_m, track.y_m))
    return float(np.percentile(np.hypot(x_m - place.x_m, y_m - place.y_m), 95))
