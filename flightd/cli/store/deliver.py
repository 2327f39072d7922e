"""`flightd store deliver` and `prune`: from a drone's folders into the store, and away from there."""

from __future__ import annotations

import json
import platform
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Final
from unicodedata import category

import typer

from flightd.cli.options import AsJson
from flightd.cli.store.options import Pictures, StoreOrStation, Unless, between_flights
from flightd.core.errors import InputError

_OF_NO_NAME: Final = {"Cc", "Zl", "Zp"}
"""Categories of Unicode: control signs and ends of lines."""


def register(app: typer.Typer) -> None:
    """Hang the commands under `app`."""
    app.command("deliver")(deliver)
    app.command("prune")(prune)


def deliver(
    paths: Annotated[
        list[Path],
        typer.Argument(metavar="PATH…", exists=True, help="Folders, an inventory.db, or flight logs."),
    ],
    store: StoreOrStation,
    evidence: Pictures = None,
    site: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            envvar="FLIGHTD_SITE",
            help="Of which site all is.  Default: as each inventory says, else the flight log beside it.",
            show_default=False,
        ),
    ] = "",
    source: Annotated[
        str,
        typer.Option(metavar="NAME", help="Who delivers, for the store's books.  Default: this machine."),
    ] = "",
    unless: Unless = None,
    as_json: AsJson = False,
) -> None:
    """Deliver inventories with their pictures, flights, and decisions to the store.

    What is told to be delivered is on the store's disk.  However often it is cut and begun again, nothing is
    lost and nothing is there twice.  The folders are only read.  What cannot be delivered is told in a line,
    and costs the others nothing; the command ends with exit 1 then, with 2 where a clock is wrong.

    \b
    Examples:
      flightd store deliver out --store counts.db
      flightd store deliver /var/lib/flightd --store postgresql://flightd@db/counts --evidence /srv/evidence
      FLIGHTD_STORE_KEY=… flightd store deliver /var/lib/flightd --store https://ground.hall:8443
      flightd store deliver /var/lib/flightd --store counts.db --unless /run/flightd/armed
    """
    from flightd.ground.ground_store.between_flights import FlightBeganError
    from flightd.ground.ground_store.deliver_folder import deliver_paths
    from flightd.ground.ground_store.sender import Delivered

    for key, name in {"--site": site, "--source": source}.items():
        if any(category(sign) in _OF_NO_NAME for sign in name):
            raise InputError("is no name", key=f"{key} {name!r}", remedy="give one of a line, without tabs")
    done, stopped = Delivered(), ""
    try:
        with between_flights(store, evidence, unless) as into:
            deliver_paths(paths, site, source or platform.node(), into, done)
    except FlightBeganError as err:
        stopped = str(err)
    finally:
        for failure in done.failures:
            print(f"flightd: {failure}", file=sys.stderr)
    if as_json:
        print(json.dumps(asdict(done) | ({"stopped": stopped} if unless else {})))
    else:
        print(
            f"{done.looks} looks delivered, {done.changed} changed, {done.already} were there already; "
            f"{done.pictures} pictures, {done.flights} flights, {done.decisions} decisions"
        )
        if stopped:
            print(stopped)
    done.check_clocks()
    if done.failures:
        raise typer.Exit(1)


def prune(
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", exists=True, file_okay=False, help="Folder of an inventory.")
    ],
    store: StoreOrStation,
    evidence: Pictures = None,
    unless: Unless = None,
    as_json: AsJson = False,
) -> None:
    """Take away what the store has of an inventory's older runs: looks, and their pictures.

    The newest run stays whole, and so does each place's newest look: the inventory says the same as before.
    The store is asked for each look and each picture; what it has not stays.

    \b
    Examples:
      flightd store prune /var/lib/flightd/inventory --store counts.db
    """
    from flightd.ground.ground_store.between_flights import FlightBeganError
    from flightd.ground.ground_store.prune import Pruned
    from flightd.ground.ground_store.prune import prune as prune_folder

    pruned, stopped = Pruned(0, 0, 0), ""
    try:
        with between_flights(store, evidence, unless, made=False) as into:
            pruned = prune_folder(folder, into)
    except FlightBeganError as err:
        stopped = str(err)
    if as_json:
        print(json.dumps(asdict(pruned) | ({"stopped": stopped} if unless else {})))
        return
    kept = f"; {pruned.stay} older looks are not in the store and stay" if pruned.stay else ""
    print(f"{pruned.looks} looks and {pruned.pictures} pictures taken away{kept}")
    if stopped:
        print(stopped)
