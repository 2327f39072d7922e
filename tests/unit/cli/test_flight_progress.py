"""What the terminal shows of a flight: while it waits, what for."""

from __future__ import annotations

import contextlib
import os
import time

import pytest

from flightd.cli.flight_progress import FlightProgress
from flightd.core.snapshot import Snapshot
from flightd.core.tick import TickInput, TickOutput
from flightd.core.types import Demand, Phase
from tests.rigs.event_loops import real
from tests.rigs.waiting import until


def waiting_for(now_s: float, reason: str) -> Snapshot:
    now_ns = round(now_s * 1e9)
    output = TickOutput(None, Demand.STANDBY, Phase.PREFLIGHT, reason, "A1", 0, 3, None, None)
    return Snapshot(TickInput(now_ns), output, nodes_planned=3)


def test_without_a_vehicle_it_says_what_it_waits_for(capsys: pytest.CaptureFixture[str]) -> None:
    said: list[str] = []

    def read() -> str:
        said.append(capsys.readouterr().err)
        return "".join(said)

    with FlightProgress(shown=True) as progress:
        for tenth in range(30):
            progress(waiting_for(100.0 + 0.1 * tenth, "no telemetry from the vehicle"))
        real(until(lambda: "no telemetry" in read()))
        progress(waiting_for(103.0, "no picture from the down camera"))
    said.append(capsys.readouterr().err)
    assert [line.split("nodes  ")[1] for line in "".join(said).splitlines()] == [
        "no telemetry from the vehicle",
        "no picture from the down camera",
    ]
    assert "0%" not in "".join(said)


def test_a_stream_that_takes_nothing_holds_nobody_up(monkeypatch: pytest.MonkeyPatch) -> None:
    reads, writes = os.pipe()
    with os.fdopen(writes, "w", buffering=1) as full:
        monkeypatch.setattr("sys.stderr", full)
        os.set_blocking(writes, False)
        with contextlib.suppress(BlockingIOError):
            while True:
                os.write(writes, b"x" * 4096)
        os.set_blocking(writes, True)
        begun_s = time.process_time()
        with FlightProgress(shown=True) as progress:
            for second in range(1000):
                progress(waiting_for(100.0 + second, f"reason {second}"))
        assert time.process_time() - begun_s < 5.0  # it came back at all
        os.read(reads, 1 << 20)
    os.close(reads)
