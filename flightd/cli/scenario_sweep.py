"""`flightd sim --scenario all`: every shipped scenario flown, one after the other, and one table of them."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace

from rich.console import Console
from rich.table import Table

from flightd.app.simulation.launch import fly
from flightd.app.simulation.simulation import Simulation
from flightd.app.simulation.summary import kinematics_of
from flightd.cli.flight_progress import FlightProgress
from flightd.core.errors import RunError
from flightd.core.topics import Topic
from flightd.core.types import Event, Status
from flightd.mission.safety.hazards import HAZARDS
from flightd.replay.log import read_log
from flightd.sim.judge.verdict import ScenarioVerdict, judge
from flightd.sim.scenario.scenario import Scenario
from flightd.sim.scenario.scenario_files import load_scenario, shipped_scenarios

SHORT_ROUTE = 'mission.nodes=["A2", "A4"]'
"""On the demo site, past the place where the shipped faults begin."""


def sweep(prepare: Callable[[Scenario, str], Simulation], *, as_json: bool) -> None:
    """Fly what `prepare` makes of each scenario.  RunError when one does not end as the table says."""
    paths = shipped_scenarios()
    flights = []
    for number, row in enumerate(HAZARDS, start=1):
        scenario = load_scenario(paths[row.name])
        simulation = prepare(scenario, row.name)
        speed = "lockstep" if simulation.speed is None else "in real time"
        print(f"flightd: {number} of {len(HAZARDS)}: {row.name}, {speed}", file=sys.stderr, flush=True)
        ended = ""
        try:
            with FlightProgress(shown=not as_json) as progress:
                fly(replace(simulation, observer=progress))
        except RunError as err:
            ended = str(err)
        flights.append((simulation, verdict_of(simulation, row.name), ended))
    wrong = [verdict.hazard for _, verdict, ended in flights if verdict.wrong or ended]
    if as_json:
        rows = [
            asdict(verdict)
            | {"error": ended, "real_time": simulation.speed is not None, "seed": simulation.seed}
            for simulation, verdict, ended in flights
        ]
        print(json.dumps({"flights": rows, "wrong": wrong}, indent=2))
    else:
        _print([(verdict, ended) for _, verdict, ended in flights])
    if wrong:
        raise RunError(f"{len(wrong)} of {len(flights)} did not go as the table says: {', '.join(wrong)}")


def verdict_of(simulation: Simulation, name: str) -> ScenarioVerdict:
    """What the logs of a flight say of the hazard `name`, which its scenario expects."""
    expected = simulation.scenario.expect
    assert expected is not None
    row = next(row for row in HAZARDS if row.name == name)
    flight = read_log(simulation.flight_log, {Topic.STATUS, Topic.EVENT})
    truth = read_log(simulation.truth_log, {Topic.TRUTH, Topic.FAULT}).entries
    told = [(entry.topic, entry.message) for entry in truth if isinstance(entry.message, dict)]
    return judge(
        row,
        expected,
        simulation.site,
        [note["stamp_ns"] for topic, note in told if topic == Topic.FAULT and note["began"]],
        flight.messages(Status),
        flight.messages(Event),
        kinematics_of([entry for entry in truth if entry.topic == Topic.TRUTH]),
    )


def _print(rows: Sequence[tuple[ScenarioVerdict, str]]) -> None:
    table = Table(title="Every hazard, flown", title_justify="left")
    for heading in (
        "hazard",
        "found after",
        "action",
        "phases",
        "outcome",
        "shelf",
        "off line",
        "as it should",
    ):
        table.add_column(heading)
    for v, ended in rows:
        table.add_row(
            v.hazard,
            "-" if v.found_s is None else f"{v.found_s:.2f} s",
            v.action,
            " ".join(v.phases[:6]),
            v.outcome,
            "-" if v.min_shelf_distance_m is None else f"{v.min_shelf_distance_m:.2f} m",
            f"{v.off_line_max_m:.2f} m",
            "; ".join(filter(None, (v.wrong, ended))) or "yes",
        )
    Console(file=sys.stdout).print(table)
