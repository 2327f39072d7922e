"""A site in numbers."""

from __future__ import annotations

import math
from typing import Any

from flightd.site.site import Site


def site_facts(site: Site) -> dict[str, Any]:
    """Counts of what a site holds, its size in metres, and how long its paint and its whole route are."""
    x0, y0, x1, y1 = site.bounds()
    route = site.serpentine_route()
    return {
        "name": site.name,
        "aisles": len(site.aisles),
        "nodes": len(site.nodes),
        "crosses": len(site.crosses),
        "one_way": sum(edge.one_way for edge in site.edges),
        "closed": sum(map(site.is_closed, site.edges)),
        "keep_outs": len(site.keep_outs),
        "cut_off": [node for node in site.nodes if node in site.cut_off],
        "pads": len(site.pads),
        "locations": len(site.locations),
        "length_m": round(x1 - x0, 2),
        "width_m": round(y1 - y0, 2),
        "paint_m": round(math.fsum(abs(p.x1_m - p.x0_m) + abs(p.y1_m - p.y0_m) for p in site.lines), 1),
        "route_m": round(site.length_m(route), 1),
    }
