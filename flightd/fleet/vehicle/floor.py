"""What orders may ask of a drone's floor: its nodes, the open ways between them, its shelves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from flightd.site.site import Side, Site


@dataclass(frozen=True, slots=True)
class Floor:
    """`ways` are the open ones in the directions in which they are; `shelves` the sides on which a node has
    one."""

    map_id: str
    nodes: frozenset[str]
    ways: frozenset[tuple[str, str]]
    shelves: Mapping[str, frozenset[Side]]


def floor_of(site: Site) -> Floor:
    """The floor of a site; its map is called as the site is, as in the site's LIF."""
    ways = set()
    for edge in site.edges:
        if not site.is_closed(edge):
            ways.add((edge.a, edge.b))
            if not edge.one_way:
                ways.add((edge.b, edge.a))
    sides = {aisle.id: frozenset(aisle.shelves) for aisle in site.aisles}
    shelves = {node.id: sides[node.aisle] for node in site.nodes.values()}
    return Floor(site.name, frozenset(site.nodes), frozenset(ways), shelves)
