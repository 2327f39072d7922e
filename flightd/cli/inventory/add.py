"""`flightd inventory add`: counting from photographs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from flightd.cli.inventory.records import Folder, print_records
from flightd.cli.options import AsJson


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("add")(add)


def add(
    folder: Folder,
    pictures: Annotated[
        list[Path], typer.Argument(metavar="PICTURE…", help="Pictures named after their locations.")
    ],
    run: Annotated[str, typer.Option(help="Name of this count.")] = "photographs",
    as_json: AsJson = False,
) -> None:
    """Count from photographs: each is named after its location and dated by its file.

    One code makes the location `read`, more `several`; a picture without a readable code does not prove
    the place empty and makes it `unreadable`.  The same picture again changes nothing.

    \b
    Examples:
      flightd inventory add out/inventory photographs/A-03-2-1.jpg
      flightd inventory add out/inventory photographs/
    """
    from flightd.adapters.store.sqlite import SqliteStore
    from flightd.studies.count_photographs import count_photographs
    from flightd.studies.frame_files import list_files

    files = list_files(pictures)
    with SqliteStore(folder) as store:
        records = count_photographs(store, files, run)
    if as_json:
        print(json.dumps({record.code: record.state.value for record in records}, indent=1))
        return
    print_records(records)
