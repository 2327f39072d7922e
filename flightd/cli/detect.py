"""`flightd detect`: lines in pictures.  What it does is imported when it runs."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from flightd.cli.options import PROFILE_HELP, AsJson, Pictures, check_methods
from flightd.cli.tables import stdout


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("detect")(detect)


def detect(
    paths: Pictures,
    method: Annotated[str, typer.Option(help="centroid, skeleton, combined or naive.")] = "combined",
    profile: Annotated[str, typer.Option(help=PROFILE_HELP)] = "yellow",
    overlay: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Write each picture with its lines here.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Find the painted lines in pictures.

    rho is measured from the image centre, theta is the normal's angle (x right, y down).

    \b
    Examples:
      flightd detect floor.jpg
      flightd detect frames/ flight.mp4 --profile white --overlay out/
      flightd detect floor.jpg --method skeleton --json
    """
    from flightd.studies import detect as command

    check_methods((method,))
    found = command.detect(paths, method, profile, overlay)
    if as_json:
        sys.stdout.write(command.as_json(list(found)) + "\n")
        return
    console = stdout()
    for entry in found:
        command.print_found(entry, console)
