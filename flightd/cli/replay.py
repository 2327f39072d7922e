"""`flightd replay`: a recorded flight through today's code.  What it does is imported when it runs."""

from __future__ import annotations

import json
import math
import sys
import tomllib
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flightd.core.errors import InputError, RunError

if TYPE_CHECKING:
    from flightd.config.schema import Config
    from flightd.replay.decision_compare import Comparison
    from flightd.replay.log import FlightLog


def register(app: typer.Typer) -> None:
    """Hang `replay` on `app`."""
    app.command("replay")(replay)


def replay(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="A flight log (flight.mcap).")],
    tolerance: Annotated[
        float, typer.Option(min=0.0, help="Largest difference of a decision's number that is no failure.")
    ] = 0.0,
    pixels: Annotated[
        float, typer.Option(min=0.0, help="The same for the lines in the (compressed) pictures.")
    ] = 0.5,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON document on stdout and nothing else.")
    ] = False,
) -> None:
    """Take a recorded flight through today's code and compare every decision with the record.

    The pilot gets every recorded tick, the detector every recorded picture.  Exit 0 if they decide and
    see the same (within the tolerances), 1 if they drift.

    \b
    flightd replay out/flight.mcap
    flightd replay out/flight.mcap --tolerance 1e-6 --json
    """
    from flightd.app.build import detector_of, pilot_of
    from flightd.core.topics import Topic
    from flightd.replay.decision_compare import replay_decisions
    from flightd.replay.log import read_log
    from flightd.replay.perception_compare import replay_pictures
    from flightd.site.site_file import parse_site

    recorded = read_log(log, {Topic.TICK, Topic.DECISION, Topic.CONFIG, Topic.MAP})
    config = _config(recorded)
    site = parse_site(_document(recorded, Topic.MAP), f"{log} (map)")
    decisions = replay_decisions(recorded, pilot_of(config, site).step)
    seen = replay_pictures(log, detector_of(config, site)().detect)
    passed = decisions.within(tolerance) and seen.within(pixels)
    if as_json:
        print(json.dumps(_told(decisions) | {"pictures": asdict(seen), "passed": passed}))
    else:
        _print(decisions)
        print(
            f"{seen.pictures} pictures seen again: {seen.pairs} lines within {seen.rho_max_px:.2f} px and "
            f"{seen.theta_max_deg:.2f} degrees, {seen.gone} gone, {seen.new} new"
        )
    if not passed:
        raise RunError(f"{log}: {_complaint(decisions, tolerance)}")


def _complaint(decisions: Comparison, tolerance: float) -> str:
    if decisions.missing:
        return f"{decisions.missing} ticks or decisions are missing in the log"
    if not decisions.within(tolerance):
        return f"{decisions.differing} of {decisions.ticks} decisions drift"
    return "the pictures are seen differently"


def _config(log: FlightLog) -> Config:
    """The configuration of the flight."""
    from flightd.config.schema import recorded_config
    from flightd.core.topics import Topic

    text = _document(log, Topic.CONFIG)
    try:
        table = json.loads(text) if text.lstrip().startswith("{") else tomllib.loads(text)
    except ValueError as err:
        raise InputError(f"{log.path}: its configuration cannot be read ({err})") from None
    return recorded_config(table, log.path)


def _document(log: FlightLog, topic: str) -> str:
    from flightd.core.topics import Document

    documents = log.messages(Document, topic)
    if not documents:
        raise InputError(f"{log.path}: holds no {topic.strip('/')}, so it cannot be replayed")
    return documents[-1].text


def _told(comparison: Comparison) -> dict[str, Any]:
    return {
        "ticks": comparison.ticks,
        "identical": comparison.identical,
        "differing": comparison.differing,
        "missing": comparison.missing,
        "drift": [
            asdict(drift) | {"largest": drift.largest if math.isfinite(drift.largest) else None}
            for drift in comparison.drifts
        ],
    }


def _print(comparison: Comparison) -> None:
    if comparison.identical:
        print(f"{comparison.ticks} ticks replayed: every decision is the same")
        return
    from rich.console import Console
    from rich.table import Table

    table = Table(title=f"{comparison.differing} of {comparison.ticks} decisions drift")
    for heading in ("field", "ticks", "from", "largest", "recorded", "replayed"):
        table.add_column(heading, justify="right" if heading in {"ticks", "from", "largest"} else "left")
    for drift in sorted(comparison.drifts, key=lambda drift: (drift.first_s, drift.field)):
        largest = f"{drift.largest:.3g}" if math.isfinite(drift.largest) else ""
        table.add_row(
            drift.field, str(drift.ticks), f"{drift.first_s:.2f} s", largest, drift.recorded, drift.replayed
        )
    Console(width=None if sys.stdout.isatty() else 160).print(table)
