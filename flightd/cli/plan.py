"""`flightd plan`: what the configured flight would be.  What it needs is imported when it runs."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from flightd.cli.options import AsJson, ConfigFile

if TYPE_CHECKING:
    from flightd.core.planned_flight import PlannedFlight


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("plan")(plan)


def plan(
    config: ConfigFile,
    nodes: Annotated[
        list[str] | None, typer.Argument(help="Nodes of the map, as A4 A5; none: those of the configuration.")
    ] = None,
    level: Annotated[
        list[int] | None, typer.Option(min=1, max=99, help="Count this shelf level; again for more.")
    ] = None,
    best: Annotated[bool, typer.Option("--best", help="The nodes in the quickest order.")] = False,
    as_json: AsJson = False,
) -> None:
    """Say what a flight of this configuration would be, with a full battery: order, time, batteries, and how
    shelves are counted in passing.  Nothing is connected, nothing flies.

    \b
    Examples:
      flightd plan --config hall.toml
      flightd plan --config hall.toml A4 A5 --level 1
      flightd plan --config hall.toml --json
    """
    from flightd.app.build import pilot_of
    from flightd.config.schema import load_config
    from flightd.site.site_file import load_site

    settings = load_config(config)
    mission = pilot_of(settings, load_site(settings.mission.site)).mission
    planned = mission.planned(nodes or (), level or (), best_order=best)
    print(json.dumps(asdict(planned)) if as_json else "\n".join(_lines(planned)))


def _lines(planned: PlannedFlight) -> list[str]:
    batteries = "1 battery" if planned.batteries == 1 else f"{planned.batteries} batteries"
    counted = f", {planned.places} places counted" if planned.places else ""
    figures = (
        f"{len(planned.nodes)} nodes, {planned.way_m:.0f} m{counted}, about {planned.seconds / 60:.1f} min in"
        f" the air, {batteries}"
    )
    return [" ".join(planned.nodes), figures, *(f"in passing, {each.text}" for each in planned.sweeps)]
