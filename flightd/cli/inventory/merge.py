"""`flightd inventory merge`: the counts of several flights as one."""

from __future__ import annotations

import json
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from flightd.cli.inventory.records import Folder, states_line
from flightd.cli.options import AsJson


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("merge")(merge)


def merge(
    folder: Folder,
    others: Annotated[list[Path], typer.Argument(metavar="OTHER…", help="Inventories to take in.")],
    as_json: AsJson = False,
) -> None:
    """Take other inventories (another drone's, an earlier flight's) into FOLDER; again changes nothing.

    \b
    Examples:
      flightd inventory merge out/inventory flight-2/inventory
    """
    from flightd.adapters.store.for_reading import opened_for_reading
    from flightd.adapters.store.sqlite import SqliteStore

    with ExitStack() as opened:
        # all of them first: a folder that holds none makes no inventory and takes in no part of them
        sources = [opened.enter_context(opened_for_reading(other)) for other in others]
        store = opened.enter_context(SqliteStore(folder))
        taken = sum(map(store.merge, sources))
        records = store.locations()
    if as_json:
        print(json.dumps({"new_observations": taken, "locations": len(records)}))
        return
    print(f"{taken} new looks; {states_line(records)}")
