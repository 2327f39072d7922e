"""`flightd inventory`: what was counted, out to other programs, and against the books."""

from __future__ import annotations

import json
import sys
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flightd.core.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from flightd.core.inventory import LocationRecord

Folder = Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder of the inventory.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON document on stdout and nothing else.")]

_SUFFIXES = {".csv": "csv", ".xlsx": "xlsx", ".json": "json", ".jsonld": "epcis"}


def register(app: typer.Typer) -> None:
    """Hang `inventory plan`, `show`, `add`, `export`, `compare` and `merge` on `app`."""
    group = typer.Typer(no_args_is_help=True, rich_markup_mode=None)
    for command in (plan, show, add, export, compare, merge):
        group.command(command.__name__)(command)
    app.add_typer(group, name="inventory", help="What was counted: plan, show, add, export, compare, merge.")


def plan(
    folder: Folder,
    site_file: Annotated[Path, typer.Argument(metavar="SITE", help="Site file with racks, TOML.")],
    as_json: AsJson = False,
) -> None:
    """Make every location of a site known to the inventory, not visited until somebody looks.

    \b
    flightd inventory plan out/inventory hall-3.toml
    """
    from flightd.adapters.store.sqlite import SqliteStore
    from flightd.core.inventory import PlannedLocation
    from flightd.site.site_file import load_site

    site = load_site(site_file)
    if not site.locations:
        raise InputError(f"{site_file}: has no locations; add a [[rack]]")
    with SqliteStore(folder) as store:
        store.plan(PlannedLocation(location.code, location.node) for location in site.locations.values())
        records = store.locations()
    print(json.dumps({"locations": len(records)}) if as_json else _states(records))


