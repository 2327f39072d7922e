"""Things of known place that the drone sees, each told once: floor markers, pads' mats and shelf labels.

A marker that lies wrong lies wrong in every frame, so that only its first sight says anything; it may speak
again when the drone has been away.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np

from flightd.core.geometry import Matrix
from flightd.core.tracks import MarkerOffset, PadOffset
from flightd.site.site import Marker, PadSign, Site

_AWAY_M = 2.0
_FRAMES = 3
"""A marker is believed after so many frames."""
_SIZE_SHARE = 0.3
_SAME_MAT_M = 0.3
"""A mat that seems to have moved further from frame to frame is another one."""


class FixBook:
    """What has spoken already; points are those of the place believed in."""

    def __init__(self, site: Site) -> None:
        self._markers = {marker.id: marker for marker in site.markers}
        self._mats = [(*site.pad_centre(pad), pad.size_m) for pad in site.pads if pad.sign is PadSign.MAT]
        self._frames: Counter[int] = Counter()
        self._mat_frames = 0
        self._mat_at = (math.inf, math.inf)
        self._told: dict[str, tuple[float, float]] = {}

    def shift(self, dx_m: float, dy_m: float) -> None:
        """The place believed in is another now."""
        self._told = {key: (x + dx_m, y + dy_m) for key, (x, y) in self._told.items()}
        self._mat_at = self._mat_at[0] + dx_m, self._mat_at[1] + dy_m

    def is_new(self, key: str, x_m: float, y_m: float) -> bool:
        """Whether this thing, seen by a drone at (`x_m`, `y_m`), has not spoken here yet; it has now."""
        self._told = {
            told: at for told, at in self._told.items() if math.hypot(at[0] - x_m, at[1] - y_m) < _AWAY_M
        }
        if key in self._told:
            return False
        self._told[key] = (x_m, y_m)
        return True

    def markers(
        self, seen: Sequence[MarkerOffset], x_m: float, y_m: float
    ) -> list[tuple[Marker, MarkerOffset]]:
        """Take one frame's markers; those of the map that have become sure with it."""
        sure = []
        for sight in seen:
            marker = self._markers.get(sight.id)
            if marker is None or abs(sight.side_m - marker.size_m) > _SIZE_SHARE * marker.size_m:
                continue
            self._frames[sight.id] += 1
            if self._frames[sight.id] >= _FRAMES and self.is_new(f"marker {sight.id}", x_m, y_m):
                self._frames[sight.id] = 0
                sure.append((marker, sight))
        return sure

    def mat(self, seen: Sequence[PadOffset], x_m: float, y_m: float) -> tuple[PadOffset, Matrix] | None:
        """Take one frame's mats; the one that has become sure with it, and where the map has those (M, 2) of
        its size.  They look alike: it tells that the drone is at one of them, not at which."""
        known = [(sight, mats_m) for sight in seen if len(mats_m := self._mats_like(sight))]
        if not known:
            self._mat_frames = 0
            return None
        last_x, last_y = self._mat_at
        moved_m = [math.hypot(x_m + sight.x_m - last_x, y_m + sight.y_m - last_y) for sight, _ in known]
        least_m = min(moved_m)
        sight, mats_m = known[moved_m.index(least_m)]
        self._mat_at = x_m + sight.x_m, y_m + sight.y_m
        self._mat_frames = self._mat_frames + 1 if least_m < _SAME_MAT_M else 1
        if self._mat_frames < _FRAMES or not self.is_new("mat", x_m, y_m):
            return None
        self._mat_frames = 0
        return sight, mats_m

    def _mats_like(self, sight: PadOffset) -> Matrix:
        fits = [(x, y) for x, y, side_m in self._mats if abs(sight.side_m - side_m) <= _SIZE_SHARE * side_m]
        return np.array(fits, dtype=np.float64).reshape(-1, 2)
