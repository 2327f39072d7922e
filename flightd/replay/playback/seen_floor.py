"""The painted lines that the drone saw, from what each tick decided by."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import msgspec

from flightd.core.topics import Topic
from flightd.replay.log_chunks import LogChunks
from flightd.replay.playback.flight import SeenFloor, Segment

_APART_S = 0.2
_MOST = 3000
_FRESH_NS = 400_000_000
"""A line that was not seen for longer is followed in the mind only."""
_UNKNOWN_HALF_M = 0.4
"""Drawn to both sides where it is not known how far a line was in view."""


class _Line(msgspec.Struct):
    offset_m: float
    seen_ns: int
    from_m: float = 0.0
    to_m: float = 0.0


class _Tracks(msgspec.Struct):
    stamp_ns: int
    across_x: list[_Line]
    across_y: list[_Line]


class _Pose(msgspec.Struct):
    x_m: float
    y_m: float


class _Decision(msgspec.Struct):
    tracks: _Tracks | None = None
    pose: _Pose | None = None


def seen_floor(path: Path, start_ns: int, duration_s: float) -> tuple[SeenFloor, ...]:
    """What was seen, five times a second at most; nothing where the log keeps no decisions."""
    apart_ns = int(max(_APART_S, duration_s / _MOST) * 1e9)
    found: list[SeenFloor] = []
    due_ns = start_ns
    decoder = msgspec.json.Decoder(_Decision)
    with LogChunks(path) as log:
        for message in log.messages(log.chunks, {Topic.DECISION}):
            if message.stamp_ns < due_ns or len(found) > _MOST:
                continue
            due_ns = message.stamp_ns + apart_ns
            try:
                decision = decoder.decode(message.payload)
            except msgspec.MsgspecError:  # numbers that are none, or of another version
                continue
            if decision.tracks is not None and decision.pose is not None:
                lines = _segments(decision.pose, decision.tracks)
                found.append(SeenFloor((message.stamp_ns - start_ns) * 1e-9, lines))
    return tuple(found)


def _segments(pose: _Pose, tracks: _Tracks) -> tuple[Segment, ...]:
    def fresh(lines: Sequence[_Line]) -> list[_Line]:
        return [line for line in lines if tracks.stamp_ns - line.seen_ns < _FRESH_NS]

    along = ((*_span(pose.x_m, line), pose.y_m + line.offset_m) for line in fresh(tracks.across_y))
    across = ((*_span(pose.y_m, line), pose.x_m + line.offset_m) for line in fresh(tracks.across_x))
    return (*((x0, y, x1, y) for x0, x1, y in along), *((x, y0, x, y1) for y0, y1, x in across))


def _span(at_m: float, line: _Line) -> tuple[float, float]:
    if line.to_m > line.from_m:
        return at_m + line.from_m, at_m + line.to_m
    return at_m - _UNKNOWN_HALF_M, at_m + _UNKNOWN_HALF_M
