"""`flightd inventory show`: what stands where."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from flightd.cli.inventory.records import Folder, LeastConfidence, print_records, states_line, undecided_words
from flightd.cli.options import AsJson
from flightd.core.errors import InputError
from flightd.core.label_values import LEAST_CONFIDENCE
from flightd.core.terminal_text import visible

if TYPE_CHECKING:
    from flightd.core.inventory import LocationRecord, Observation


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("show")(show)


def show(
    folder: Folder,
    location: Annotated[
        str | None, typer.Option(metavar="CODE", help="Every look at this one location.")
    ] = None,
    least_confidence: LeastConfidence = LEAST_CONFIDENCE,
    as_json: AsJson = False,
) -> None:
    """Show the state of every location, or the history of one.

    Beside the codes stand what was read there and stayed undecided, and lot, expiry, fill with overhang and
    lean, and cases, where they are known. With --json each has all that its labels tell: dates, quantity,
    weights.

    \b
    Examples:
      flightd inventory show out/inventory
      flightd inventory show out/inventory --location A-03-2-1
    """
    from flightd.adapters.store.for_reading import opened_for_reading
    from flightd.core.inventory import KnownLocations

    with opened_for_reading(folder) as store:
        records = store.locations()
        if location is None:
            _show_records(records, as_json, least_confidence)
            return
        code = KnownLocations(record.code for record in records).spelled(location)
        if all(record.code != code for record in records):
            remedy = f"flightd inventory show {folder} lists what it knows"
            raise InputError(f"knows no location {location!r}", file=folder, remedy=remedy)
        _show_history(code, store.history(code), as_json, least_confidence)


def _show_records(records: Sequence[LocationRecord], as_json: bool, least_confidence: float) -> None:
    from flightd.inventory.export.json_document import location_json

    if as_json:
        states = Counter(record.state.value for record in records)
        told = [location_json(record, least_confidence) for record in records]
        document = {"states": dict(states), "locations": told}
        print(json.dumps(document, indent=1, ensure_ascii=False))
        return
    print_records(records, least_confidence)
    print(states_line(records))


def _show_history(
    location: str, looks: Sequence[Observation], as_json: bool, least_confidence: float
) -> None:
    from flightd.core.utc_time import utc_text
    from flightd.inventory.export.json_document import observation_json

    if as_json:
        observations = [observation_json(seen, least_confidence) for seen in looks]
        document = {"location": location, "observations": observations}
        print(json.dumps(document, indent=1, ensure_ascii=False))
        return
    for seen in looks:
        texts = ", ".join(visible(read.text) for read in seen.reads)
        told = "  ".join(filter(None, (texts, *undecided_words(seen))))
        print(f"{utc_text(seen.utc_ns)}  {seen.state:<11} {seen.confidence:.2f}  {told}".rstrip())
