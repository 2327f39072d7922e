"""`flightd map import` and `flightd map export`: maps of other programs."""

from __future__ import annotations

import contextlib
import csv
import enum
import io
import json
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flightd.cli.map.site_files import Force, SiteFile, write_new
from flightd.cli.options import AsJson
from flightd.core.errors import InputError

if TYPE_CHECKING:
    from flightd.site.exchange.graph import Imported


class Kind(enum.StrEnum):
    """What a map is exported as."""

    LIF = "lif"
    CSV = "csv"
    LOCATIONS = "locations"


def register(app: typer.Typer) -> None:
    """Hang the commands under `app`."""
    app.command("import")(import_)
    app.command("export")(export)


def import_(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="VDMA LIF (.json), or nodes (.csv).")],
    out: Annotated[Path, typer.Argument(metavar="OUT", help="Site file to write.")],
    vehicle: Annotated[
        str, typer.Option(metavar="TYPE", help="Of a LIF: the ways of this vehicle type; else of all.")
    ] = "",
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Make a site file of another program's map: VDMA LIF, or a table node, x_m, y_m, joined_to, pad.

    What it could not take is said by name.  Racks are found in the stations of a LIF where their bays are
    equal; others are drawn on the page Site of flightd ground.

    \b
    Examples:
      flightd map import fleet.lif.json hall-3.toml
      flightd map import fleet.lif.json hall-3.toml --vehicle acme.drone
      flightd map import survey.csv hall-3.toml
    """
    from flightd.site.site_draft import draft_of, draft_text
    from flightd.site.site_tables import SiteTablesError, site_of

    found = _read(file, vehicle)
    try:
        site_of(found.tables)
        mistake = ""
    except SiteTablesError as err:
        mistake = str(err)
    write_new(out, draft_text(draft_of(found.tables)), force)
    if as_json:
        print(json.dumps({"file": str(out), "ok": not mistake, "mistake": mistake, "notes": found.notes}))
    else:
        print(out)
        for note in found.notes:
            print(f"  {note}")
        if mistake:
            print(f"  not sound yet: {mistake}")
    if mistake:
        raise typer.Exit(1)


def export(
    site_file: SiteFile,
    kind: Annotated[
        Kind, typer.Option("--as", help="lif: VDMA LIF; csv: the nodes; locations: their codes.")
    ] = Kind.LIF,
    out: Annotated[
        Path | None, typer.Option(metavar="F", help="Where to write; beside the site file.")
    ] = None,
    onto: Annotated[
        Path | None,
        typer.Option(metavar="LIF", help="The LIF that the site was imported from: what a site lacks stays."),
    ] = None,
    vehicle: Annotated[
        str, typer.Option(metavar="TYPE", help="With --onto: the vehicle type it was imported for.")
    ] = "",
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Write a site for another program: VDMA LIF for a fleet's manager, or tables of nodes or locations.

    What a LIF does not hold of the site is said by name.  With --onto only what has changed since the import
    changes: other vehicle types, orientations, actions, trajectories and names stay.

    \b
    Examples:
      flightd map export hall-3.toml
      flightd map export hall-3.toml --onto fleet.lif.json
      flightd map export hall-3.toml --as locations --out codes.csv
    """
    from flightd.site.exchange.lif_losses import lif_losses
    from flightd.site.exchange.map_files import EXPORTS, lif_text_onto
    from flightd.site.site_file import load_site

    if onto is not None and kind is not Kind.LIF:
        raise InputError("only a LIF is written onto another", key="--onto", remedy="leave out --as")
    if vehicle and onto is None:
        raise InputError(
            "it says of which vehicles the ways of a LIF are", key="--vehicle", remedy="give --onto LIF, too"
        )
    site, made = load_site(site_file), EXPORTS[kind]
    target = out if out is not None else site_file.with_name(f"{site_file.stem}{made.suffix}")
    now = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    if onto is None:
        text = made.write(site, now)
    else:
        with _naming(onto):
            text = lif_text_onto(_bytes_of(onto), site, now, vehicle)
    write_new(target, text, force)
    notes = lif_losses(site) if kind is Kind.LIF and onto is None else ()
    if as_json:
        print(json.dumps({"file": str(target), "notes": notes}))
        return
    print(target)
    for note in notes:
        print(f"  {note}")


@contextlib.contextmanager
def _naming(file: Path) -> Iterator[None]:
    """Refusals of what a file holds, with its name."""
    try:
        yield
    except InputError as err:
        raise InputError(err.what, file=file, key=err.key, remedy=err.remedy) from None


def _bytes_of(file: Path) -> bytes:
    from flightd.site.exchange.map_files import MOST_BYTES

    try:
        with file.open("rb") as stream:
            data = stream.read(MOST_BYTES + 1)
    except OSError as err:
        raise InputError(f"cannot read it: {err.strerror or err}") from None
    if len(data) > MOST_BYTES:
        raise InputError(f"more than {MOST_BYTES // 10**6} MB")
    return data


def _read(file: Path, vehicle: str) -> Imported:
    from flightd.site.exchange.map_files import tables_of_lif_file, text_of
    from flightd.site.exchange.node_table import tables_of_rows

    with _naming(file):
        data = _bytes_of(file)
        if file.suffix.lower() == ".json":
            return tables_of_lif_file(data, vehicle)
        if vehicle:
            raise InputError("a table of nodes has no vehicle types", remedy="leave out --vehicle")
        try:
            text = text_of(data)
            separator = max(",;\t", key=text.partition("\n")[0].count)
            rows = csv.reader(io.StringIO(text, newline=""), delimiter=separator, strict=True)
            return tables_of_rows([row for row in rows if row])
        except csv.Error as err:
            raise InputError(f"no CSV: {err}") from None
