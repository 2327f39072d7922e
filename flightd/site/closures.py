"""What is wrong with a site's one-way and blocked lines, keep-outs, pads, markers: checks for the layout."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from flightd.site.painted_lines import nearest_end
from flightd.site.site import PAD_REACH_M, Marker, PadSign, PaintedLine, Site
from flightd.site.ways import KEEP_OUT_CLEARANCE_M


def mistakes(site: Site) -> Iterator[tuple[str, str]]:
    """(key, problem) of each mistake, in the words of the site file."""
    yield from _blocked(site)
    yield from _keep_outs(site)
    yield from _markers(site)
    trapped = replace(site, blocked=(), keep_outs=()).cut_off
    if trapped:
        node = next(node for node in site.nodes if node in trapped)
        aisles = [f"aisle[{i}] ({aisle.id})" for i, aisle in enumerate(site.aisles) if aisle.one_way]
        key = f"{aisles[0]}.one_way" if aisles else "cross.one_way"
        yield key, f"no legal way leads from {site.home.node} to {node} and back; open a way round"
    for i, pad in enumerate(site.pads):
        if pad.node in site.cut_off:
            key = f"pad[{i}] ({pad.id}).node"
            yield (
                key,
                f"{pad.node} is cut off from {site.home.node} by [[blocked]] or [[keep_out]]; open a way",
            )
        if pad.sign is PadSign.LINE_END and nearest_end(site, *site.pad_centre(pad), PAD_REACH_M) is None:
            yield (
                f"pad[{i}] ({pad.id}).sign",
                f'no painted line ends within {PAD_REACH_M} m of the pad; set offset_m, or sign = "mat"',
            )


def _blocked(site: Site) -> Iterator[tuple[str, str]]:
    for i, (a, b) in enumerate(site.blocked):
        key = f"blocked[{i}].nodes"
        for node in (a, b):
            if node not in site.nodes:
                yield key, f"there is no node {node}; nodes are called aisle + number, as in A1"
                return
        if b not in site.neighbours(a):
            near = ", ".join(site.neighbours(a))
            yield key, f"no painted line joins {a} and {b}; {a} is joined to {near}"


def _keep_outs(site: Site) -> Iterator[tuple[str, str]]:
    home = site.nodes[site.home.node]
    for i, area in enumerate(site.keep_outs):
        key = f"keep_out[{i}]"
        if area.x1_m <= area.x0_m or area.y1_m <= area.y0_m:
            yield key, "is empty; x0_m < x1_m and y0_m < y1_m are required"
        elif area.to_m <= area.from_m or (site.ceiling_given and area.from_m >= site.ceiling_m):
            yield (
                f"{key}.from_m",
                f"{area.from_m:g} m is not below to_m and the ceiling ({site.ceiling_m:g} m)",
            )
        elif area.touches(home.x_m, home.y_m, home.x_m, home.y_m):
            yield (
                key,
                f"covers {home.id}, where missions start, or comes within {KEEP_OUT_CLEARANCE_M:g} m of it;"
                " move it or the home pad",
            )


def _markers(site: Site) -> Iterator[tuple[str, str]]:
    seen: set[int] = set()
    for i, marker in enumerate(site.markers):
        key, kind = f"marker[{i}] ({marker.id})", marker.dictionary
        if kind is not site.markers[0].dictionary:
            yield f"{key}.dictionary", f"{kind} beside {site.markers[0].dictionary}; a site has only one"
        elif marker.id >= kind.numbers:
            yield f"{key}.id", f"{kind} has no number {marker.id}; take one of 0 to {kind.numbers - 1}"
        elif marker.id in seen:
            yield f"{key}.id", f"{marker.id} lies elsewhere already; every number once"
        elif any(_touch(marker, line) for line in site.lines):
            yield key, "lies on a painted line, which would hide it; move it beside"
        seen.add(marker.id)


def _touch(marker: Marker, line: PaintedLine) -> bool:
    """Whether a line runs through the marker or the pale rim that it needs, a module wide."""
    turned = abs(math.cos(marker.yaw_rad)) + abs(math.sin(marker.yaw_rad))
    half = marker.size_m * (0.5 + 1.0 / marker.dictionary.modules) * turned + line.width_m / 2
    clear_x = max(line.x0_m, line.x1_m) < marker.x_m - half or min(line.x0_m, line.x1_m) > marker.x_m + half
    clear_y = max(line.y0_m, line.y1_m) < marker.y_m - half or min(line.y0_m, line.y1_m) > marker.y_m + half
    return not (clear_x or clear_y)
