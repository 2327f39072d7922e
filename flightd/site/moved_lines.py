"""The same site with its painted lines elsewhere: aisles move across, columns of nodes along x."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import replace

from flightd.site.layout import SAME_X_M, lay_out
from flightd.site.site import Aisle, Site


def columns(site: Site) -> tuple[tuple[str, ...], ...]:
    """The nodes by the painted lines across the aisles on which they lie: crosses join some on one line."""
    column: dict[str, tuple[str, ...]] = {node: (node,) for node in site.nodes}
    for edge in site.crosses:
        joined = tuple(sorted({*column[edge.a], *column[edge.b]}))
        column |= dict.fromkeys(joined, joined)
    # the ends of two lines can meet without a cross
    for line in (line for line in site.lines if line.x0_m == line.x1_m):
        on = [
            node.id
            for node in site.nodes.values()
            if abs(node.x_m - line.x0_m) <= SAME_X_M and line.y0_m <= node.y_m <= line.y1_m
        ]
        joined = tuple(sorted({*itertools.chain.from_iterable(column[node] for node in on)}))
        column |= dict.fromkeys(joined, joined)
    return tuple(dict.fromkeys(column[node] for node in site.nodes))


def moved(site: Site, y_m: Mapping[str, float], x_m: Mapping[str, float]) -> Site:
    """The site with those aisles at `y_m` and those nodes at `x_m`; the others stay where they are.  Shelves
    and racks go with their aisles.  LayoutError where that is no floor."""
    return lay_out(
        site.name,
        [_moved(site, aisle, y_m, x_m) for aisle in site.aisles],
        [(edge.a, edge.b) for edge in site.crosses],
        site.pads,
        line_width_m=site.line_width_m,
        line_colour=site.line_colour,
        ceiling_m=site.ceiling_m if site.ceiling_given else None,
        interlock=site.interlock,
        unattended_start=site.unattended_start,
        racks=site.racks,
        one_way_crosses=[(edge.a, edge.b) for edge in site.crosses if edge.one_way],
        blocked=site.blocked,
        keep_outs=site.keep_outs,
        markers=site.markers,
    )


def _moved(site: Site, aisle: Aisle, y_m: Mapping[str, float], x_m: Mapping[str, float]) -> Aisle:
    at = [x_m.get(node.id, node.x_m) for node in site.aisle_nodes(aisle.id)]
    # a difference's last digits are none of anybody's measurement
    steps = tuple(round(b - a, 9) for a, b in itertools.pairwise(at))
    return replace(aisle, x_m=at[0], y_m=y_m.get(aisle.id, aisle.y_m), spacing_m=steps)
