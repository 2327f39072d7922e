"""What the terminal shows of a flight: while it waits, what for."""

from __future__ import annotations

import pytest

from flightd.cli.flight_progress import FlightProgress
from flightd.core.snapshot import Snapshot
from flightd.core.tick import TickInput, TickOutput
from flightd.core.types import Demand, Phase


def waiting_for(now_s: float, reason: str) -> Snapshot:
    now_ns = round(now_s * 1e9)
    output = TickOutput(None, Demand.STANDBY, Phase.PREFLIGHT, reason, "A1", 0, 3, None, None)
    return Snapshot(TickInput(now_ns), output, nodes_planned=3)


def test_without_a_vehicle_it_says_what_it_waits_for(capsys: pytest.CaptureFixture[str]) -> None:
    with FlightProgress(shown=True) as progress:
        for tenth in range(30):
            progress(waiting_for(100.0 + 0.1 * tenth, "no telemetry from the vehicle"))
        progress(waiting_for(103.0, "no picture from the down camera"))
    said = capsys.readouterr().err.splitlines()
    assert [line.split("nodes  ")[1] for line in said] == [
        "no telemetry from the vehicle",
        "no picture from the down camera",
    ]
    assert "0%" not in "".join(said)