def show(
    folder: Folder,
    location: Annotated[
        str | None, typer.Option(metavar="CODE", help="Every look at this one location.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Show the state of every location, or the history of one.

    \b
    flightd inventory show out/inventory
    flightd inventory show out/inventory --location A-03-2-1
    """
    from flightd.adapters.store.sqlite import SqliteStore
    from flightd.inventory.formats import location_json, observation_json, utc_text

    with SqliteStore(folder, create=False) as store:
        records = store.locations()
        if location is not None:
            _known(location, records, folder)
            looks = store.history(location)
            if as_json:
                document = {"location": location, "observations": [observation_json(seen) for seen in looks]}
                print(json.dumps(document, indent=1, ensure_ascii=False))
                return
            for seen in looks:
                texts = ", ".join(_visible(read.text) for read in seen.reads)
                print(f"{utc_text(seen.utc_ns)}  {seen.state:<11} {seen.confidence:.2f}  {texts}".rstrip())
            return
    if as_json:
        states = Counter(record.state.value for record in records)
        locations = [location_json(record) for record in records]
        print(json.dumps({"states": dict(states), "locations": locations}, indent=1, ensure_ascii=False))
        return
    for record in records:
        print(f"{record.code:<16} {record.state:<11}  {', '.join(map(_visible, record.texts))}".rstrip())
    print(_states(records))


def add(
    folder: Folder,
    pictures: Annotated[
        list[Path], typer.Argument(metavar="PICTURE…", help="Pictures named after their locations.")
    ],
    run: Annotated[str, typer.Option(help="Name of this count.")] = "photographs",
    as_json: AsJson = False,
) -> None:
    """Count from photographs: each is named after its location and dated by its file.

    One code makes the location `read`, more `several`; a picture without a readable code does not prove
    the place empty and makes it `unreadable`.  The same picture again changes nothing.

    \b
    flightd inventory add out/inventory photographs/A-03-2-1.jpg
    flightd inventory add out/inventory photographs/
    """
    from flightd.cli.inventory_count import count_pictures

    records = count_pictures(folder, pictures, run)
    if as_json:
        print(json.dumps({record.code: record.state.value for record in records}, indent=1))
        return
    for record in records:
        print(f"{record.code:<16} {record.state:<11}  {', '.join(map(_visible, record.texts))}".rstrip())


def export(
    folder: Folder,
    out: Annotated[Path, typer.Option(metavar="F", help="File to write; - is stdout.")] = Path("-"),
    kind: Annotated[
        str | None,
        typer.Option("--format", help="csv, xlsx, json or epcis. Default: by the file's ending, else csv."),
    ] = None,
) -> None:
    """Write the inventory for other programs: CSV, XLSX (extra `xlsx`), JSON, EPCIS 2.0 (.jsonld).

    \b
    flightd inventory export out/inventory --out stock.xlsx
    flightd inventory export out/inventory --format epcis --out stock.jsonld
    """
    from flightd.adapters.store.sqlite import SqliteStore
    from flightd.inventory.formats import FORMATS

    chosen = kind or _SUFFIXES.get(out.suffix.lower(), "csv")
    if chosen not in FORMATS:
        raise InputError(f"--format {chosen}: unknown; choose one of {', '.join(FORMATS)}")
    with SqliteStore(folder, create=False) as store:
        data = FORMATS[chosen](store.locations())
    if str(out) == "-":
        sys.stdout.buffer.write(data)
        return
    try:
        out.write_bytes(data)
    except OSError as err:
        raise InputError(f"{out}: cannot write: {err.strerror or err}") from None
    print(out)


def compare(
    folder: Folder,
    expected: Annotated[
        Path, typer.Argument(metavar="EXPECTED", help="CSV with the columns location and code.")
    ],
    recount: Annotated[
        Path | None, typer.Option(metavar="F", help="Write a mission over the doubtful locations here.")
    ] = None,
    config: Annotated[
        Path | None, typer.Option(metavar="F", help="Configuration that the re-count mission follows.")
    ] = None,
    least_confidence: Annotated[
        float, typer.Option(min=0.0, max=1.0, help="Matches below are counted again.")
    ] = 0.5,
    as_json: AsJson = False,
) -> None:
    """Compare the count with the expected stock.

    EXPECTED has one line for each code; a location without a code must be empty.  Outcomes: match,
    missing, unexpected, moved, wrong, empty_but_expected, and uncounted where nobody could see.

    \b
    flightd inventory compare out/inventory stock.csv
    flightd inventory compare out/inventory stock.csv --recount recount.toml --config hall.toml
    """
    from flightd.adapters.store.sqlite import SqliteStore
    from flightd.cli.inventory_count import read_stock, write_recount
    from flightd.inventory.comparison import ComparisonOutcome, compare_stock, doubtful_locations

    if (recount is None) != (config is None):
        raise InputError("--recount and --config: give both, the mission needs a configuration")
    stock = read_stock(expected)
    with SqliteStore(folder, create=False) as store:
        records = store.locations()
    lines = compare_stock(records, stock)
    doubtful = doubtful_locations(lines, records, least_confidence)
    counts = Counter(line.outcome for line in lines)
    unreachable: list[str] = []
    if recount and config:
        unreachable = write_recount(recount, config, doubtful, records)
    if as_json:
        document = {
            "outcomes": {outcome.value: counts[outcome] for outcome in ComparisonOutcome},
            "lines": [
                {
                    "outcome": line.outcome.value,
                    "location": line.location,
                    "text": line.text,
                    "found": line.found,
                    "found_at": line.found_at,
                    "confidence": line.confidence,
                }
                for line in lines
            ],
            "recount": doubtful,
            "recount_without_node": unreachable,
        }
        print(json.dumps(document, indent=1, ensure_ascii=False))
        return
    for line in lines:
        if line.outcome is not ComparisonOutcome.MATCH:
            more = f" at {line.found_at}" if line.found_at else ""
            more += f": {_visible(line.found)} is there" if line.found else ""
            print(f"{line.location:<16} {line.outcome.value:<18} {_visible(line.text)}{more}")
    print(", ".join(f"{counts[outcome]} {outcome.value}" for outcome in ComparisonOutcome))
    if unreachable:
        print(f"no node known, not in the mission: {', '.join(unreachable)}")


def merge(
    folder: Folder,
    others: Annotated[list[Path], typer.Argument(metavar="OTHER…", help="Inventories to take in.")],
    as_json: AsJson = False,
) -> None:
    """Take other inventories (another drone's, an earlier flight's) into FOLDER; again changes nothing.

    \b
    flightd inventory merge out/inventory flight-2/inventory
    """
    from flightd.adapters.store.sqlite import SqliteStore

    taken = 0
    with SqliteStore(folder) as store:
        for other in others:
            with SqliteStore(other, create=False) as source:
                taken += store.merge(source)
        records = store.locations()
    if as_json:
        print(json.dumps({"new_observations": taken, "locations": len(records)}))
        return
    print(f"{taken} new looks; {_states(records)}")


def _known(location: str, records: Sequence[LocationRecord], folder: Path) -> None:
    if all(record.code != location for record in records):
        raise InputError(f"{folder}: knows no location {location!r}")


def _states(records: Sequence[LocationRecord]) -> str:
    states = Counter(record.state.value for record in records)
    return f"{len(records)} locations: " + ", ".join(f"{n} {state}" for state, n in states.most_common())


def _visible(text: str) -> str:
    """Control characters as escapes: a terminal obeys none of what a label says."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
