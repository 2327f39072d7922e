"""`flightd map new`: a site file of equal aisles."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from flightd.cli.map.site_files import Force, write_new
from flightd.cli.options import AsJson
from flightd.core.errors import InputError


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("new")(new)


def new(
    out: Annotated[Path, typer.Argument(metavar="OUT", help="Site file to write.")],
    aisles: Annotated[int, typer.Option(help="Number of aisles.", min=1, max=26)] = 2,
    nodes: Annotated[int, typer.Option(help="Nodes of each aisle.", min=2, max=1000)] = 6,
    spacing_m: Annotated[
        str, typer.Option(help="Metres between nodes: one number, or a list that repeats: 1.5,1.8.")
    ] = "1.5",
    pitch_m: Annotated[float, typer.Option(help="Metres from aisle to aisle.", min=0.5, max=100)] = 3.0,
    line_width_m: Annotated[float, typer.Option(help="Width of the painted lines.")] = 0.075,
    line_colour: Annotated[str, typer.Option(help="yellow, white, red or blue.")] = "yellow",
    cross_half_m: Annotated[float, typer.Option(help="Half the length of a node's own cross line.")] = 0.5,
    overrun_m: Annotated[float, typer.Option(help="How far the lines run past their end nodes.")] = 0.4,
    shelves: Annotated[
        str, typer.Option(help="Sides of the aisles with shelves, seen along +x: both, left, right or none.")
    ] = "both",
    shelf_distance_m: Annotated[float, typer.Option(help="From the line to the shelf front.")] = 1.2,
    shelf_height_m: Annotated[float, typer.Option(help="Height of the shelves.")] = 3.0,
    ceiling_m: Annotated[
        float | None,
        typer.Option(help="Lowest thing under the roof; over racks one is assumed, and told."),
    ] = None,
    levels_m: Annotated[
        str | None, typer.Option(help="Heights of the labels, as in 0.3,1.5: adds racks with locations.")
    ] = None,
    bay_width_m: Annotated[float, typer.Option(help="Width of the racks' bays.", min=0.2, max=50)] = 1.35,
    positions: Annotated[int, typer.Option(help="Places in each bay on each level.", min=1, max=100)] = 1,
    deck_below_label_m: Annotated[
        float | None, typer.Option(help="From the labels down to what goods stand on; 2/5 of the spacing.")
    ] = None,
    pattern: Annotated[
        str | None, typer.Option(help="Location codes, as in {aisle}{side}-{bay:02}-{level}-{position}.")
    ] = None,
    name: Annotated[str | None, typer.Option(help="Name of the site; the file's name.")] = None,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Make a site file of equal aisles, joined at both ends, with the pad at A1; then edit it.

    \b
    Examples:
      flightd map new hall-3.toml --aisles 4 --nodes 8 --spacing-m 1.4,1.7 --pitch-m 3.2
    """
    from flightd.site.aisle_grid import AisleGrid, RackRow, assumed_ceiling_m
    from flightd.site.facts import site_facts
    from flightd.site.site_file import parse_site, site_toml

    sides, racks = _sides(shelves), None
    if levels_m is not None:
        if not sides:
            raise InputError(
                "racks (--levels-m) stand on shelves; give both, left or right", key=f"--shelves {shelves}"
            )
        levels = _metres("--levels-m", levels_m)
        racks = RackRow(bay_width_m, levels, positions, deck_below_label_m, pattern)
        if not ceiling_m:
            ceiling_m = assumed_ceiling_m(shelf_height_m, levels)
            _say_assumed(ceiling_m)
    grid = AisleGrid(
        name=name or out.stem,
        aisles=aisles,
        nodes=nodes,
        spacing_m=_metres("--spacing-m", spacing_m),
        pitch_m=pitch_m,
        line_width_m=line_width_m,
        line_colour=line_colour,
        cross_half_m=cross_half_m,
        overrun_m=overrun_m,
        shelves=sides,
        shelf_distance_m=shelf_distance_m,
        shelf_height_m=shelf_height_m,
        ceiling_m=ceiling_m,
        racks=racks,
    )
    site = parse_site(grid.toml(), str(out))
    write_new(out, site_toml(site), force)
    print(json.dumps({"file": str(out), **site_facts(site)}) if as_json else out)


def _say_assumed(ceiling_m: float) -> None:
    print(
        f"flightd: --ceiling-m is not given: ceiling_m = {ceiling_m:g} is assumed and written; measure the"
        " lowest thing under the roof before anything flies there",
        file=sys.stderr,
    )


def _sides(shelves: str) -> tuple[str, ...]:
    known = {"both": ("left", "right"), "left": ("left",), "right": ("right",), "none": ()}
    if shelves not in known:
        raise InputError("give both, left, right or none", key=f"--shelves {shelves!r}")
    return known[shelves]


def _metres(option: str, text: str) -> tuple[float, ...]:
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise InputError("give metres, as in 1.5 or 1.5,1.8", key=f"{option} {text!r}") from None
