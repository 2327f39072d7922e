"""`flightd log`: look into, export and mend flight logs."""

from __future__ import annotations

import typer

from flightd.cli.application import group
from flightd.cli.log import export, info, repair


def register(app: typer.Typer) -> None:
    """Hang `log` with its commands under `app`."""
    commands = group("flightd log info out/flight.mcap\nflightd log export out/flight.mcap --csv out/tables")
    for command in (info, export, repair):
        command.register(commands)
    app.add_typer(commands, name="log", help="Look into, export and mend flight logs.")
