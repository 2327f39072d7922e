"""`flightd map fit`: the map as flown logs have it."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flightd.cli.map.site_files import Force, demand_new, write_new
from flightd.cli.options import AsJson
from flightd.core.errors import InputError

if TYPE_CHECKING:
    from flightd.config.schema import Config
    from flightd.site.site import Site
    from flightd.studies.flight_fit.record import FlightRecord
    from flightd.studies.map_fit import MapFit
    from flightd.studies.map_scale import Distance


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("fit")(fit)


def fit(
    logs: Annotated[list[Path], typer.Argument(metavar="LOG…", help="Flight logs over one map.")],
    site_file: Annotated[
        Path | None,
        typer.Option("--site", metavar="F", help="Site file whose comments are kept; else the recorded map."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="F", help="Write the proposed site file, and F.svg beside it.")
    ] = None,
    measured: Annotated[
        list[str] | None,
        typer.Option(metavar="A-B=M", help="Metres between two nodes, measured with a tape: A1-A6=7.94."),
    ] = None,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Fit the map to what flights saw of it: where each painted line lies, and how surely.

    Places are measured from the home pad's node.  A line that was not enough seen stays where it is.

    \b
    Examples:
      flightd map fit out/sim/flight.mcap
      flightd map fit monday.mcap tuesday.mcap --site hall.toml --out hall-fitted.toml
      flightd map fit flight.mcap --measured A1-A6=7.94 --json
    """
    from flightd.site.floor_plan_svg import draw_site
    from flightd.site.site_edit import with_aisles
    from flightd.site.site_file import site_toml
    from flightd.studies.map_fit import fit_map
    from flightd.studies.map_fit_document import fit_document, lines_off

    distances = [_distance(text) for text in measured or ()]
    if out is not None:
        demand_new((out, _drawing_of(out)), force)
    records, configs, site = _flown(logs)
    text = site_toml(site) if site_file is None else _text_of(site_file, site)
    found = fit_map(records, configs, site, distances)
    document = {"logs": [str(log) for log in logs], **fit_document(found)}
    if out is not None:
        write_new(out, with_aisles(text, found.aisles), force)
        drawing = _drawing_of(out)
        write_new(drawing, draw_site(site, lines_off(found, site)), force)
        document |= {"site": str(out), "drawing": str(drawing)}
    if as_json:
        print(json.dumps(document, indent=2))
        return
    _print(found)
    if out is not None:
        print(f"{out}: the proposed map; {_drawing_of(out)}: where the lines lie, ten times exaggerated")


def _drawing_of(out: Path) -> Path:
    return out.parent / f"{out.stem}.svg"


def _flown(logs: list[Path]) -> tuple[list[FlightRecord], list[Config], Site]:
    """What all logs hold.  InputError where they were flown by different maps."""
    from flightd.app.recording import SETTING_TOPICS, recorded_setting
    from flightd.replay.log import read_log
    from flightd.studies.flight_fit.record import READ, flight_record

    records, configs = [], []
    site: Site | None = None
    for path in logs:
        log = read_log(path, {*READ, *SETTING_TOPICS})
        setting = recorded_setting(log)
        if site is not None and setting.site.lines != site.lines:
            raise InputError("flown by another map than the first log", file=path, remedy="fit it by itself")
        site = setting.site
        records.append(flight_record(log))
        configs.append(setting.config)
    assert site is not None  # there is one log at least
    return records, configs, site


def _text_of(site_file: Path, flown: Site) -> str:
    from flightd.site.site_file import load_site

    if load_site(site_file).lines != flown.lines:
        remedy = "give the site file by which the flight was flown"
        raise InputError("its lines are not those that the log was flown by", file=site_file, remedy=remedy)
    return site_file.read_text(encoding="utf-8")


def _distance(text: str) -> Distance:
    from flightd.studies.map_scale import Distance

    match = re.fullmatch(r"([A-Z]{1,3}\d+)-([A-Z]{1,3}\d+)=(\d+(?:\.\d+)?)", text)
    if match is None or match[1] == match[2] or not 0.1 <= float(match[3]) <= 1000.0:
        raise InputError("expected two nodes and metres, as in A1-A6=7.94", key=f"--measured {text}")
    return Distance(match[1], match[2], float(match[3]))


def _print(found: MapFit) -> None:
    from rich.table import Table

    from flightd.cli.tables import stdout
    from flightd.studies.map_fit_document import fit_rows

    table = Table(title=f"{len(found.lines)} lines by {found.frames} frames", title_justify="left")
    for heading in ("line", "map, m", "fitted, m", "difference", "sigma", "angle, deg", "sightings"):
        table.add_column(heading, justify="left" if heading == "line" else "right")
    for row in fit_rows(found):
        table.add_row(*row)
    stdout().print(table)
    nodes = Table(title_justify="left")
    for heading in ("node", "map x, y", "fitted x, y", "sigma", "sightings"):
        nodes.add_column(heading, justify="left" if heading == "node" else "right")
    for node in found.nodes:
        fitted = (
            f"{node.across.fitted_m:.3f}, {node.along.fitted_m:.3f}"
            if node.seen_enough
            else "not enough seen"
        )
        nodes.add_row(
            node.id,
            f"{node.across.map_m:.3f}, {node.along.map_m:.3f}",
            fitted,
            f"{node.across.sigma_m * 100:.1f}, {node.along.sigma_m * 100:.1f} cm",
            str(node.sightings),
        )
    stdout().print(nodes)
    for one in found.scale.witnesses:
        print(f"scale by {one.source}: {(one.factor - 1) * 100:+.2f} % (sigma {one.sigma * 100:.2f} %)")
    scale = found.scale
    print(f"scale taken: {(scale.factor - 1) * 100:+.2f} % (sigma {scale.sigma * 100:.2f} %)")
