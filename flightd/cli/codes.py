"""`flightd codes`: QR codes and barcodes in pictures.  What it does is imported when it runs."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from flightd.cli.options import AsJson, Pictures
from flightd.cli.tables import stdout


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("codes")(codes)


def codes(
    paths: Pictures,
    labels: Annotated[
        Path | None, typer.Option(metavar="F", help="Compare with the texts that this JSON file expects.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Read the QR codes and barcodes in pictures.

    Every symbology; GS1 codes and Digital Links come with their parts.  A text is told only when the code's
    own checksum vouches for it or two ways of looking at the picture agree; the rest is counted as doubtful.

    \b
    F: {"codes": [{"file": "a.jpg", "text": "9780804816632"}]}

    \b
    Examples:
      flightd codes label.jpg
      flightd codes shelf/ --json
      flightd codes photographs/ --labels photographs/codes.json
    """
    from flightd.studies import codes as command

    expected = command.read_expected(labels) if labels else None
    pictures = command.read(paths)
    if as_json:
        sys.stdout.write(command.as_json(list(pictures), expected) + "\n")
        return
    console = stdout()
    shown = []
    for picture in pictures:
        command.print_picture(picture, console)
        shown.append(picture)
    if expected is not None:
        command.print_verdict(command.compare(shown, expected), console)
