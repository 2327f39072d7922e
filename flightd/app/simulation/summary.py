"""What a simulated flight leaves beside its logs: `summary.json`, `inventory.csv`, `truth-stock.json`."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from flightd.app.daemon import FlightResult
from flightd.app.simulation.judgement import judge_flight
from flightd.app.simulation.simulation import Simulation, truth_of
from flightd.app.simulation.stock_summary import inventory_csv
from flightd.sim.racks.stock_truth import write_truth

Summary = dict[str, Any]


def write_results(
    simulation: Simulation, result: FlightResult, wall_s: float, *, ended_by: str = ""
) -> Summary:
    """Judge the flight against the truth and write it all into the folder; returns the summary.  `ended_by`
    names what ended the flight before it was over."""
    if truth := truth_of(simulation):
        write_truth(simulation.folder / "truth-stock.json", truth, simulation.seed)
    judgement = judge_flight(simulation)
    summary = {
        **asdict(judgement.score),
        "verdict": judgement.verdict,
        "faults": [asdict(fault) for fault in judgement.faults],
        "frames": result.frames,
        "frames_dropped": result.frames_dropped,
        "dropped": result.dropped,
        "restarts": result.restarts,
        "latency_ms": result.latency_ms,
        # by any other clock a detection does not take the time that this machine takes for it
        "arrival_to_wire_ms": result.arrival_to_wire_ms if simulation.speed == 1.0 else None,
        "setpoint_interval_ms": result.setpoint_interval_ms,
        "wall_time_s": round(wall_s, 2),
        "seed": simulation.seed,
        "world": simulation.unknowns.kind,
        "plant": simulation.plant,
        "vehicle": simulation.config.vehicle.kind,
        **judgement.sensors,
        **judgement.stock,
    }
    if ended_by:
        reason = f"interrupted by {ended_by} in phase {result.phase}"
        summary |= {"mission": "aborted", "reason": reason, "verdict": "bad"}
    text = json.dumps(summary, indent=2) + "\n"
    (simulation.folder / "summary.json").write_text(text, encoding="utf-8")
    _write_inventory(simulation, result.visited)
    return summary


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
