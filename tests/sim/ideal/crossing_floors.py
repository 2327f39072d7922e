"""Floors for the bench of crossings: uniform grids, and their paint as it is, not as it is mapped."""

from __future__ import annotations

import itertools
import random
import string
from dataclasses import replace

from flightd.site.layout import lay_out
from flightd.site.site import Aisle, Pad, PaintedLine, Rack, Site

_APART_M = 0.15
"""A false line so near to a true one is that, smeared."""
_ROUGHLY = 1e-6


def uniform_grid(seed: int) -> Site:
    """3..5 aisles of 8..12 nodes, joined at every node: all cells alike, but for those at the rim."""
    rng = random.Random(f"grid {seed}")
    aisles, nodes = rng.randint(3, 5), rng.randint(8, 12)
    spacing_m, pitch_m = round(rng.uniform(1.2, 2.2), 2), round(rng.uniform(1.8, 3.2), 1)
    return uniform_site(nodes, aisles, range(1, nodes + 1), spacing_m, pitch_m)


def uniform_site(
    nodes: int, aisles: int, joined: range, spacing_m: float = 1.5, pitch_m: float = 3.0
) -> Site:
    """Aisles that look the same everywhere but at their ends, joined at the nodes of these numbers."""
    rows = [
        Aisle(letter, 0.0, round(pitch_m * i, 3), (spacing_m,) * (nodes - 1), shelf_distance_m=0.8)
        for i, letter in enumerate(string.ascii_uppercase[:aisles])
    ]
    crosses = [(f"{a.id}{i}", f"{b.id}{i}") for a, b in itertools.pairwise(rows) for i in joined]
    racks = [] if len(joined) == nodes else [Rack(tuple(row.id for row in rows), 1.35, (0.5,))]
    return lay_out("uniform", rows, crosses, [Pad("home", "A1", 0.5)], racks=racks)


def worn(site: Site, missing: float, false: float, rng: random.Random) -> Site:
    """The floor as it really is.  The part of each line that lies in one cell (around a node, to half the way
    to its neighbours) is gone with the probability `missing`; in each cell there are `false` lines in the
    mean, along x or y, from 0.4 m to three cells long, anywhere in it."""
    lines = [run for line in site.lines for run in _left(line, site, missing, rng)]
    for node in site.nodes.values():
        count = int(false) + (rng.random() < false % 1.0)
        size_m = [max(site.distance_m(node.id, other) for other in site.neighbours(node.id))] * 2
        for _ in range(count):
            at = [c + rng.uniform(-0.5, 0.5) * s for c, s in zip((node.x_m, node.y_m), size_m, strict=True)]
            half_m = rng.uniform(0.2, 0.6) if rng.random() < 0.5 else rng.uniform(0.5, 1.5) * size_m[0]
            axis = rng.randrange(2)
            others = [p for p in site.lines if _axis(p) == axis]
            if all(abs(at[axis] - _at(p)) > _APART_M for p in others):
                lines.append(_line(axis, at[axis], at[1 - axis] - half_m, at[1 - axis] + half_m, site))
    return replace(site, lines=tuple(lines))


def _left(line: PaintedLine, site: Site, missing: float, rng: random.Random) -> list[PaintedLine]:
    """What is left of it: the pieces that are there, joined where they meet."""
    axis, at = _axis(line), _at(line)
    from_m, to_m = sorted((line.x0_m, line.x1_m) if axis else (line.y0_m, line.y1_m))
    along = sorted(
        node.x_m if axis else node.y_m
        for node in site.nodes.values()
        if abs((node.y_m if axis else node.x_m) - at) < 0.02
        and from_m - _ROUGHLY <= (node.x_m if axis else node.y_m) <= to_m + _ROUGHLY
    )
    cuts = [from_m, *(0.5 * (a + b) for a, b in itertools.pairwise(along)), to_m]
    runs: list[list[float]] = []
    for start, end in itertools.pairwise(cuts):
        if rng.random() < missing:
            continue
        if runs and runs[-1][1] == start:
            runs[-1][1] = end
        else:
            runs.append([start, end])
    return [_line(axis, at, start, end, site) for start, end in runs]


def _axis(line: PaintedLine) -> int:
    """The axis that it crosses."""
    return 0 if line.x0_m == line.x1_m else 1


def _at(line: PaintedLine) -> float:
    return line.y0_m if _axis(line) else line.x0_m


def _line(axis: int, at: float, from_m: float, to_m: float, site: Site) -> PaintedLine:
    if axis:
        return PaintedLine(from_m, at, to_m, at, site.line_width_m)
    return PaintedLine(at, from_m, at, to_m, site.line_width_m)
