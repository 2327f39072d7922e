"""Junctions seen from many frames, gathered to landmarks on the floor and told once each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from flightd.core.tracks import FloorJunction

_SAME_M = 0.2
_FRAMES = 6
"""A landmark's arms are told after so many frames, by majority."""
_STALE = 30
"""Frames without a sight after which one that was never told is forgotten."""


@dataclass(slots=True)
class Landmark:
    """A junction at a map point under the place believed in; `votes` counts each arm's sights."""

    x_m: float
    y_m: float
    votes: list[int]
    frames: int
    last: int
    told: bool = False

    @property
    def arms(self) -> int:
        """The arms that most frames saw."""
        return sum(1 << bit for bit, votes in enumerate(self.votes) if 2 * votes > self.frames)


class LandmarkBook:
    """Feed `frame`; it gives the landmarks that have become sure with it."""

    def __init__(self) -> None:
        self._marks: list[Landmark] = []
        self._frame = 0

    @property
    def marks(self) -> Sequence[Landmark]:
        return self._marks

    def shift(self, dx_m: float, dy_m: float) -> None:
        """The place believed in is another now: so is where everything was seen."""
        for mark in self._marks:
            mark.x_m += dx_m
            mark.y_m += dy_m

    def frame(
        self, seen: Sequence[FloorJunction], x_m: float, y_m: float, sure_m: float, leave_m: float
    ) -> list[Landmark]:
        """Take one frame's junctions within `sure_m` of a drone believed at (`x_m`, `y_m`); forget what is
        more than `leave_m` away."""
        self._frame += 1
        self._marks = [
            mark
            for mark in self._marks
            if max(abs(mark.x_m - x_m), abs(mark.y_m - y_m)) < leave_m
            and (mark.told or self._frame - mark.last < _STALE)
        ]
        for junction in seen:
            if max(abs(junction.dx_m), abs(junction.dy_m)) < sure_m:
                self._add(junction, x_m + junction.dx_m, y_m + junction.dy_m)
        sure = [mark for mark in self._marks if not mark.told and mark.frames >= _FRAMES and mark.arms]
        for mark in sure:
            mark.told = True
        return sure

    def _add(self, junction: FloorJunction, x_m: float, y_m: float) -> None:
        mark = min(
            self._marks, key=lambda m: math.hypot(m.x_m - x_m, m.y_m - y_m), default=None
        )  # few are in view
        if mark is None or math.hypot(mark.x_m - x_m, mark.y_m - y_m) > _SAME_M:
            mark = Landmark(x_m, y_m, [0, 0, 0, 0], 0, self._frame)
            self._marks.append(mark)
        mark.x_m += 0.3 * (x_m - mark.x_m)
        mark.y_m += 0.3 * (y_m - mark.y_m)
        mark.last = self._frame
        mark.frames += 1
        for bit in range(4):
            mark.votes[bit] += junction.arms >> bit & 1
