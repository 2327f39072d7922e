"""`flightd inventory`: what was counted, out to other programs, and against the books."""

from __future__ import annotations

import typer

from flightd.cli.application import group
from flightd.cli.inventory import add, compare, export, kpis, merge, plan, show, texts


def register(app: typer.Typer) -> None:
    """Hang `inventory` with its commands under `app`."""
    commands = group("flightd inventory show out/stock\nflightd inventory export out/stock --out stock.xlsx")
    for command in (plan, show, add, texts, export, compare, kpis, merge):
        command.register(commands)
    app.add_typer(
        commands,
        name="inventory",
        help="What was counted: plan, show, add, texts, export, compare, kpis, merge.",
    )
