"""`flightd inventory plan`: the locations of a site, known before anybody looks."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from flightd.cli.inventory.records import Folder, states_line
from flightd.cli.options import AsJson
from flightd.core.errors import InputError


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("plan")(plan)


def plan(
    folder: Folder,
    site_file: Annotated[Path, typer.Argument(metavar="SITE", help="Site file with racks, TOML.")],
    as_json: AsJson = False,
) -> None:
    """Make every location of a site known to the inventory, not visited until somebody looks.

    \b
    Examples:
      flightd inventory plan out/inventory hall-3.toml
    """
    from flightd.adapters.store.sqlite import SqliteStore
    from flightd.core.inventory import PlannedLocation
    from flightd.site.site_file import load_site

    site = load_site(site_file)
    if not site.locations:
        raise InputError("has no locations", file=site_file, remedy="add a [[rack]]")
    with SqliteStore(folder) as store:
        places = site.locations.values()
        planned = (PlannedLocation(place.code, place.node, place.pallets_deep) for place in places)
        store.plan(planned, site.name)
        records = store.locations()
    print(json.dumps({"locations": len(records)}) if as_json else states_line(records))
