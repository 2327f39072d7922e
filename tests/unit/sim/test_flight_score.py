"""What a flight's score counts."""

from __future__ import annotations

from pathlib import Path

import pytest

from flightd.config.mission import Heading
from flightd.core.types import Event, EventLevel, Phase, Status
from flightd.mission.plan.flight_plan import HeadingPolicy, make_plan
from flightd.sim.judge.flight_score import score
from flightd.sim.plant.kinematics import Kinematics
from flightd.site.site_file import load_site

SITE = load_site(Path(__file__).parents[3] / "configs" / "site-demo.toml")
PLAN = make_plan(SITE, ["A2"], "A1", "A1", HeadingPolicy(Heading.ALONG))
MS = 1_000_000


def standing(stamp_ns: int, y_m: float) -> Kinematics:
    return Kinematics(stamp_ns, 1.5, y_m, 1.6, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def status(stamp_ns: int, phase: Phase) -> Status:
    return Status(stamp_ns, phase, "", "A2", "A2", 0, 1, 1.0, 1.6, 1, 0, 30.0, {})


@pytest.mark.parametrize("phase", [Phase.HOVER, Phase.CLIMB, Phase.SCAN])
def test_a_stop_that_scans_is_measured_like_one_that_hovers(phase: Phase) -> None:
    truth = [standing(at * MS, 0.2) for at in range(0, 1000, 100)]
    visited = Event(950 * MS, EventLevel.INFO, "visited", "A2")
    result = score(SITE, PLAN, [status(0, phase)], [visited], truth)
    assert result.hover_error_p95_m == pytest.approx(0.2)
    assert result.cross_track_max_m == pytest.approx(0.2)


def test_a_hold_off_the_line_is_not_passed_over() -> None:
    truth = [standing(at * MS, 0.4) for at in range(0, 1000, 100)]
    result = score(SITE, PLAN, [status(0, Phase.HOLD)], [], truth)
    assert result.cross_track_max_m == pytest.approx(0.4)
    assert result.hover_error_p95_m is None
