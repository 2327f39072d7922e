"""`flightd keygen`: the secret of a signed MAVLink link."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("keygen")(keygen)


def keygen(
    mavlink: Annotated[Path, typer.Option(metavar="FILE", help="File to write, mode 0600.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON document.")] = False,
) -> None:
    """Make the secret key of a MAVLink 2 link that is signed.

    The autopilot needs the same 32 bytes: send them once over a cable, with a ground station or with
    pymavlink's SETUP_SIGNING.  The keys of ground stations are made by flightctl keygen.

    \b
    flightd keygen --mavlink /etc/flightd/mavlink.key
    then in the configuration: [vehicle] signing_key = "mavlink.key"
    """
    from flightd.adapters.vehicle.mavlink.signing import make_key

    make_key(mavlink)
    print(json.dumps({"key": str(mavlink)}) if as_json else mavlink)
    print(f"give the autopilot the same key (64 hex digits in {mavlink})", file=sys.stderr)
