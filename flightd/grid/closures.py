"""What is wrong with a site's one-way and blocked lines, keep-outs and pads: checks for the layout."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from flightd.grid.site import Site


def mistakes(site: Site) -> Iterator[tuple[str, str]]:
    """(key, problem) of each mistake, in the words of the site file."""
    yield from _blocked(site)
    yield from _keep_outs(site)
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
        elif area.to_m <= area.from_m or area.from_m >= site.ceiling_m:
            yield (
                f"{key}.from_m",
                f"{area.from_m:g} m is not below to_m and the ceiling ({site.ceiling_m:g} m)",
            )
        elif area.touches(home.x_m, home.y_m, home.x_m, home.y_m):
            yield key, f"covers {home.id}, where missions start; move it or the home pad"
