"""What a simulated flight leaves beside its logs: `summary.json`, `inventory.csv`, `truth-stock.json`."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from dataclasses import fields
from typing import Any

from flightd.app.daemon import FlightResult
from flightd.app.simulation.simulation import Simulation, truth_of
from flightd.app.simulation.stock_summary import inventory_csv, stock_summary
from flightd.core.topics import Topic
from flightd.core.types import Event, Status
from flightd.replay.log import Entry, read_log
from flightd.sim.judge.flight_score import as_summary, score
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.racks.stock_truth import write_truth

Summary = dict[str, Any]


def write_results(
    simulation: Simulation, result: FlightResult, wall_s: float, *, ended_by: str = ""
) -> Summary:
    """Score the flight against the truth and write it all into the folder; returns the summary.  `ended_by`
    names what ended the flight before it was over."""
    if truth := truth_of(simulation):
        write_truth(simulation.folder / "truth-stock.json", truth, simulation.seed)
    summary = _summary(simulation, result, wall_s)
    summary |= stock_summary(simulation, summary["flight_time_s"])
    if ended_by:
        summary |= {"mission": "aborted", "reason": f"interrupted by {ended_by} in phase {result.phase}"}
    text = json.dumps(summary, indent=2) + "\n"
    (simulation.folder / "summary.json").write_text(text, encoding="utf-8")
    _write_inventory(simulation, result.visited)
    return summary


def kinematics_of(entries: Sequence[Entry]) -> list[Kinematics]:
    """The truth's own fields out of a log's messages, which viewers' fields stand beside."""
    names = [field.name for field in fields(Kinematics)]
    return [
        Kinematics(**{name: entry.message[name] for name in names})
        for entry in entries
        if isinstance(entry.message, dict)
    ]


def _summary(simulation: Simulation, result: FlightResult, wall_s: float) -> Summary:
    flight = read_log(simulation.flight_log, {Topic.STATUS, Topic.EVENT})
    measured = score(
        simulation.scenario.floor.site(simulation.site),
        simulation.plan(),
        flight.messages(Status),
        flight.messages(Event),
        kinematics_of(read_log(simulation.truth_log, {Topic.TRUTH}).entries),
    )
    return {
        **as_summary(measured),
        "frames": result.frames,
        "frames_dropped": result.frames_dropped,
        "latency_ms": result.latency_ms,
        "setpoint_interval_ms": result.setpoint_interval_ms,
        "wall_time_s": round(wall_s, 2),
        "seed": simulation.seed,
        "vehicle": simulation.config.vehicle.kind,
    }


def _write_inventory(simulation: Simulation, visited: Sequence[str]) -> None:
    """What was counted, or where nothing is counted, what was visited."""
    path = simulation.folder / "inventory.csv"
    if (data := inventory_csv(simulation.folder)) is not None:
        path.write_bytes(data)
        return
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(["node", "visit", "code"])
        rows.writerows([node, i, ""] for i, node in enumerate(visited, start=1))
