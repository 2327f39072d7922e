"""The ground station that attends a flight falls silent: what is configured happens, and no more."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from flightd.config.hazards import LossAction
from flightd.config.schema import load_config
from flightd.core.tick import TickInput, TickOutput
from flightd.core.types import Phase
from flightd.site.site_file import load_site
from tests.rigs.brisk import BRISK
from tests.sim.ideal.ideal_flight import Flown, IdealFlight

CONFIGS = Path(__file__).parents[3] / "configs"
CONFIG = load_config(CONFIGS / "sim.toml").with_values(mission=BRISK)
SITE = load_site(CONFIGS / "site-demo.toml")
LOST_S = 5.0


@cache
def flown(action: LossAction, silence: Callable[[int], float]) -> Flown:
    """A short flight in which `silence(ticks since it first followed a line)` gives the link's silence."""
    lost = {"lost_action": action, "lost_s": LOST_S}
    flight = IdealFlight(SITE, CONFIG.with_values(ground=lost), visits=("A1", "A2", "A3"))
    step: Any = flight.pilot.step
    ticks = 0

    def watch(tick: TickInput) -> TickOutput:
        nonlocal ticks
        output: TickOutput = step(tick)
        ticks += bool(ticks) or output.phase is Phase.FOLLOW
        flight.ground_silent_s = silence(ticks) if ticks else 0.0
        return output

    flight.pilot.step = watch  # type: ignore[method-assign]
    return flight.fly()


def for_ever(ticks: int) -> float:
    return ticks * 0.02


def back_after_8_s(ticks: int) -> float:
    return ticks * 0.02 if ticks < 400 else 0.0


def told(flight: Flown) -> list[str]:
    return [event.text for event in flight.events if event.name == "ground_link"]


@pytest.mark.parametrize(
    ("action", "end", "visited"),
    [
        (LossAction.CONTINUE, Phase.DONE, ["A1", "A2", "A3"]),
        (LossAction.HOME, Phase.ABORTED, ["A1"]),
        (LossAction.LAND, Phase.ABORTED, ["A1"]),
    ],
)
def test_a_lost_link_does_what_is_configured(action: LossAction, end: Phase, visited: list[str]) -> None:
    flight = flown(action, for_ever)
    assert flight.phase is end
    assert flight.visited[: len(visited)] == visited
    assert ("A3" in flight.visited) == (action is LossAction.CONTINUE)
    assert told(flight) == [f"silent for {LOST_S:.1f} s: {action}"]


def test_lost_for_good_it_goes_home_and_lands_on_the_pad() -> None:
    flight = flown(LossAction.HOME, for_ever)
    pad, end = SITE.nodes[SITE.home.node], flight.truth[-1][1]
    assert abs(end.x_m - pad.x_m) < 0.15
    assert abs(end.y_m - pad.y_m) < 0.15


def test_a_hold_ends_when_the_link_is_back_and_the_mission_completes() -> None:
    flight = flown(LossAction.HOLD, back_after_8_s)
    assert Phase.HOLD in {output.phase for output in flight.outputs}
    assert (flight.phase, flight.visited) == (Phase.DONE, ["A1", "A2", "A3"])
    assert told(flight) == [f"silent for {LOST_S:.1f} s: hold", "heard again"]


def test_silence_shorter_than_the_limit_is_nothing() -> None:
    flight = flown(LossAction.LAND, lambda ticks: min(ticks * 0.02, LOST_S - 0.1))
    assert flight.phase is Phase.DONE
    assert told(flight) == []


def test_who_fell_silent_on_the_ground_keeps_it_there() -> None:
    lost = {"lost_action": LossAction.HOME}
    flight = IdealFlight(SITE, CONFIG.with_values(ground=lost), visits=("A1", "A2"))
    flight.ground_silent_s = 60.0
    grounded = flight.fly(10.0)
    assert grounded.phase is Phase.PREFLIGHT
    assert "fell silent" in grounded.reason
