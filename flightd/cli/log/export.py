"""`flightd log export`: a log as tables or a video."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from flightd.cli.options import AsJson, Log
from flightd.core.errors import InputError


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("export")(export)


def export(
    log: Log,
    csv: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Write one CSV file for each topic here.")
    ] = None,
    video: Annotated[
        Path | None, typer.Option(metavar="F.mp4", help="Write the pictures with their lines here.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Turn a log into tables or a video.

    \b
    Examples:
      flightd log export out/flight.mcap --csv out/tables
      flightd log export out/flight.mcap --video out/flight.mp4
    """
    if csv is None and video is None:
        raise InputError("say what to export: --csv DIR, --video F.mp4 or both")
    written: list[Path] = []
    if csv is not None:
        from flightd.core.topics import FOR_PEOPLE
        from flightd.replay.export import export_csv
        from flightd.replay.log import read_log

        written += export_csv(read_log(log, FOR_PEOPLE), csv)
    if video is not None:
        from flightd.studies.flight_video import export_video

        export_video(log, video)
        written.append(video)
    if as_json:
        print(json.dumps({"written": [str(path) for path in written]}))
    else:
        print(*written, sep="\n")
