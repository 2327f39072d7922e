"""`flightd store export`: the store's tables as Parquet."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from flightd.cli.options import AsJson
from flightd.cli.store.options import Store, opened_to_read


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("export")(export)


def export(
    store: Store,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder to write to; it is made.")],
    site: Annotated[str, typer.Option(metavar="NAME", help="Of this site alone.")] = "",
    as_json: AsJson = False,
) -> None:
    """Write observations.parquet and differences.parquet (extra `parquet`), for DuckDB, pandas and the like.

    \b
    Examples:
      flightd store export --store counts.db --out tables
      duckdb -c "SELECT run, count(*) FROM 'tables/observations.parquet' GROUP BY run"
    """
    with opened_to_read(store, None) as found:
        written = found.export(site, out)
    if as_json:
        print(json.dumps({"folder": str(out), "rows": written}))
        return
    for name, rows in written.items():
        print(f"{out / name}.parquet: {rows} rows")
