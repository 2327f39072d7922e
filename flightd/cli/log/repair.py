"""`flightd log repair`: logs that were cut off, made whole."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from flightd.cli.options import AsJson


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("repair")(repair)


def repair(
    logs: Annotated[list[Path], typer.Argument(metavar="LOG…", help="Flight logs that were cut off.")],
    as_json: AsJson = False,
) -> None:
    """Make logs whole that a kill, a full disk or a loss of power cut off; whole ones stay as they are.

    Not for the log of a flight in progress.

    \b
    Examples:
      flightd log repair /var/lib/flightd/flights/*/flight.mcap
    """
    from flightd.adapters.recorder.mcap_repair import repair as make_whole
    from flightd.replay.log import check_is_log

    for log in logs:
        check_is_log(log)
        make_whole(log)
    if as_json:
        print(json.dumps({"repaired": [str(log) for log in logs]}))
    else:
        print(*(f"{log}: whole" for log in logs), sep="\n")
