"""What `flightd sim` prints of many flights: a line for each that begins, and one table of all."""

from __future__ import annotations

import itertools
import json
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NoReturn, TypeVar

import typer
from rich.console import Console
from rich.table import Table

from flightd.app.simulation.launch import FlightInterruptedError, fly
from flightd.app.simulation.scenario_sweep import (
    Origin,
    Prepare,
    Routes,
    as_it_should,
    fly_every_hazard,
    hazard_scenarios,
)
from flightd.app.simulation.simulation import Simulation
from flightd.app.simulation.summary import Summary, write_results
from flightd.app.simulation.sweep_log import SweepLog, SweptRow
from flightd.cli.flight_progress import FlightProgress
from flightd.core.errors import InputError, RunError

_T = TypeVar("_T")

_HEADINGS = (
    "hazard", "seed", "found after", "action", "phases", "outcome", "clearance", "off leg", "too high",
    "down in", "wrong",
)  # fmt: skip


def faults_in_words(faults: Iterable[Mapping[str, Any]]) -> str:
    """The judge's faults in one line, "" for none."""
    return "; ".join(
        f"{fault['kind'].replace('_', ' ')} ({fault['value']:g}, at {fault['at_s']:g} s)" for fault in faults
    )


def sweep(
    prepare: Prepare, seeds: Sequence[int], log: SweepLog, origin: Origin, routes: Routes, *, as_json: bool
) -> None:
    """Fly every hazard with each seed and print how it went, also where a signal ends it: exit code 128 and
    the signal's number.  RunError when one does not end as the table says."""
    asked, rows = len(hazard_scenarios()) * len(seeds), list[SweptRow]()
    announced = _announced(len(log) + 1, asked, shown=not as_json)
    interrupted = _until_interrupted(fly_every_hazard(prepare, announced, seeds, log, origin, routes), rows)
    wrong = [_name(row, seeds) for row in rows if not as_it_should(row)]
    if as_json:
        print(json.dumps({"flights": rows, "wrong": wrong, "interrupted": _signal(interrupted)}, indent=2))
    else:
        _print(rows)
    if interrupted is not None:
        _leave(interrupted, f"{len(rows)} of {asked} flights; the same command goes on with the rest")
    if wrong:
        raise RunError(f"{len(wrong)} of {len(rows)} did not go as the table says: {', '.join(wrong)}")


def fly_seeds(simulations: Iterable[Simulation], *, as_json: bool) -> None:
    """Fly each and print how it went, also where a signal ends it: exit code 128 and the signal's number.
    What goes wrong with one flight is its row's error.  RunError where one failed or is called bad."""
    summaries: list[Summary] = []
    interrupted = _until_interrupted(_each_flown(simulations, shown=not as_json), summaries)
    bad = [summary["seed"] for summary in summaries if summary["verdict"] != "good"]
    if as_json:
        print(json.dumps({"flights": summaries, "bad": bad, "interrupted": _signal(interrupted)}, indent=2))
    else:
        _print_seeds(summaries)
    if interrupted is not None:
        _leave(interrupted, f"{len(summaries)} flight{'s' * (len(summaries) != 1)}")
    if bad:
        raise RunError(f"{len(bad)} of {len(summaries)} flights are bad: seeds {', '.join(map(str, bad))}")


def _each_flown(simulations: Iterable[Simulation], *, shown: bool) -> Iterator[Summary]:
    for simulation in simulations:
        print(f"flightd: seed {simulation.seed}", file=sys.stderr, flush=True)
        started = time.monotonic()
        try:
            with FlightProgress(shown=shown) as progress:
                result = fly(replace(simulation, observer=progress))
            summary = write_results(simulation, result, time.monotonic() - started)
        except FlightInterruptedError:
            raise
        except (RunError, InputError) as err:  # it failed, or what it recorded cannot be read
            summary = {"seed": simulation.seed, "verdict": "not judged", "error": str(err)}
        yield summary


def _until_interrupted(flights: Iterator[_T], flown: list[_T]) -> FlightInterruptedError | None:
    """Each that ends goes to `flown`; the error of the signal that ended it, None where all were flown."""
    try:
        flown.extend(flights)
    except FlightInterruptedError as err:
        return err
    return None


def _signal(interrupted: FlightInterruptedError | None) -> str:
    return "" if interrupted is None else interrupted.signal.name


def _leave(interrupted: FlightInterruptedError, flown: str) -> NoReturn:
    print(f"flightd: interrupted by {interrupted.signal.name} after {flown}", file=sys.stderr, flush=True)
    raise typer.Exit(128 + interrupted.signal)


def _name(row: SweptRow, seeds: Sequence[int]) -> str:
    hazard: str = row["hazard"]
    return hazard if len(seeds) == 1 else f"{hazard} with seed {row['seed']}"


def _announced(first: int, flights: int, *, shown: bool) -> Callable[[str, Simulation], FlightProgress]:
    numbers = itertools.count(first)

    def observe(hazard: str, simulation: Simulation) -> FlightProgress:
        speed = "lockstep" if simulation.speed is None else "in real time"
        number = next(numbers)
        line = f"flightd: {number} of {flights}: {hazard}, seed {simulation.seed}, {speed}"
        print(line, file=sys.stderr, flush=True)
        return FlightProgress(shown=shown)

    return observe


def _print(rows: Sequence[SweptRow]) -> None:
    table = Table(title="Every hazard, flown", title_justify="left")
    for heading in _HEADINGS:
        table.add_column(heading)
    for row in rows:
        table.add_row(
            row["hazard"],
            str(row["seed"]),
            _number(row["found_s"], "s"),
            row["action"],
            " ".join(row["phases"][:6]),
            row["outcome"],
            _number(row["min_clearance_m"], "m"),
            _number(row["off_leg_max_m"], "m"),
            _number(row["max_overshoot_m"], "m"),
            _number(row["down_s"], "s"),
            "; ".join(filter(None, (faults_in_words(row["faults"]), row["error"]))) or "nothing",
        )
    Console(file=sys.stdout).print(table)


def _print_seeds(summaries: Sequence[Summary]) -> None:
    table = Table(title="Every seed, flown", title_justify="left")
    for heading in ("seed", "mission", "visited", "off leg, rms", "clearance", "verdict"):
        table.add_column(heading)
    for summary in summaries:
        if "error" in summary:
            verdict = f"{summary['verdict']}: {summary['error']}"
            table.add_row(str(summary["seed"]), *["-"] * 4, verdict)
            continue
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
