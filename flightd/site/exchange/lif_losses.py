"""What of a site a LIF file does not hold: the file is read again and held against the site."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import fields
from typing import Any, Final

from flightd.core.errors import InputError
from flightd.site.exchange.lif import lif_document, tables_of_lif
from flightd.site.exchange.listed import listed
from flightd.site.site import Location, Site
from flightd.site.site_tables import SiteTablesError, site_of

_SAME: Final = 1e-4
"""Metres by which the numbers of a LIF may differ from those of the site."""
_OF_SITE: Final = (
    "name", "line_width_m", "line_colour", "ceiling_m", "ceiling_given", "interlock", "unattended_start",
)  # fmt: skip


def lif_losses(site: Site) -> tuple[str, ...]:
    """A line for each kind of thing that the site would not get back from its own LIF file."""
    try:
        again = site_of(tables_of_lif(lif_document(site, "")).tables)
    except (InputError, SiteTablesError) as err:
        return (f"the file makes no sound site again: {err}",)
    return tuple(f"LIF does not hold {what}" for what in _lost(site, again))


def _lost(site: Site, again: Site) -> Iterator[str]:
    for key in _OF_SITE:
        if not _same(getattr(site, key), getattr(again, key)):
            yield f"site.{key}"
    yield from _fields_lost("aisle", _by_id(site.aisles), _by_id(again.aisles))
    ways = ({(edge.a, edge.b, edge.one_way) for edge in one.crosses} for one in (site, again))
    yield from _named("cross", [f"{a} to {b}" for a, b, _ in sorted(next(ways) - next(ways))])
    closed = [{frozenset(pair) for pair in one.blocked} for one in (site, again)]
    yield from _named(
        "blocked", [" to ".join(sorted(pair)) for pair in sorted(closed[0] - closed[1], key=sorted)]
    )
    areas = [area for area in site.keep_outs if area not in again.keep_outs]
    yield from _named("keep_out", [f"at x {area.x0_m:g} m, y {area.y0_m:g} m" for area in areas])
    yield from _named("rack", [code for code in site.locations if not _place_held(code, site, again)])
    if any(rack.deck_below_label_m is not None for rack in site.racks):
        yield "rack.deck_below_label_m"
    if any(rack.pallets_deep > 1 for rack in site.racks):
        yield "rack.pallets_deep"
    yield from _fields_lost("pad", _by_id(site.pads), _by_id(again.pads))
    yield from _named("marker", [str(marker.id) for marker in site.markers])


def _by_id(parts: tuple[Any, ...]) -> dict[str, Any]:
    return {part.id: part for part in parts}


def _fields_lost(kind: str, told: Mapping[str, Any], again: Mapping[str, Any]) -> Iterator[str]:
    yield from _named(kind, [name for name in told if name not in again])
    held = [(name, one, again[name]) for name, one in told.items() if name in again]
    for field in fields(held[0][1]) if held else ():
        lost = [
            name for name, one, two in held if not _same(getattr(one, field.name), getattr(two, field.name))
        ]
        yield from _named(f"{kind}.{field.name}", lost)


def _named(kind: str, names: list[str]) -> Iterator[str]:
    if names:
        yield f"{kind} ({listed(names)})"


def _place_held(code: str, site: Site, again: Site) -> bool:
    if code not in again.locations:
        return False
    one, two = site.locations[code], again.locations[code]
    told = (field.name for field in fields(Location) if field.name != "pallets_deep")  # of its rack
    return all(_same(getattr(one, name), getattr(two, name)) for name in told)


def _same(one: Any, two: Any) -> bool:
    if isinstance(one, float) and isinstance(two, float):
        return math.isclose(one, two, rel_tol=0.0, abs_tol=_SAME)
    if isinstance(one, tuple) and isinstance(two, tuple):
        return len(one) == len(two) and all(map(_same, one, two))
    return bool(one == two)
