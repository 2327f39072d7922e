"""`flightd store show`: what the store holds."""

from __future__ import annotations

import json

import typer

from flightd.cli.options import AsJson
from flightd.cli.store.options import Pictures, Store, opened_to_read


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("show")(show)


def show(store: Store, evidence: Pictures = None, as_json: AsJson = False) -> None:
    """Say how much the store holds, the newest runs of each site, and how many of its places are asked for.

    \b
    Examples:
      flightd store show --store counts.db
    """
    from flightd.core.utc_time import utc_text

    with opened_to_read(store, evidence) as found:
        counts = found.counts()
        sites = [site["site"] for site in found.sites()]
        runs = {site: found.runs(site, limit=5) for site in sites}
        asked = {site: sorted(found.open_places(site)) for site in sites}
    if as_json:
        print(json.dumps({"holds": counts, "newest_runs": runs, "asked_places": asked}))
        return
    print(", ".join(f"{number} {what}" for what, number in counts.items()))
    for site, newest in runs.items():
        for run in newest:
            print(f"{site:<20} {run['run']:<24} {utc_text(run['began_ns'])}  {run['looks']} looks")
        if asked[site]:
            print(f"{site:<20} {len(asked[site])} places are asked for, and not looked at since")
