"""Where a drone that does not know its place may safely fly to learn more."""

from __future__ import annotations

import math

import numpy as np

from flightd.core.geometry import Matrix
from flightd.site.painted_lines import ARM_DIRECTIONS, Features, PaintMap
from flightd.site.site import Site

_OFF_LINE_M = 0.25
_STEP_M = 0.2
_LOOK_M = 1.0
"""What lies further than this from the place arrived at is not compared."""
_DIFFERENT_M = 0.15


class Reach:
    """Ways along open lines that are open whichever of several places is the true one."""

    def __init__(self, site: Site, paint: PaintMap) -> None:
        open_edges = [edge for edge in site.edges if not site.is_closed(edge)]
        ends = [(site.nodes[edge.a], site.nodes[edge.b]) for edge in open_edges]
        self._from: Matrix = np.array([(a.x_m, a.y_m) for a, _ in ends], dtype=float).reshape(-1, 2)
        self._way: Matrix = np.array([(b.x_m - a.x_m, b.y_m - a.y_m) for a, b in ends], dtype=float)
        self._site = site
        self._paint = paint

    def way_out(
        self, node: str, at_m: Matrix, last_m: tuple[float, float] | None
    ) -> tuple[float, float] | None:
        """The move (dx, dy) to a neighbour of `node`, the likeliest, that stays on open lines at all places
        `at_m` (K, 2; the likeliest first) and leads to where they differ most; going on as in `last_m` when
        none tells more.  None when no such way is safe."""
        best: tuple[float, float, tuple[float, float]] | None = None
        for other in self._site.neighbours(node):
            there = self._site.nodes[other]
            move = there.x_m - float(at_m[0, 0]), there.y_m - float(at_m[0, 1])
            if not all(self._open(place, move) for place in at_m):
                continue
            news = self._differences(at_m + move)
            onward = 0.0 if last_m is None else _cosine(move, last_m)
            if best is None or (news, onward) > best[:2]:
                best = news, onward, move
        return None if best is None else best[2]

    def _open(self, place: Matrix, move: tuple[float, float]) -> bool:
        steps = max(math.ceil(math.hypot(*move) / _STEP_M), 1)
        points = place + np.linspace(0.0, 1.0, steps + 1)[:, None] * np.array(move)
        offset = points[:, None, :] - self._from
        length2 = np.square(self._way).sum(axis=1)
        share = np.clip((offset * self._way).sum(axis=2) / length2, 0.0, 1.0)
        apart = np.hypot(*np.moveaxis(offset - share[:, :, None] * self._way, 2, 0))
        return bool((apart.min(axis=1, initial=math.inf) < _OFF_LINE_M).all())

    def _differences(self, at_m: Matrix) -> float:
        """How many of the places look otherwise than the first."""
        looks = [self._look(place) for place in at_m]
        return float(
            sum(
                arms != looks[0][1] or float(np.abs(seen - looks[0][0]).max()) > _DIFFERENT_M
                for seen, arms in looks[1:]
            )
        )

    def _look(self, place: Matrix) -> tuple[Matrix, int]:
        """Offsets to the nearest crossing and to the nearest line end on each side, and the arms."""
        crossing, arms = _nearest(self._paint.crossings, place)
        ends = [_nearest(_facing(self._paint.ends, bit), place)[0] for bit in range(len(ARM_DIRECTIONS))]
        return np.concatenate([crossing, *ends]), arms


def _nearest(features: Features, place: Matrix) -> tuple[Matrix, int]:
    far = np.full(2, _LOOK_M)
    if not len(features.at_m):
        return far, 0
    offset = features.at_m - place
    index = int(np.abs(offset).max(axis=1).argmin())
    if np.abs(offset[index]).max() > _LOOK_M:
        return far, 0
    return offset[index], int(features.arms[index])


def _facing(features: Features, bit: int) -> Features:
    mine = features.arms == 1 << bit
    return Features(features.at_m[mine], features.arms[mine], features.axis[mine], features.line[mine])


def _cosine(a: tuple[float, float], b: tuple[float, float]) -> float:
    return (a[0] * b[0] + a[1] * b[1]) / max(math.hypot(*a) * math.hypot(*b), 1e-9)
