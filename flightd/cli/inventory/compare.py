"""`flightd inventory compare`: the count against the books."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flightd.cli.inventory.records import Folder
from flightd.cli.options import AsJson
from flightd.core.errors import InputError
from flightd.core.terminal_text import visible

if TYPE_CHECKING:
    from flightd.inventory.comparison import Difference
    from flightd.inventory.expected_stock import UnknownLocation
    from flightd.inventory.recount import RecountModel


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("compare")(compare)


def compare(
    folder: Folder,
    expected: Annotated[
        Path, typer.Argument(metavar="EXPECTED", help="CSV with the columns location and code.")
    ],
    recount: Annotated[
        Path | None, typer.Option(metavar="F", help="Write a mission over the doubtful locations here.")
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option(
            metavar="F", help="Configuration that the re-count mission follows. Default: the log's."
        ),
    ] = None,
    log: Annotated[
        Path | None,
        typer.Option(
            metavar="F", help="Flight log that knows site and configuration; flight.mcap in FOLDER."
        ),
    ] = None,
    aisles: Annotated[str, typer.Option(metavar="A,B", help="Re-count in these aisles only.")] = "",
    nodes: Annotated[str, typer.Option(metavar="A2,B1", help="Re-count at these nodes only.")] = "",
    locations: Annotated[str, typer.Option(metavar="CODE,…", help="Re-count these locations only.")] = "",
    states: Annotated[
        str, typer.Option(metavar="STATE,…", help="Re-count locations in these states only.")
    ] = "",
    reasons: Annotated[
        str,
        typer.Option(
            metavar="WHY,…", help="Re-count for these reasons only: an outcome, a state, confidence."
        ),
    ] = "",
    at_most: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Re-count so many locations, differences first.")
    ] = None,
    least_confidence: Annotated[
        float, typer.Option(min=0.0, max=1.0, help="Matches below are counted again.")
    ] = 0.5,
    as_json: AsJson = False,
) -> None:
    """Compare the count with the expected stock.

    EXPECTED has one line for each code; a location without a code must be empty.  Outcomes: match,
    missing, unexpected, moved, wrong, empty_but_expected, and uncounted where nobody could see.
    Locations of EXPECTED that the count does not know are named with their line on stderr.

    \b
    Examples:
      flightd inventory compare out/inventory stock.csv
      flightd inventory compare out/sim stock.csv --recount recount.toml --aisles A --at-most 20
      flightd inventory compare out/inventory stock.csv --recount recount.toml --config hall-flight.toml
    """
    from flightd.adapters.store.for_reading import opened_for_reading
    from flightd.inventory.comparison import compare_stock, comparison_document, doubtful_locations
    from flightd.inventory.expected_stock import read_stock, unknown_locations
    from flightd.inventory.recount import RecountMission, write_recount
    from flightd.inventory.recount_choice import RecountChoice

    choice = RecountChoice(
        aisles=_names(aisles),
        nodes=_names(nodes),
        locations=_names(locations),
        states=_names(states),
        reasons=_names(reasons),
        at_most=at_most,
    )
    stock = read_stock(expected)
    with opened_for_reading(folder) as store:
        records = store.locations()
    unknown = unknown_locations(expected, {record.code for record in records})
    model = _model(folder, config, log) if recount or choice.aisles else None
    aisle_of = {node.id: node.aisle for node in model.site.nodes.values()} if model else {}
    lines = compare_stock(records, stock)
    doubtful = choice.of(doubtful_locations(lines, records, least_confidence), records, aisle_of)
    mission = RecountMission((), ())
    if recount is not None and model is not None:
        mission = write_recount(recount, model, doubtful, records)
    _tell(unknown, expected, folder)
    if as_json:
        document = comparison_document(lines, doubtful, mission.without_node)
        document["recount_nodes"] = list(mission.nodes)
        document["unknown_locations"] = [
            {"location": place.location, "line": place.line} for place in unknown
        ]
        print(json.dumps(document, indent=1, ensure_ascii=False))
        return
    _print(lines)
    if mission.without_node:
        print(f"no node known, not in the mission: {', '.join(mission.without_node)}")
    if recount is not None:
        counted = len(doubtful) - len(mission.without_node)
        print(f"{recount}: {counted} locations again at {', '.join(mission.nodes)}")


def _names(listed: str) -> tuple[str, ...]:
    return tuple(filter(None, (name.strip() for name in listed.split(","))))


def _model(folder: Path, config: Path | None, log: Path | None) -> RecountModel:
    """What the re-count is flown like: the configuration that is given, or else that of the log."""
    from flightd.app.recording import SETTING_TOPICS, recorded_setting
    from flightd.inventory.recount import model_of_file, model_of_flight
    from flightd.replay.log import read_log

    if config is not None and log is not None:
        raise InputError("give one of them", key="--config and --log")
    if config is not None:
        return model_of_file(config)
    recorded = log if log is not None else folder / "flight.mcap"
    if log is None and not recorded.exists():
        raise InputError(
            "no flight.mcap beside the inventory says how to fly",
            file=folder,
            remedy="add --log FLIGHT.mcap or --config F",
        )
    setting = recorded_setting(read_log(recorded, SETTING_TOPICS))
    return model_of_flight(setting.config, setting.site)


def _tell(unknown: Sequence[UnknownLocation], expected: Path, folder: Path) -> None:
    """What is misspelt in the books must not look like a location that merely was not seen."""
    for place in unknown:
        told = f"{expected}: line {place.line}: {visible(place.location)}: {folder} knows no such location"
        print(f"flightd: {told}; correct it, or plan it", file=sys.stderr)


def _print(lines: Sequence[Difference]) -> None:
    from flightd.inventory.comparison import ComparisonOutcome, outcome_counts

    for line in lines:
        if line.outcome is not ComparisonOutcome.MATCH:
            more = f" at {line.found_at}" if line.found_at else ""
            more += f": {visible(line.found)} is there" if line.found else ""
            print(f"{line.location:<16} {line.outcome.value:<18} {visible(line.text)}{more}")
    print(", ".join(f"{count} {outcome.value}" for outcome, count in outcome_counts(lines).items()))
