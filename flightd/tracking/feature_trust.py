"""Whether the features that are followed lie on the floor: where lines tell the motion, they have to agree.

Most of what a down camera shows may be none of the floor: the drone's own shadow, a cable, dust on the lens,
lamps mirrored in a glossy floor.  All of that moves otherwise than the floor does, or not at all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from statistics import median

_FEWEST = 3
_KEPT_NS = 300_000_000
_FADE = 0.99
"""Of what was seen before, with each frame in which the drone moved."""
_ENOUGH_M2 = 0.002
"""Sum of squared ways, per frame: nine frames at half a metre a second."""
_LEAST, _MOST = 0.6, 1.5
"""Of the way that the lines tell."""
_STILL_M = 0.003


class FeatureTrust:
    """Call `step` with each frame."""

    def __init__(self) -> None:
        self._last: dict[int, tuple[int, tuple[float, float]]] = {}
        self._together = self._squares = 0.0

    @property
    def holds(self) -> bool:
        """Whether features lately moved as the lines did; not before that was seen."""
        return self._squares > _ENOUGH_M2 and _LEAST < self._together / self._squares < _MOST

    def step(
        self, seen: Mapping[int, tuple[float, float]], speeds_mps: Sequence[float | None], stamp_ns: int
    ) -> None:
        """Take the features' places (m, along the grid axes, from the drone) and the drone's speed along
        each axis, None where no line tells it."""
        ways: list[tuple[float, float, float]] = []
        for id_, place in seen.items():
            if id_ in self._last:
                then_ns, was = self._last[id_]
                ways.append(((stamp_ns - then_ns) * 1e-9, was[0] - place[0], was[1] - place[1]))
        if len(ways) >= _FEWEST:
            for axis, speed_mps in enumerate(speeds_mps):
                if speed_mps is not None:
                    way_m = speed_mps * median(way[0] for way in ways)
                    self._compare(way_m, median(way[1 + axis] for way in ways))
        self._last = {id_: at for id_, at in self._last.items() if stamp_ns - at[0] < _KEPT_NS}
        self._last |= {id_: (stamp_ns, place) for id_, place in seen.items()}

    def _compare(self, way_m: float, told_m: float) -> None:
        if abs(way_m) < _STILL_M:
            return
        self._together = _FADE * self._together + way_m * told_m
        self._squares = _FADE * self._squares + way_m * way_m
