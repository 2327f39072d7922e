"""Lines that are seen beside each other, in the same frames: two of them are never one line of the map, and
one that keeps its distance from one of the map moves as the floor does, whether or not the map has it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations

from flightd.core.tracks import TrackedLine

_FRAMES = 10
"""In so many frames both have to be seen."""
_LEAST_M, _MOST_M = 0.06, 0.6
"""From middle to middle: nearer they may be one band that was told as two, further nobody confuses them."""
_STEADY_M = 0.03
"""A distance that changes by more is none of two lines on the floor."""


@dataclass(slots=True)
class _Pair:
    apart_m: float
    frames: int = 0


class SeenBeside:
    """Follows the tracks across one axis."""

    def __init__(self) -> None:
        self._pairs: dict[tuple[int, int], _Pair] = {}
        self._floor: set[int] = set()
        self._newest_ns = 0

    def step(self, tracks: Sequence[TrackedLine], is_known: Callable[[int], bool]) -> None:
        """Take the tracks as they are held now; those that were seen last are those of one frame.  `is_known`
        tells by its id whether one is a line of the map: two mirrored lamps keep their distance, too."""
        newest_ns = max((track.seen_ns for track in tracks), default=0)
        if newest_ns <= self._newest_ns:
            return
        self._newest_ns = newest_ns
        held = {track.id for track in tracks}
        self._floor &= held
        self._pairs = {ids: pair for ids, pair in self._pairs.items() if held.issuperset(ids)}
        seen = sorted((track for track in tracks if track.seen_ns == newest_ns), key=lambda track: track.id)
        for one, other in combinations(seen, 2):
            apart_m = other.offset_m - one.offset_m
            if not _LEAST_M < abs(apart_m) < _MOST_M:
                continue
            pair = self._pairs.setdefault((one.id, other.id), _Pair(apart_m))
            if abs(apart_m - pair.apart_m) > _STEADY_M:
                pair.apart_m, pair.frames = apart_m, 0
                self._floor.difference_update((one.id, other.id))
            pair.frames += 1
            if pair.frames >= _FRAMES and (is_known(one.id) or is_known(other.id)):
                self._floor.update((one.id, other.id))

    def pairs(self) -> list[tuple[int, int]]:
        """The ids of the tracks that are surely two lines."""
        return [ids for ids, pair in self._pairs.items() if pair.frames >= _FRAMES]

    def told_ns(self, tracks: Sequence[TrackedLine]) -> int:
        """When one that moves as the floor does was seen last; 0 where there is none."""
        return max((track.seen_ns for track in tracks if track.id in self._floor), default=0)
