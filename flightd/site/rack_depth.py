"""How far racks reach behind their fronts, of which a site file says nothing."""

from __future__ import annotations

from flightd.site.layout import CROSS_CLEARANCE_M
from flightd.site.site import Shelf, Site
from flightd.site.ways import KeepOut

RACK_DEPTH_M = 0.9
"""From the front to the mesh at the back, where nothing is nearer."""


def rack_body(site: Site, shelf: Shelf) -> KeepOut:
    """The room of the rack behind a front, from the floor to its height: a rack that stands back to back
    with another ends at that one's front at the latest, and each leaves the lines behind it their way."""
    back_m = shelf.y_m + shelf.inward * _depth_m(site, shelf)
    y0_m, y1_m = sorted((shelf.y_m, back_m))
    return KeepOut(shelf.x0_m, y0_m, shelf.x1_m, y1_m, to_m=shelf.height_m)


def _depth_m(site: Site, shelf: Shelf) -> float:
    fronts_m = [
        _behind_m(shelf, other.y_m)
        for other in site.shelves
        if other.x0_m < shelf.x1_m and other.x1_m > shelf.x0_m
    ]
    ways_m = [
        _behind_m(shelf, line.y0_m) - CROSS_CLEARANCE_M
        for line in site.lines
        if line.y0_m == line.y1_m and line.x0_m < shelf.x1_m and line.x1_m > shelf.x0_m
        if _behind_m(shelf, line.y0_m) > 0.0
    ]
    return max(0.0, min([RACK_DEPTH_M, *ways_m, *(gap_m for gap_m in fronts_m if gap_m > 0.0)]))


def _behind_m(shelf: Shelf, y_m: float) -> float:
    """How far behind its front something is, metres; below 0 before it."""
    return (y_m - shelf.y_m) * shelf.inward
