"""What `flightd sim` prints of many flights: a line for each that begins, and one table of all."""

from __future__ import annotations

import itertools
import json
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any

from rich.console import Console
from rich.table import Table

from flightd.app.simulation.launch import fly
from flightd.app.simulation.scenario_sweep import Prepare, SweptFlight, fly_every_hazard
from flightd.app.simulation.simulation import Simulation
from flightd.app.simulation.summary import Summary, write_results
from flightd.cli.flight_progress import FlightProgress
from flightd.core.errors import RunError
from flightd.mission.safety.hazard_table import HAZARDS

_HEADINGS = (
    "hazard", "seed", "found after", "action", "phases", "outcome", "clearance", "off leg", "too high",
    "down in", "wrong",
)  # fmt: skip


def faults_in_words(faults: Iterable[Mapping[str, Any]]) -> str:
    """The judge's faults in one line, "" for none."""
    return "; ".join(
        f"{fault['kind'].replace('_', ' ')} ({fault['value']:g}, at {fault['at_s']:g} s)" for fault in faults
    )


def sweep(prepare: Prepare, seeds: Sequence[int], *, as_json: bool) -> None:
    """Fly every hazard with each seed and print how it went.  RunError when one does not end as the table
    says."""
    announced = _announced(len(HAZARDS) * len(seeds), shown=not as_json)
    flights = list(fly_every_hazard(prepare, announced, seeds))
    wrong = [_name(flight, seeds) for flight in flights if not flight.as_it_should]
    if as_json:
        print(json.dumps({"flights": [flight.document() for flight in flights], "wrong": wrong}, indent=2))
    else:
        _print(flights)
    if wrong:
        raise RunError(f"{len(wrong)} of {len(flights)} did not go as the table says: {', '.join(wrong)}")


def fly_seeds(simulations: Iterable[Simulation], *, as_json: bool) -> None:
    """Fly each and print how it went.  RunError where the judge calls one bad."""
    summaries: list[Summary] = []
    for simulation in simulations:
        print(f"flightd: seed {simulation.seed}", file=sys.stderr, flush=True)
        started = time.monotonic()
        with FlightProgress(shown=not as_json) as progress:
            result = fly(replace(simulation, observer=progress))
        summaries.append(write_results(simulation, result, time.monotonic() - started))
    bad = [summary["seed"] for summary in summaries if summary["verdict"] != "good"]
    if as_json:
        print(json.dumps({"flights": summaries, "bad": bad}, indent=2))
    else:
        _print_seeds(summaries)
    if bad:
        raise RunError(f"{len(bad)} of {len(summaries)} flights are bad: seeds {', '.join(map(str, bad))}")


def _name(flight: SweptFlight, seeds: Sequence[int]) -> str:
    hazard = flight.verdict.hazard
    return hazard if len(seeds) == 1 else f"{hazard} with seed {flight.simulation.seed}"


def _announced(flights: int, *, shown: bool) -> Callable[[str, Simulation], FlightProgress]:
    numbers = itertools.count(1)

    def observe(hazard: str, simulation: Simulation) -> FlightProgress:
        speed = "lockstep" if simulation.speed is None else "in real time"
        number = next(numbers)
        line = f"flightd: {number} of {flights}: {hazard}, seed {simulation.seed}, {speed}"
        print(line, file=sys.stderr, flush=True)
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
            str(flight.simulation.seed),
            _number(v.found_s, "s"),
            v.action,
            " ".join(v.phases[:6]),
            v.outcome,
            _number(v.min_clearance_m, "m"),
            _number(v.off_leg_max_m, "m"),
            _number(v.max_overshoot_m, "m"),
            _number(v.down_s, "s"),
            "; ".join(filter(None, (faults_in_words(map(asdict, v.faults)), flight.error))) or "nothing",
        )
    Console(file=sys.stdout).print(table)


def _print_seeds(summaries: Sequence[Summary]) -> None:
    table = Table(title="Every seed, flown", title_justify="left")
    for heading in ("seed", "mission", "visited", "off leg, rms", "clearance", "verdict"):
        table.add_column(heading)
    for summary in summaries:
        table.add_row(
            str(summary["seed"]),
            f"{summary['mission']}: {summary['reason']}",
            f"{summary['nodes_visited']} of {summary['nodes_planned']}",
            _number(summary["cross_track_rms_m"], "m"),
            _number(summary["min_clearance_m"], "m"),
            ": ".join(filter(None, (summary["verdict"], faults_in_words(summary["faults"])))),
        )
    Console(file=sys.stdout).print(table)


def _number(value: float | None, unit: str) -> str:
    return "-" if value is None else f"{value:.2f} {unit}"
