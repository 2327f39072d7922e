"""Whether the features that are followed lie on the floor: they have to move as the lines beside them do.

Most of what a down camera shows may be none of the floor: the drone's own shadow, a cable, dust on the lens,
lamps mirrored in a glossy floor.  All of that moves otherwise than the floor does, or not at all.

All is compared as angles seen from the drone.  What flies along stays where it is in the picture, however
the drone climbs; what lies on the floor moves with the line, and in a climb towards the point below.  A
camera that shakes moves both alike: so features are held against the line as it was seen, and what they lag
behind it against the way that the filter has gone, which does not shake.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Collection, Mapping
from statistics import median
from typing import NamedTuple

from flightd.tracking.held_lines import SeenLine

_FEWEST = 3
_LEAST_NS, _MOST_NS = 90_000_000, 500_000_000
"""Each frame is held against the newest one that is so old."""
_MOST_FRAMES = 64
"""Stamps may go back as the camera's delay is learnt: time alone bounds nothing."""
_FADE = 0.98
"""Of what was seen before, with each frame in which the drone moved."""
_ENOUGH_WAYS, _ENOUGH = 4, 0.0008
"""So many ways along an axis, and as much in all of squared ways, rad2."""
_LEAST, _MOST = -0.4, 0.5
"""By how much of the way features may lag behind the line, or go further."""
_LEAST_GONE, _MOST_GONE = 0.5, 2.0
"""The share of the filter's way that the line has to have gone as it was seen: else neither is one."""
_STILL_RAD = 0.01
"""Features and lines are seen to a quarter of that."""
_LOWEST_M = 0.3
"""Further down the height is not told well enough for angles."""

_Place = tuple[float, float]


class SeenFrame(NamedTuple):
    """One frame: its stamp, the height from which it was seen, m, the places of features and the lines by
    their ids, m, along the grid axes from the drone, and its speed along each axis by lines, None where none
    tells it."""

    stamp_ns: int
    height_m: float
    features: Mapping[int, _Place]
    lines: Mapping[int, SeenLine]
    speeds_mps: tuple[float | None, float | None]


class FeatureTrust:
    """Call `step` with each frame."""

    def __init__(self) -> None:
        self._frames: deque[SeenFrame] = deque(maxlen=_MOST_FRAMES)
        self._counted = 0
        self._squares = self._by_lines = self._beyond = 0.0

    @property
    def holds(self) -> bool:
        """Whether features lately moved as the lines did; not before that was seen."""
        if self._counted < _ENOUGH_WAYS or self._squares < _ENOUGH:
            return False
        moved = _LEAST_GONE < self._by_lines / self._squares < _MOST_GONE
        return moved and _LEAST < self._beyond / self._squares < _MOST

    def step(self, now: SeenFrame) -> None:
        """Take a frame."""
        frames = self._frames
        while frames and now.stamp_ns - frames[0].stamp_ns > _MOST_NS:
            frames.popleft()
        if not now.height_m > _LOWEST_M:
            return
        for then in reversed(frames):
            # one detector follows what another one does not
            known = now.features.keys() & then.features.keys()
            if now.stamp_ns - then.stamp_ns >= _LEAST_NS and len(known) >= _FEWEST:
                for axis in range(2):
                    self._compare(axis, then, now, known)
                break
        frames.append(now)

    def _compare(self, axis: int, then: SeenFrame, now: SeenFrame, known: Collection[int]) -> None:
        """Hold the way of the `known` features, as an angle, against that of the floor where they are."""
        speed_mps, way_m = now.speeds_mps[axis], _by_lines_m(axis, then, now)
        if speed_mps is None or math.isnan(way_m):
            return
        over_s = (now.stamp_ns - then.stamp_ns) * 1e-9
        was_rad = median(then.features[id_][axis] for id_ in known) / then.height_m
        is_rad = median(now.features[id_][axis] for id_ in known) / now.height_m
        climbed_rad = was_rad * (now.height_m - then.height_m) / now.height_m
        way_rad = way_m / now.height_m + climbed_rad
        gone_rad = speed_mps * over_s / now.height_m + climbed_rad
        if abs(gone_rad) < _STILL_RAD:
            return
        self._counted += 1
        self._squares = _FADE * self._squares + gone_rad**2
        self._by_lines = _FADE * self._by_lines + gone_rad * way_rad
        self._beyond = _FADE * self._beyond + gone_rad * (was_rad - is_rad - way_rad)


def _by_lines_m(axis: int, then: SeenFrame, now: SeenFrame) -> float:
    """How far the drone came across the axis by the lines in both frames, m; NaN where they do not tell."""
    ways = [
        then.lines[id_].offset_m - line.offset_m
        for id_, line in now.lines.items()
        if line.axis == axis and line.sure and id_ in then.lines
    ]
    return median(ways) if ways else math.nan
