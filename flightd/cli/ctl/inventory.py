"""`flightctl inventory`: what has been counted so far."""

from __future__ import annotations

import json

import typer

from flightd.cli.ctl.connection import DaemonConnection
from flightd.cli.options import AsJson
from flightd.core.told_codes import LISTED


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("inventory")(inventory)


def inventory(context: typer.Context, as_json: AsJson = False) -> None:
    """Tell what has been counted, place by place.

    \b
    Examples:
      flightctl inventory
      flightctl inventory --json
    """
    link: DaemonConnection = context.obj
    places = link.ask(lambda client: client.inventory())
    if as_json:
        print(json.dumps({"places": places}))
        return
    for place in places:
        print("  ".join(text for name, text in place.items() if name != LISTED))
    print(f"{len(places)} places")
