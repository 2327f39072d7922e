"""How much of each line has come into view: paint that the map has goes on, any other soon ends."""

from __future__ import annotations

from collections.abc import Sequence

from flightd.core.tracks import TrackedLine

_SEEN_NS = 200_000_000
"""A line seen so lately is in view where its track says."""
_LEAP_M = 0.5
"""What is in view does not grow by more at once: the place was corrected, or the line was refound."""


class LineRuns:
    """Follows the tracks across one axis."""

    def __init__(self) -> None:
        self._runs_m: dict[int, tuple[float, float]] = {}

    def grown_m(self, tracks: Sequence[TrackedLine], along_m: float, now_ns: int) -> dict[int, float]:
        """By how much the part of each line that was ever in view has grown, for those that have; `along_m`
        is where the drone is along them."""
        grown: dict[int, float] = {}
        runs, self._runs_m = self._runs_m, {}
        for track in tracks:
            known = runs.get(track.id)
            if now_ns - track.seen_ns < _SEEN_NS and track.to_m > track.from_m:
                low_m, high_m = along_m + track.from_m, along_m + track.to_m
                if known is not None:
                    more_m = max(known[0] - low_m, 0.0) + max(high_m - known[1], 0.0)
                    if more_m > _LEAP_M:
                        known = None
                    else:
                        low_m, high_m = min(low_m, known[0]), max(high_m, known[1])
                        if more_m > 0.0:
                            grown[track.id] = more_m
                known = low_m, high_m
            if known is not None:
                self._runs_m[track.id] = known
        return grown
