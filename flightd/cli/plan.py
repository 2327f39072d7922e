"""`flightd plan`: what the configured flight would be.  What it needs is imported when it runs."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from typing import Annotated

import typer

from flightd.cli.options import AsJson, ConfigFile
from flightd.cli.planned_flight import planned_in_words


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
      flightd plan --config hall-flight.toml
      flightd plan --config hall-flight.toml A4 A5 --level 1
      flightd plan --config hall-flight.toml --json
    """
    from flightd.app.build import pilot_of
    from flightd.config.schema import load_config
    from flightd.core.count_choice import CountChoice
    from flightd.site.site_file import load_site

    settings = load_config(config)
    mission = pilot_of(settings, load_site(settings.mission.site)).mission
    chosen: Sequence[str] = nodes or ()
    if not nodes and (level or best):
        chosen = mission.planned((), best_order=False).nodes
    planned = mission.planned(chosen, CountChoice(tuple(level or ())), best_order=best)
    print(json.dumps(asdict(planned)) if as_json else "\n".join(planned_in_words(planned)))
