"""`flightd inventory export`: the inventory for other programs."""

from __future__ import annotations

import json
import sys
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from flightd.cli.inventory.records import Folder, LeastConfidence
from flightd.core.errors import InputError, cannot_write
from flightd.core.label_values import LEAST_CONFIDENCE


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("export")(export)


def export(
    folder: Folder,
    out: Annotated[Path, typer.Option(metavar="F", help="File to write; - is stdout.")] = Path("-"),
    kind: Annotated[
        str | None,
        typer.Option("--format", help="csv, xlsx, json or epcis. Default: by the file's ending, else csv."),
    ] = None,
    gln: Annotated[
        str, typer.Option(metavar="GLN", help="EPCIS: the site's GLN; locations become its places (254).")
    ] = "",
    least_confidence: LeastConfidence = LEAST_CONFIDENCE,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print what was written as one JSON document.")
    ] = False,
) -> None:
    """Write the inventory for other programs: CSV, XLSX (extra `xlsx`), JSON, EPCIS 2.0 (.jsonld).

    \b
    Examples:
      flightd inventory export out/inventory --out stock.xlsx
      flightd inventory export out/inventory --out stock.jsonld --gln 9501101530003
      flightd inventory export out/inventory | column -s, -t
    """
    from flightd.adapters.store.for_reading import opened_for_reading
    from flightd.inventory.export.epcis import as_epcis
    from flightd.inventory.export.formats import FORMATS, STDOUT, Writer, chosen_format

    chosen = chosen_format(kind, out)
    write: Writer = chosen.write
    if gln:
        if chosen is not FORMATS["epcis"]:
            raise InputError("only EPCIS has it", key="--gln", remedy="add --format epcis")
        write = partial(as_epcis, gln=gln)
    if as_json and out == STDOUT:
        raise InputError("says what was written to a file", key="--json", remedy="add --out F")
    with opened_for_reading(folder) as store:
        data = write(store.locations(), least_confidence=least_confidence)
    if out == STDOUT:
        sys.stdout.buffer.write(data)
        return
    try:
        out.write_bytes(data)
    except OSError as err:
        raise cannot_write(out, err) from None
    print(json.dumps({"written": str(out), "bytes": len(data)}) if as_json else out)
