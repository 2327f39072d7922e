"""`flightd map draw`: the floor plan of a site."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from flightd.cli.map.site_files import Force, SiteFile, write_new
from flightd.cli.options import AsJson


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("draw")(draw)


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
    Examples:
      flightd map draw configs/site-demo.toml --out demo.svg
    """
    from flightd.site.floor_plan_svg import draw_site
    from flightd.site.site_file import load_site

    target = out if out is not None else site_file.with_suffix(".svg")
    write_new(target, draw_site(load_site(site_file)), force)
    print(json.dumps({"drawing": str(target)}) if as_json else target)
