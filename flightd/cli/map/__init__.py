"""`flightd map`: check, draw, fit, make, import and export site files."""

from __future__ import annotations

import typer

from flightd.cli.application import group
from flightd.cli.map import check, draw, exchange, fit, new


def register(app: typer.Typer) -> None:
    """Hang `map` with its commands under `app`."""
    commands = group(
        "flightd map new hall-3.toml --aisles 4\nflightd map check hall-3.toml\nflightd map fit flight.mcap"
    )
    for command in (check, draw, exchange, fit, new):
        command.register(commands)
    app.add_typer(
        commands,
        name="map",
        help="Check, draw, fit, make, import and export site files (the map of a warehouse).",
    )
