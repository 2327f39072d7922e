"""A floor that was not painted where its map says."""

from __future__ import annotations

import random
from dataclasses import replace

from flightd.core.errors import InputError
from flightd.site.layout import LayoutError
from flightd.site.moved_lines import columns, moved
from flightd.site.site import Site

_TRIES = 50


def misplaced(site: Site, most_m: float, seed: int) -> Site:
    """The site with each aisle line and each line across them up to `most_m` beside its place.

    The lines of the home pad's node stay, since places are told from there, and racks stand where they stand.
    InputError where no such floor can be laid out."""
    rng = random.Random(f"misplaced lines {seed}")
    home = site.nodes[site.home.node]
    for _ in range(_TRIES):
        y_m = {
            aisle.id: aisle.y_m + (0.0 if aisle.id == home.aisle else rng.uniform(-most_m, most_m))
            for aisle in site.aisles
        }
        x_m: dict[str, float] = {}
        for column in columns(site):
            off_m = rng.uniform(-most_m, most_m)
            for node in column:
                x_m[node] = site.nodes[node].x_m + (0.0 if home.id in column else off_m)
        try:
            return replace(moved(site, y_m, x_m), shelves=site.shelves, locations=site.locations)
        except LayoutError as err:
            problem = str(err)
    raise InputError(f"floor.map_error_m = {most_m}: no such floor can be laid out ({problem})")
