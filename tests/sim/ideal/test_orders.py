"""Orders from the ground in flight, without pixels: what the mission makes of them; those that change the
route are in `test_strategies`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from flightd.config.schema import load_config
from flightd.core.tick import TickInput, TickOutput
from flightd.core.types import Command, CommandKind, Demand, Phase
from flightd.site.site_file import load_site
from tests.rigs.brisk import BRISK
from tests.sim.ideal.ideal_flight import Flown, IdealFlight

CONFIGS = Path(__file__).parents[3] / "configs"
SITE = load_site(CONFIGS / "site-demo.toml")
CONFIG = load_config(CONFIGS / "sim.toml").with_values(mission=BRISK)
S = 50
"""Ticks in a second."""


def flown(orders: Mapping[int, Command]) -> Flown:
    """A short flight with orders at given ticks, counted from when it first followed a line."""
    flight = IdealFlight(SITE, CONFIG, visits=("A1", "A2", "A3"))
    step: Any = flight.pilot.step
    ticks = 0

    def watch(tick: TickInput) -> TickOutput:
        nonlocal ticks
        if ticks in orders:
            flight.pilot.mission.command(orders[ticks], tick.now_ns)
        output: TickOutput = step(tick)
        ticks += bool(ticks) or output.phase is Phase.FOLLOW
        return output

    flight.pilot.step = watch  # type: ignore[method-assign]
    return flight.fly()


def order(kind: CommandKind, node: str = "") -> Command:
    return Command(f"order-{kind}", kind, node)


def longest_hold_s(flight: Flown) -> float:
    return sum(output.phase is Phase.HOLD for output in flight.outputs) / S


def landed_on_pad(flight: Flown) -> bool:
    pad, end = SITE.nodes[SITE.home.node], flight.truth[-1][1]
    return abs(end.x_m - pad.x_m) < 0.15 and abs(end.y_m - pad.y_m) < 0.15


def test_the_order_home_ends_a_pause_and_it_lands_on_the_pad() -> None:
    flight = flown({5 * S: order(CommandKind.PAUSE), 10 * S: order(CommandKind.HOME)})
    assert longest_hold_s(flight) <= 6.0
    assert landed_on_pad(flight)
    assert "A3" not in flight.visited


@pytest.mark.parametrize("kind", [CommandKind.LAND, CommandKind.STOP])
def test_land_and_stop_end_the_flight_where_it_is(kind: CommandKind) -> None:
    flight = flown({8 * S: order(kind)})
    assert flight.phase is Phase.ABORTED
    assert flight.truth[-1][1].height_m < 0.2
    assert len(flight.visited) <= 2


@pytest.mark.parametrize("kind", [CommandKind.LAND, CommandKind.STOP])
def test_land_and_stop_before_the_start_keep_it_from_arming(kind: CommandKind) -> None:
    flight = flown({0: order(kind)})
    assert flight.phase is Phase.ABORTED
    assert Demand.FLY not in {output.demand for output in flight.outputs}
