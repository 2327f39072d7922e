"""`flightd store show`: what the store holds."""

from __future__ import annotations

import json

import typer

from flightd.cli.options import AsJson
from flightd.cli.store.options import Pictures, Store, opened


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("show")(show)


def show(store: Store, evidence: Pictures = None, as_json: AsJson = False) -> None:
    """Say how much the store holds, and the newest runs of each site.

    \b
    Examples:
      flightd store show --store counts.db
    """
    from flightd.core.utc_time import utc_text

    with opened(store, evidence) as found:
        counts = found.counts()
        runs = {site["site"]: found.runs(site["site"], limit=5) for site in found.sites()}
    if as_json:
        print(json.dumps({"holds": counts, "newest_runs": runs}))
        return
    print(", ".join(f"{number} {what}" for what, number in counts.items()))
    for site, newest in runs.items():
        for run in newest:
            print(f"{site:<20} {run['run']:<24} {utc_text(run['began_ns'])}  {run['looks']} looks")
