"""`flightd report`: the HTML report of a recorded flight.  It is imported when it runs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from flightd.cli.options import AsJson, Log


def register(app: typer.Typer) -> None:
    """Hang `report` on `app`."""
    app.command("report")(report)


def report(
    log: Log,
    out: Annotated[
        Path | None, typer.Option(metavar="F", help="Where to write the page; report.html beside LOG.")
    ] = None,
    inventory: Annotated[
        Path | None, typer.Option(metavar="DIR", help="What was counted; inventory.db beside LOG.")
    ] = None,
    expected: Annotated[
        Path | None, typer.Option(metavar="CSV", help="Expected stock to compare with: location,code.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Make a report of a flight: one HTML file that needs nothing else.

    truth.mcap, summary.json and inventory.db are used if they lie beside LOG.  With an inventory the page
    shows the racks by state, the evidence pictures, the exceptions and what differs from the expected stock.

    \b
    Examples:
      flightd report out/flight.mcap
      flightd report /var/lib/flightd/flight.mcap --out flight.html
      flightd report out/flight.mcap --expected stock.csv
    """
    from flightd.replay.report.page import write_report
    from flightd.studies.counted_stock import counted_beside

    page = out if out is not None else log.with_name("report.html")
    write_report(log, page, counted_beside(log, inventory, expected))
    print(json.dumps({"report": str(page)}) if as_json else page)
