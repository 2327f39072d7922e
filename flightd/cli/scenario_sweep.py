"""What `flightd sim --scenario all` prints: a line for each flight that begins, and one table of all."""

from __future__ import annotations

import itertools
import json
import sys
from collections.abc import Callable, Sequence

from rich.console import Console
from rich.table import Table

from flightd.app.simulation.scenario_sweep import Prepare, SweptFlight, fly_every_hazard
from flightd.app.simulation.simulation import Simulation
from flightd.cli.flight_progress import FlightProgress
from flightd.core.errors import RunError
from flightd.mission.safety.hazard_table import HAZARDS

_HEADINGS = ("hazard", "found after", "action", "phases", "outcome", "shelf", "off line", "as it should")


def sweep(prepare: Prepare, *, as_json: bool) -> None:
    """Fly every hazard and print how it went.  RunError when one does not end as the table says."""
    flights = list(fly_every_hazard(prepare, _announced(shown=not as_json)))
    wrong = [flight.verdict.hazard for flight in flights if not flight.as_it_should]
    if as_json:
        print(json.dumps({"flights": [flight.document() for flight in flights], "wrong": wrong}, indent=2))
    else:
        _print(flights)
    if wrong:
        raise RunError(f"{len(wrong)} of {len(flights)} did not go as the table says: {', '.join(wrong)}")


def _announced(*, shown: bool) -> Callable[[str, Simulation], FlightProgress]:
    numbers = itertools.count(1)

    def observe(hazard: str, simulation: Simulation) -> FlightProgress:
        speed = "lockstep" if simulation.speed is None else "in real time"
        print(f"flightd: {next(numbers)} of {len(HAZARDS)}: {hazard}, {speed}", file=sys.stderr, flush=True)
        return FlightProgress(shown=shown)

    return observe


def _print(flights: Sequence[SweptFlight]) -> None:
    table = Table(title="Every hazard, flown", title_justify="left")
    for heading in _HEADINGS:
        table.add_column(heading)
    for flight in flights:
        v = flight.verdict
        table.add_row(
            v.hazard,
            "-" if v.found_s is None else f"{v.found_s:.2f} s",
            v.action,
            " ".join(v.phases[:6]),
            v.outcome,
            "-" if v.min_shelf_distance_m is None else f"{v.min_shelf_distance_m:.2f} m",
            f"{v.off_line_max_m:.2f} m",
            "; ".join(filter(None, (v.wrong, flight.error))) or "yes",
        )
    Console(file=sys.stdout).print(table)
