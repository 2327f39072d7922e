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


def landing(event_text: str, level: EventLevel, goal: str = "A1") -> float | None:
    """The landing error told of a drone that comes down 0.3 m beside the pad's node."""
    pad_x_m, pad_y_m = SITE.pad_centre(SITE.home)
    heights_m = [0.0, 1.6, 1.6, 0.0]
    truth = [
        Kinematics(at * MS, pad_x_m + 0.3, pad_y_m, height_m, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        for at, height_m in enumerate(heights_m)
    ]
    said = [Status(2 * MS, Phase.LAND, "", "A1", goal, 1, 1, 1.0, 1.6, 1, 0, 30.0, {})]
    return score(SITE, PLAN, said, [Event(2 * MS, level, "phase", event_text)], truth).landed_error_m


def test_a_landing_on_the_pad_is_measured_from_its_centre() -> None:
    assert landing("hover -> land: route done", EventLevel.INFO) == pytest.approx(0.3)


@pytest.mark.parametrize("goal", ["A1", "A3"])
def test_a_landing_that_was_ordered_elsewhere_is_not_measured_from_the_pad(goal: str) -> None:
    assert landing("follow -> land: land command", EventLevel.WARNING, goal) is None
