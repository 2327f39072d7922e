"""A new site of equal aisles, as `flightd map new` makes it: the few measures that are needed."""

from __future__ import annotations

from typing import Annotated, Any

import msgspec
from msgspec import Meta

from flightd.core.errors import InputError
from flightd.ground.site_page.drafts import opened_document
from flightd.site.aisle_grid import AisleGrid, RackRow, assumed_ceiling_m
from flightd.site.site_draft import draft_of, read_draft
from flightd.site.site_file import parse_site

_Metres = Annotated[float, Meta(gt=0, le=1000)]
_Spacing = Annotated[list[_Metres], Meta(min_length=1, max_length=1000)]
_Sides = {"both": ("left", "right"), "left": ("left",), "right": ("right",), "none": ()}


class NewRacks(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Racks along every aisle."""

    levels_m: Annotated[list[Annotated[float, Meta(ge=0, le=100)]], Meta(min_length=1, max_length=100)]
    bay_width_m: Annotated[float, Meta(ge=0.2, le=50)]
    positions: Annotated[int, Meta(ge=1, le=100)]


class NewSite(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What has to be known; a `ceiling_m` is assumed over racks where it is None."""

    name: Annotated[str, Meta(min_length=1, max_length=80)]
    aisles: Annotated[int, Meta(ge=1, le=26)]
    nodes: Annotated[int, Meta(ge=2, le=1000)]
    spacing_m: _Spacing
    pitch_m: Annotated[float, Meta(ge=0.5, le=100)]
    line_colour: str = "yellow"
    shelves: str = "both"
    shelf_distance_m: _Metres = 1.2
    shelf_height_m: _Metres = 3.0
    ceiling_m: _Metres | None = None
    racks: NewRacks | None = None


def new_draft(new: NewSite) -> dict[str, Any]:
    """The page's document of it, with `notes` about what was assumed.  InputError where it is no floor."""
    if new.shelves not in _Sides:
        raise InputError("shelves stand on both sides, left, right or none")
    sides, racks, ceiling_m, notes = _Sides[new.shelves], None, new.ceiling_m, []
    if new.racks is not None:
        if not sides:
            raise InputError("racks stand on shelves", remedy="choose sides, or leave the racks out")
        racks = RackRow(new.racks.bay_width_m, new.racks.levels_m, new.racks.positions)
        if ceiling_m is None:
            ceiling_m = assumed_ceiling_m(new.shelf_height_m, new.racks.levels_m)
            notes.append(
                f"ceiling_m = {ceiling_m:g} is assumed; measure the lowest thing under the roof before"
                " anything flies there"
            )
    grid = AisleGrid(
        name=new.name,
        aisles=new.aisles,
        nodes=new.nodes,
        spacing_m=new.spacing_m,
        pitch_m=new.pitch_m,
        line_width_m=0.075,
        line_colour=new.line_colour,
        cross_half_m=0.5,
        overrun_m=0.4,
        shelves=sides,
        shelf_distance_m=new.shelf_distance_m,
        shelf_height_m=new.shelf_height_m,
        ceiling_m=ceiling_m,
        racks=racks,
    )
    text = grid.toml()
    parse_site(text, "the new site")
    read = read_draft(text, "the new site")
    return {**opened_document(draft_of(read.tables())), "notes": notes}
