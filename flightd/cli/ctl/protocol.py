"""`flightctl protocol`: the ground link for whoever writes another client."""

from __future__ import annotations

import json

import typer

from flightd.cli.options import AsJson


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("protocol")(protocol)


def protocol(as_json: AsJson = False) -> None:
    """Print every message and field of the ground link (--json: as a JSON Schema), for other clients.

    \b
    Examples:
      flightctl protocol
      flightctl protocol --json
    """
    from flightd.adapters.ground_link.protocol_text import markdown, schema

    print(json.dumps(schema(), indent=1) if as_json else markdown())
