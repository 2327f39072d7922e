"""A landing whose end nobody reports comes to its end all the same; and nothing is disarmed in the air.

`FLIGHTD_SEEDS=3` flies it in so many winds.
"""

from __future__ import annotations

import asyncio
import itertools
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from flightd.config.schema import load_config
from flightd.core.refusal import words
from flightd.core.types import AttitudeSetpoint, Command, CommandKind, Demand, EventLevel, Phase
from flightd.runtime.clock import LoopClock
from flightd.sim.plant.wind import WindParams
from flightd.site.site_file import load_site
from tests.rigs.event_loops import virtual
from tests.rigs.vehicles import ardupilot_rig, px4_rig
from tests.sim.ideal.ideal_flight import Flown, IdealFlight

CONFIGS = Path(__file__).parents[3] / "configs"
CONFIG = load_config(CONFIGS / "sim.toml")
SITE = load_site(CONFIGS / "site-demo.toml")
BOTH = [ardupilot_rig, px4_rig]
SEEDS = range(1, 1 + int(os.environ.get("FLIGHTD_SEEDS", "1")))
NEAREST = ("A1",)
"""Over the pad: what a landing ends like does not depend on where the drone has been."""


def landing_s(flown: Flown) -> float:
    return sum(output.phase is Phase.LAND for output in flown.outputs) * 0.02


@pytest.mark.parametrize("seed", SEEDS)
def test_down_and_still_it_leans_no_more_and_is_disarmed(seed: int) -> None:
    flight = IdealFlight(SITE, CONFIG, visits=NEAREST, seed=seed, wind=WindParams(0.8, 0.5))
    flight.faults.landing_unreported = True
    flown = flight.fly(120.0)
    assert flown.phase is Phase.DONE
    assert landing_s(flown) < 25.0
    demands = [output.demand for output in flown.outputs if output.phase is Phase.LAND]
    assert list(dict.fromkeys(demands)) == [Demand.FLY, Demand.LAND, Demand.DISARM]
    is_not_commanded_to_lean(flown)
    handed_over = demands.index(Demand.LAND)
    landing = [output.setpoint for output in flown.outputs if output.phase is Phase.LAND]
    for setpoint in landing[handed_over:]:
        assert setpoint is not None
        assert max(abs(setpoint.roll_rad), abs(setpoint.pitch_rad)) < math.radians(0.5)


@pytest.mark.parametrize("seed", SEEDS)
def test_once_it_touches_it_is_not_commanded_to_lean_although_its_height_swings(seed: int) -> None:
    flight = IdealFlight(SITE, CONFIG, visits=NEAREST, seed=seed, wind=WindParams(0.8, 0.5))
    flight.faults.landing_unreported = True
    readings = itertools.count()

    def swinging(height_m: float) -> float:
        return height_m + (0.3 * (next(readings) // 5 % 2) if height_m < 0.4 else 0.0)

    flight.faults.misread = swinging
    is_not_commanded_to_lean(flight.fly(60.0))


def is_not_commanded_to_lean(flown: Flown) -> None:
    """Once it touches the floor."""
    touches = [phase is Phase.LAND and truth.height_m <= 0.101 for phase, truth in flown.truth]
    touched = touches.index(True)
    settled = flown.outputs[touched + round(0.8 / 0.02) :]
    assert len(settled) > 10
    for output in settled:
        if output.setpoint is not None:
            assert math.hypot(output.setpoint.roll_rad, output.setpoint.pitch_rad) < math.radians(2.0)


def test_stops_during_a_landing_neither_begin_it_anew_nor_put_off_its_end() -> None:
    flight = IdealFlight(SITE, CONFIG, visits=NEAREST)
    flight.faults.landing_unreported = True
    ticks = itertools.count()

    def press(phase: Phase, _now_ns: int) -> None:
        if phase is Phase.LAND and (tick := next(ticks)) % 100 == 50:
            flight.commands.append(Command(f"stop {tick}", CommandKind.STOP))

    flight.on_tick = press
    flown = flight.fly(120.0)
    assert flown.phase is Phase.ABORTED
    assert landing_s(flown) < 25.0
    demands = [output.demand for output in flown.outputs if output.phase is Phase.LAND]
    assert [demand for demand, _ in itertools.groupby(demands)] == [Demand.FLY, Demand.LAND, Demand.DISARM]


def test_one_that_is_never_disarmed_is_given_up_and_said_aloud() -> None:
    impatient = CONFIG.with_values(mission={"expert": {"phase_slack_s": 5.0}})
    flight = IdealFlight(SITE, impatient, visits=NEAREST)
    flight.faults.endless = True
    flown = flight.fly(600.0)
    assert flown.phase is Phase.ABORTED
    assert landing_s(flown) < 180.0
    said = [event for event in flown.events if event.name == "landing"]
    assert [event.level for event in said] == [EventLevel.ERROR, EventLevel.ERROR]
    assert "the autopilot lands by itself" in said[0].text
    assert "disarm it by hand" in said[1].text


@pytest.mark.parametrize("make", BOTH, ids=["ardupilot", "px4"])
def test_the_autopilots_own_landing_ends_what_it_does_not_tell_of(make: Callable[[], Any]) -> None:
    """Down by setpoints and never told to stand, as far as the telemetry goes."""

    async def test() -> None:
        async with make() as rig:
            rig.peer.reports_landed = False
            await rig.take_off(1.0)
            rig.vehicle.demand(Demand.LAND)
            clock, armed_s = LoopClock(), 0.0
            while rig.known().armed and armed_s < 15.0:
                rig.vehicle.send(AttitudeSetpoint(clock.now_ns(), climb_mps=-0.3))
                await asyncio.sleep(0.02)
                armed_s += 0.02
            assert not rig.known().armed
            assert rig.peer.airframe.on_floor

    virtual(test())


@pytest.mark.parametrize("make", BOTH, ids=["ardupilot", "px4"])
def test_an_autopilot_that_would_disarm_in_the_air_is_not_asked_to(make: Callable[[], Any]) -> None:
    async def test() -> None:
        async with make() as rig:
            await rig.take_off(1.5)
            rig.peer.landed = True  # its own landing detector errs
            rig.vehicle.demand(Demand.DISARM)
            for _ in range(20):
                rig.peer.landed = True
                await rig.stream(0.1, climb_mps=0.05)
            assert rig.peer.armed
            assert "disarming: 1." in words(rig.known().refusal)

    virtual(test())
