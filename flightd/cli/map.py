"""`flightd map`: check, draw and make site files.  What it does is imported when it runs."""

from __future__ import annotations

import itertools
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flightd.core.errors import InputError

if TYPE_CHECKING:
    from flightd.site.coverage import Coverage
    from flightd.site.site import Site

_LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"

SiteFile = Annotated[Path, typer.Argument(metavar="SITE", help="Site file, TOML.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON document.")]
Force = Annotated[bool, typer.Option("--force", help="Overwrite a file that is there.")]


def register(app: typer.Typer) -> None:
    """Hang `map check`, `map draw` and `map new` on `app`."""
    maps = typer.Typer(no_args_is_help=True, rich_markup_mode=None)
    maps.command("check")(check)
    maps.command("draw")(draw)
    maps.command("new")(new)
    app.add_typer(maps, name="map", help="Check, draw and make site files (the map of a warehouse).")


def check(
    site_file: SiteFile,
    fov_deg: Annotated[
        float | None, typer.Option(help="Check the front camera too: its horizontal field.", min=5, max=170)
    ] = None,
    width_px: Annotated[int, typer.Option(help="Its picture's width.", min=16)] = 1920,
    exposure_ms: Annotated[float, typer.Option(help="Its exposure.", min=0.001, max=1000)] = 1.0,
    module_mm: Annotated[
        float, typer.Option(help="Size of a module of the smallest label.", min=0.05, max=100)
    ] = 3.0,
    speed_mps: Annotated[float, typer.Option(help="Speed along the shelf while looking.", min=0)] = 0.3,
    crossings: Annotated[
        int, typer.Option(help="Name the nodes that look alike within so many crossings.", min=0, max=50)
    ] = 2,
    as_json: AsJson = False,
) -> None:
    """Say whether a site file is sound, what it holds, and whether the labels will be read.

    Nodes that look alike, and so do all ways of --crossings from them, cannot be told apart by a drone
    that lost its place there: it flies on until it knows, or lands.

    With --fov-deg the front camera is held against the paper's rule D_X = 2 D_Y tan(sigma / 2), against
    2.5 pixels for each module and a blur of 0.75 module; exit 1 where it does not reach.

    \b
    flightd map check configs/site-demo.toml
    flightd map check hall-3.toml --json
    flightd map check hall-3.toml --fov-deg 75 --width-px 1920 --exposure-ms 2 --module-mm 3
    """
    from flightd.site.ambiguity import alike
    from flightd.site.coverage import FrontView, check_coverage
    from flightd.site.site_file import load_site

    site = load_site(site_file)
    facts = _facts(site)
    groups = alike(site, crossings)
    reach = None
    if fov_deg is not None:
        view = FrontView(math.radians(fov_deg), width_px, exposure_ms / 1e3, module_mm / 1e3)
        reach = check_coverage(site, view, speed_mps)
    if as_json:
        document = {
            "file": str(site_file),
            "ok": reach is None or not reach.problems,
            **facts,
            "alike": groups,
        }
        print(json.dumps(document | ({"scan": _scan_facts(reach)} if reach else {})))
    else:
        print(f"{site_file}: sound")
        for name, value in facts.items():
            _print_fact(name, value)
        if groups:
            shown = "; ".join(" ".join(group[:6]) + (" …" if len(group) > 6 else "") for group in groups[:4])
            more = f"; and {len(groups) - 4} more groups" if len(groups) > 4 else ""
            print(f"  alike         within {crossings} crossings: {shown}{more}")
        for name, value in _scan_facts(reach).items() if reach else ():
            if not isinstance(value, list):
                _print_fact(name, value)
        for problem in reach.problems if reach else ():
            print(f"  problem: {problem}")
    if reach and reach.problems:
        raise typer.Exit(1)


def _print_fact(name: str, value: object) -> None:
    label, _, unit = name.replace("_", " ").rpartition(" ")
    print(f"  {label:<13} {value} m" if unit == "m" else f"  {name.replace('_', ' '):<13} {value}")


