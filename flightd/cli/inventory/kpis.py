"""`flightd inventory kpis`: how counting goes over time."""

from __future__ import annotations

import json
import time
from typing import TYPE_CHECKING, Annotated

import typer

from flightd.cli.inventory.records import Folder
from flightd.cli.options import AsJson
from flightd.core.terminal_text import visible

if TYPE_CHECKING:
    from collections.abc import Mapping

    from flightd.inventory.kpis.document import Kpis
    from flightd.inventory.kpis.read_rates import ReadRate

_OLDEST = 10


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("kpis")(kpis)


def kpis(
    folder: Folder,
    earlier: Annotated[
        str | None,
        typer.Option("--from", metavar="RUN", help="Changes since this run. Default: the last but one."),
    ] = None,
    later: Annotated[
        str | None, typer.Option("--to", metavar="RUN", help="Changes up to this run. Default: the last.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Show how counting goes over time.

    Each run with its pace and re-takes, how often labels known to be there are read, the age of each place's
    count, and what changed between two runs.

    \b
    Examples:
      flightd inventory kpis out/inventory
      flightd inventory kpis out/inventory --from 2026-W46 --to 2026-W47 --json
    """
    from flightd.adapters.store.for_reading import opened_for_reading
    from flightd.inventory.kpis.document import kpi_document, kpis_of

    with opened_for_reading(folder) as store:
        records, looks = store.locations(), store.looks()
    found = kpis_of(records, looks, time.time_ns(), earlier, later)
    if as_json:
        print(json.dumps(kpi_document(found), indent=1, ensure_ascii=False))
        return
    _print_runs(found)
    _print_rates("symbology", found.rates.by_symbology)
    _print_rates("module", found.rates.by_module)
    _print_ages(found)
    _print_changes(found)


def _print_runs(found: Kpis) -> None:
    from flightd.core.utc_time import utc_text

    for run in found.runs:
        pace = run.locations_per_hour
        told = f"{run.locations} locations, {run.looks} looks"
        told += f", {pace:,.0f} an hour" if pace is not None else ""
        told += f", {run.retake_share:.1%} looked at again"
        told += f", {run.withdrawn} withdrawn" if run.withdrawn else ""
        print(f"{utc_text(run.last_ns)}  {visible(run.run):<20} {told}")


def _print_rates(what: str, rates: Mapping[str, ReadRate]) -> None:
    for name, rate in rates.items():
        share = "nothing looked at again" if rate.share is None else f"{rate.share:.1%} of {rate.looks} looks"
        print(f"read again, {f'{what} {visible(name)}':<26} {share}, {rate.codes} codes")


def _print_ages(found: Kpis) -> None:
    from flightd.inventory.kpis.place_ages import median_age_s

    middle = median_age_s(found.ages)
    never = sum(age.counted_ns is None for age in found.ages)
    aged = f"median age {_age(middle)}, " if middle is not None else ""
    print(f"{len(found.ages)} places: {aged}{never} never counted")
    known = [age for age in found.ages if age.age_s is not None]
    for age in sorted(known, key=lambda age: -(age.age_s or 0.0))[:_OLDEST]:
        print(f"  {age.location:<16} {age.state:<11} counted {_age(age.age_s or 0.0)} ago")


def _print_changes(found: Kpis) -> None:
    from flightd.inventory.kpis.document import change_counts
    from flightd.inventory.kpis.run_changes import ChangeKind

    if found.compared is None:
        return
    counts = ", ".join(f"{count} {kind.value}" for kind, count in change_counts(found.changes).items())
    print(f"from {visible(found.compared[0])} to {visible(found.compared[1])}: {counts}")
    for change in found.changes:
        if change.kind in {ChangeKind.SAME, ChangeKind.UNKNOWN}:
            continue
        was, now = (", ".join(map(visible, texts)) or "-" for texts in (change.before, change.after))
        ways = [f"{visible(text)} to {place}" for text, place in change.moved_to]
        ways += [f"{visible(text)} from {place}" for text, place in change.moved_from]
        moved = f" ({', '.join(ways)})" if ways else ""
        print(f"  {change.location:<16} {change.kind:<9} {was} -> {now}{moved}")


def _age(seconds: float) -> str:
    return f"{seconds / 86400:.1f} days" if seconds >= 86400 else f"{seconds / 3600:.1f} hours"
