"""`flightctl picture`: the down camera's next picture."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from flightd.cli.ctl.connection import DaemonConnection
from flightd.cli.options import AsJson
from flightd.core.errors import cannot_write


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("picture")(picture)


def picture(
    context: typer.Context,
    out: Annotated[Path, typer.Argument(metavar="OUT", help="JPEG file to write.")] = Path("picture.jpg"),
    as_json: AsJson = False,
) -> None:
    """Fetch the down camera's next picture.

    \b
    Examples:
      flightctl picture now.jpg
    """
    link: DaemonConnection = context.obj
    answer, jpeg = link.ask(lambda client: client.picture())
    try:
        out.write_bytes(jpeg)
    except OSError as err:
        raise cannot_write(out, err) from None
    if as_json:
        print(json.dumps({"picture": str(out), "seq": answer.seq, "stamp_ns": answer.stamp_ns}))
    else:
        print(out)
