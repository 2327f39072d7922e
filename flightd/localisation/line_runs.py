"""How much of each line, and of the floor beside it, has come into view: paint that the map has goes on, any
other soon ends; and of two close beside each other the farther one shows later."""

from __future__ import annotations

import math
from collections.abc import Sequence

from flightd.core.tracks import TrackedLine

SEEN_NS = 200_000_000
"""A line seen so lately is in view where its track says."""
_LEAP_M = 0.5
"""What is in view does not grow by more at once: the place was corrected, or the line was refound."""
_MOST_M = 6.0
"""A line that goes on further tells nothing more: halls that are not on the map have such, too."""
BESIDE_M = 0.3
"""Lines so close are taken for each other."""


class LineRuns:
    """Follows the tracks across one axis."""

    def __init__(self) -> None:
        self._runs_m: dict[int, tuple[float, float, float]] = {}

    def grown_m(self, tracks: Sequence[TrackedLine], along_m: float, now_ns: int) -> dict[int, float]:
        """By how much the part of each line that was ever in view has grown, for those that have; `along_m`
        is where the drone is along them."""
        grown: dict[int, float] = {}
        runs, self._runs_m = self._runs_m, {}
        for track in tracks:
            known = runs.get(track.id)
            if now_ns - track.seen_ns < SEEN_NS and track.to_m > track.from_m:
                low_m, high_m, told_m = along_m + track.from_m, along_m + track.to_m, 0.0
                if known is not None:
                    told_m = known[2]
                    more_m = max(known[0] - low_m, 0.0) + max(high_m - known[1], 0.0)
                    if more_m <= _LEAP_M:
                        low_m, high_m = min(low_m, known[0]), max(high_m, known[1])
                        if (more_m := min(more_m, _MOST_M - told_m)) > 0.0:
                            grown[track.id] = more_m
                            told_m += more_m
                known = low_m, high_m, told_m
            if known is not None:
                self._runs_m[track.id] = known
        return grown


class Approached:
    """Which tracks across one axis the drone came nearer to by as much as lines are taken for each other, or
    had below it: what lies so close beyond them has come into view."""

    def __init__(self) -> None:
        self._far_m: dict[int, float] = {}

    def has(self, track: int) -> bool:
        return self._far_m.get(track) == math.inf

    def step(self, tracks: Sequence[TrackedLine], below_m: float) -> None:
        """Now they are there; those within `below_m` are below the drone."""
        before, self._far_m = self._far_m, {}
        for track in tracks:
            away_m = abs(track.offset_m)
            far_m = max(before.get(track.id, 0.0), away_m)
            near = away_m < below_m or far_m - away_m > BESIDE_M
            self._far_m[track.id] = math.inf if near else far_m
