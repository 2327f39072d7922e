"""How long a hazard's landing took, as the judge counts."""

from __future__ import annotations

import pytest

from flightd.core.types import Phase, Status
from flightd.mission.safety.hazard_table import HAZARDS
from flightd.sim.judge.expectation import Expectation
from flightd.sim.judge.flight_score import score
from flightd.sim.judge.hazard_verdict import HazardVerdict, judged_hazard
from flightd.sim.judge.verdict import judged
from tests.rigs.flight_evidence import S, at, evidence, landed, status


def verdict(hazard: str, statuses: list[Status], begun_s: int) -> HazardVerdict:
    """Of a flight that is in the air for a minute and a half."""
    (row,) = (row for row in HAZARDS if row.name == hazard)
    flight = evidence(landed(*(at(second * S) for second in range(1, 91))), statuses)
    told = score(flight)
    expected = Expectation(hazard=hazard, ends="landed")
    return judged_hazard(row, expected, flight, told, judged(flight, told), [begun_s * S])


def test_what_shows_only_at_the_landing_is_counted_from_there() -> None:
    statuses = [status(0), status(88 * S, Phase.LAND), status(91 * S, Phase.DONE)]
    found = verdict("landing_unreported", statuses, begun_s=24)
    assert found.down_s == pytest.approx(2.0, abs=1.1)
    assert "down_late" not in {fault.kind for fault in found.faults}


def test_where_the_daemon_is_dead_it_is_counted_from_its_death() -> None:
    found = verdict("companion_dead", [status(0), status(24 * S)], begun_s=24)
    assert found.down_s == pytest.approx(66.0, abs=1.1)
    assert "down_late" in {fault.kind for fault in found.faults}
