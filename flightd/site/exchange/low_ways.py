"""Ways that are open below a height only: a ceiling where all share it, small keep-outs over the others."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import Any, Final

from flightd.site.exchange.listed import listed
from flightd.site.site import Edge, Site
from flightd.site.ways import KEEP_OUT_CLEARANCE_M, KEEP_OUT_HEIGHT_M

_HALF_M: Final = 0.01
"""Of the keep-out in the middle of a low way: its clearance reaches no other line."""
_HIGHEST_M: Final = 100.0


def open_below_m(site: Site, edge: Edge) -> float | None:
    """The height below which a line of a site is open: its ceiling (infinite without one) or what keeps
    clear of the keep-outs over it.  None: closed, from the floor up."""
    if any({edge.a, edge.b} == {*pair} for pair in site.blocked):
        return None
    a, b = site.nodes[edge.a], site.nodes[edge.b]
    over = [area.from_m for area in site.keep_outs if area.touches(a.x_m, a.y_m, b.x_m, b.y_m)]
    below_m = round(min(over, default=math.inf) - KEEP_OUT_HEIGHT_M, 6)
    if below_m <= 0.0:
        return None
    return min(below_m, site.ceiling_m if site.ceiling_given else math.inf)


def low_way_tables(
    nodes: Mapping[str, tuple[float, float]],
    ways: Collection[tuple[str, str]],
    below_m: Mapping[tuple[str, str], float],
    renamed: Mapping[str, str],
    notes: list[str],
) -> tuple[float | None, list[dict[str, Any]], list[tuple[str, str]]]:
    """The ceiling that heights of ways tell, None where not every way has one, a keep-out for each way that
    is lower, and those lower ones that are too short for one: nothing may fly there at any height."""
    pairs = dict.fromkeys(tuple(sorted(way)) for way in ways if way[0] in renamed and way[1] in renamed)
    low: dict[tuple[str, str], float] = {}
    for a, b in pairs:
        both = [below_m[way] for way in ((a, b), (b, a)) if way in below_m]
        if both:
            low[a, b] = min(both)
            if len(set(both)) > 1:
                notes.append(f"{renamed[a]} to {renamed[b]} has two heights; the lower one is taken")
    ceiling_m = max(low.values()) if low and len(low) == len(pairs) else None
    tables, lost, short = [], [], []
    for (a, b), height_m in low.items():
        if height_m == ceiling_m:
            continue
        from_m = round(height_m + KEEP_OUT_HEIGHT_M, 6)
        (ax, ay), (bx, by) = nodes[a], nodes[b]
        room = math.dist((ax, ay), (bx, by)) / 2 - _HALF_M > KEEP_OUT_CLEARANCE_M
        if from_m >= min(ceiling_m or _HIGHEST_M, _HIGHEST_M):
            lost.append((renamed[a], renamed[b], height_m))
            continue
        if not room or height_m <= 0.0:
            short.append((renamed[a], renamed[b]))
            continue
        x_m, y_m = (ax + bx) / 2, (ay + by) / 2
        tables.append(
            {
                "x0_m": round(x_m - _HALF_M, 6),
                "y0_m": round(y_m - _HALF_M, 6),
                "x1_m": round(x_m + _HALF_M, 6),
                "y1_m": round(y_m + _HALF_M, 6),
                "from_m": from_m,
            }
        )
    if lost:
        ways_lost = [f"{a} to {b} ({height_m:g} m)" for a, b, height_m in lost]
        notes.append(f"heights that no keep-out can hold, left out: {listed(ways_lost)}")
    if short:
        closed = [f"{a} to {b}" for a, b in short]
        notes.append(f"too low, or too short for a keep-out of their heights, closed: {listed(closed)}")
    return ceiling_m, tables, short
