"""`flightd store`: the ground store, all counts of all sites over the years."""

from __future__ import annotations

import typer

from flightd.cli.application import group
from flightd.cli.store import deliver, exchange, export, show


def register(app: typer.Typer) -> None:
    """Hang `store` with its commands under `app`."""
    commands = group("flightd store deliver out --store counts.db\nflightd store show --store counts.db")
    for command in (deliver, show, export, exchange):
        command.register(commands)
    app.add_typer(
        commands, name="store", help="All counts over the years: deliver, prune, show, export, exchange."
    )
