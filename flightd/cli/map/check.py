"""`flightd map check`: is a site file sound, and will the labels be read?"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Final

import typer

from flightd.cli.map.site_files import SiteFile
from flightd.cli.options import AsJson

_LISTED: Final = {"unseen", "unreadable", "problems"}
"""Facts of the coverage that are lists: a person reads the problems instead."""


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("check")(check)


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
    Examples:
      flightd map check configs/site-demo.toml
      flightd map check hall-3.toml --json
      flightd map check hall-3.toml --fov-deg 75 --width-px 1920 --exposure-ms 2 --module-mm 3
    """
    from flightd.site.ambiguity import alike
    from flightd.site.coverage import FrontView, check_coverage, coverage_facts
    from flightd.site.facts import site_facts
    from flightd.site.site_file import load_site

    site = load_site(site_file)
    facts = site_facts(site)
    groups = alike(site, crossings)
    reach = None
    if fov_deg is not None:
        view = FrontView(math.radians(fov_deg), width_px, exposure_ms / 1e3, module_mm / 1e3)
        reach = check_coverage(site, view, speed_mps)
    scan = {"scan": coverage_facts(reach)} if reach else {}
    sound = reach is None or not reach.problems
    if as_json:
        print(json.dumps({"file": str(site_file), "ok": sound, **facts, "alike": groups, **scan}))
    else:
        print(f"{site_file}: sound")
        _print_facts(facts)
        _print_alike(groups, crossings)
        _print_facts(scan.get("scan", {}))
        for problem in reach.problems if reach else ():
            print(f"  problem: {problem}")
    if not sound:
        raise typer.Exit(1)


def _print_alike(groups: Sequence[Sequence[str]], crossings: int) -> None:
    if not groups:
        return
    shown = "; ".join(" ".join(group[:6]) + (" …" if len(group) > 6 else "") for group in groups[:4])
    more = f"; and {len(groups) - 4} more groups" if len(groups) > 4 else ""
    print(f"  alike         within {crossings} crossings: {shown}{more}")


def _print_facts(facts: Mapping[str, object]) -> None:
    for name, value in facts.items():
        if name in _LISTED:
            continue
        label, _, unit = name.replace("_", " ").rpartition(" ")
        print(f"  {label:<13} {value} m" if unit == "m" else f"  {name.replace('_', ' '):<13} {value}")
