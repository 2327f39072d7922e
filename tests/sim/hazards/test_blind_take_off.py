"""A take-off to a high flying height that loses sight of the floor on its way: up no further, and down."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from flightd.config.schema import load_config
from flightd.core.types import Phase
from flightd.site.site_file import load_site
from tests.sim.ideal.ideal_flight import Flown, IdealFlight

CONFIGS = Path(__file__).parents[3] / "configs"
HIGH = load_config(CONFIGS / "sim.toml").with_values(mission={"height_m": 4.2})
SITE = load_site(CONFIGS / "site-demo.toml")
RISES_M = 0.9
"""So much higher it comes at most: what it climbs until it is found, or to see more."""
_ENOUGH_S = 20.0
"""By then it is down, or on its way."""


def fly(fault: str, from_m: float, lasts_s: float = math.inf) -> Flown:
    """A fault that begins at a height of the take-off."""
    flight = IdealFlight(SITE, HIGH, visits=("A2",))
    begun_ns: list[int] = []

    def watch(phase: Phase, now_ns: int) -> None:
        if not begun_ns and phase is Phase.TAKE_OFF and flight.airframe.height_m > from_m:
            begun_ns.append(now_ns)
        over = bool(begun_ns) and (now_ns - begun_ns[0]) * 1e-9 > lasts_s
        setattr(flight.faults, fault, bool(begun_ns) and not over)

    flight.on_tick = watch
    return flight.fly(_ENOUGH_S)


@pytest.mark.parametrize(
    ("fault", "from_m"), [("blank", 0.3), ("blank", 0.9), ("frozen", 0.9), ("bare", 0.9), ("bare", 2.5)]
)
def test_it_climbs_no_further_and_lands(fault: str, from_m: float) -> None:
    flown = fly(fault, from_m)
    truth = [k for _, k in flown.truth]
    assert flown.phase is Phase.ABORTED, flown.reason
    assert max(k.height_m for k in truth) < from_m + RISES_M
    assert truth[-1].height_m < 0.2
    assert max(math.hypot(k.x_m, k.y_m) for k in truth) < 1.0


@pytest.mark.parametrize(("fault", "from_m"), [("blank", 0.9), ("bare", 1.2)])
def test_a_moment_without_sight_is_tolerated(fault: str, from_m: float) -> None:
    flown = fly(fault, from_m, lasts_s=0.6)
    assert Phase.FOLLOW in {phase for phase, _ in flown.truth}, flown.reason