def _scan_facts(reach: Coverage) -> dict[str, Any]:
    return {
        "read_part": round(reach.read_part, 5),
        "px_per_module": round(reach.least_px_per_module, 3),
        "blur_modules": round(reach.blur_modules, 3),
        "speed_limit_mps": round(reach.speed_limit_mps, 4),
        "unseen": list(reach.unseen),
        "unreadable": list(reach.unreadable),
        "problems": list(reach.problems),
    }


def draw(
    site_file: SiteFile,
    out: Annotated[
        Path | None, typer.Option(metavar="F", help="Where to write; beside the site file, as .svg.")
    ] = None,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Draw the floor plan of a site to scale, as an SVG picture for any browser.

    \b
    flightd map draw configs/site-demo.toml --out demo.svg
    """
    from flightd.site.floor_plan_svg import draw_site
    from flightd.site.site_file import load_site

    target = out if out is not None else site_file.with_suffix(".svg")
    _write(target, draw_site(load_site(site_file)), force)
    print(json.dumps({"drawing": str(target)}) if as_json else target)


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
    shelf_distance_m: Annotated[float, typer.Option(help="From the line to the shelf front.")] = 1.2,
    shelf_height_m: Annotated[float, typer.Option(help="Height of the shelves.")] = 3.0,
    ceiling_m: Annotated[float, typer.Option(help="Height of the hall.")] = 6.0,
    levels_m: Annotated[
        str | None, typer.Option(help="Heights of the labels, as in 0.3,1.5: adds racks with locations.")
    ] = None,
    bay_width_m: Annotated[float, typer.Option(help="Width of the racks' bays.", min=0.2, max=50)] = 1.35,
    positions: Annotated[int, typer.Option(help="Places in each bay on each level.", min=1, max=100)] = 1,
    name: Annotated[str | None, typer.Option(help="Name of the site; the file's name.")] = None,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Make a site file of equal aisles, joined at both ends, with the pad at A1; then edit it.

    \b
    flightd map new hall-3.toml --aisles 4 --nodes 8 --spacing-m 1.4,1.7 --pitch-m 3.2
    """
    from flightd.site.site_file import parse_site, site_toml

    steps = [repr(step) for step in _spacings(spacing_m, nodes)]
    letters = _LETTERS[:aisles]
    blocks = [
        f"[site]\nname = {json.dumps(name or out.stem)}\nline_width_m = {line_width_m}\n"
        f"line_colour = {json.dumps(line_colour)}\nceiling_m = {ceiling_m}"
    ]
    for i, letter in enumerate(letters):
        blocks.append(
            f'[[aisle]]\nid = "{letter}"\nx_m = 0.0\ny_m = {round(i * pitch_m, 6)}\n'
            f"spacing_m = [{', '.join(steps)}]\nshelf_distance_m = {shelf_distance_m}\n"
            f"shelf_height_m = {shelf_height_m}"
        )
    for a, b in itertools.pairwise(letters):
        blocks += [f'[[cross]]\nnodes = ["{a}{end}", "{b}{end}"]' for end in (1, nodes)]
    if levels_m is not None:
        levels = ", ".join(repr(level) for level in _numbers("--levels-m", levels_m))
        blocks.append(
            f"[[rack]]\nbay_width_m = {bay_width_m}\nlevels_m = [{levels}]\npositions = {positions}"
        )
    blocks.append('[[pad]]\nid = "home"\nnode = "A1"')
    site = parse_site("\n\n".join(blocks), str(out))
    _write(out, site_toml(site), force)
    print(json.dumps({"file": str(out), **_facts(site)}) if as_json else out)


def _facts(site: Site) -> dict[str, Any]:
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


def _spacings(text: str, nodes: int) -> list[float]:
    pattern = _numbers("--spacing-m", text)
    return [pattern[i % len(pattern)] for i in range(nodes - 1)]


def _numbers(option: str, text: str) -> list[float]:
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise InputError(f"{option} {text!r}: give metres, as in 1.5 or 1.5,1.8") from None


def _write(path: Path, text: str, force: bool) -> None:
    try:
        with path.open("w" if force else "x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise InputError(f"{path}: there already; choose another name or add --force") from None
    except OSError as err:
        raise InputError(f"{path}: cannot write: {err.strerror or err}") from None
