"""Flights by telemetry that comes late and in bursts, as radios and power saving make it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from flightd.config.schema import load_config
from flightd.core.tick import TickInput, TickOutput
from flightd.core.types import Attitude, Phase, VehicleState
from flightd.site.site_file import load_site
from tests.rigs.brisk import BRISK
from tests.sim.ideal.ideal_flight import IdealFlight

CONFIGS = Path(__file__).parents[3] / "configs"
CONFIG = load_config(CONFIGS / "sim.toml").with_values(mission=BRISK)
SITE = load_site(CONFIGS / "site-demo.toml")


class LateLink:
    """What the vehicle told, so long ago, and only every `burst_ns`."""

    def __init__(self, delay_ns: int, burst_ns: int) -> None:
        self._delay_ns, self._burst_ns = delay_ns, burst_ns
        self._told: list[tuple[int, tuple[Attitude, ...], VehicleState | None]] = []
        self._state: VehicleState | None = None
        self._burst = -1

    def carry(self, tick: TickInput) -> TickInput:
        self._told.append((tick.now_ns, tick.attitudes, tick.vehicle))
        attitudes: tuple[Attitude, ...] = ()
        burst = tick.now_ns // self._burst_ns
        if burst > self._burst:
            self._burst = burst
            while self._told and self._told[0][0] <= tick.now_ns - self._delay_ns:
                _, samples, self._state = self._told.pop(0)
                attitudes += samples
        return replace(tick, attitudes=attitudes, vehicle=self._state)


@pytest.mark.parametrize(("delay_ms", "burst_ms"), [(60, 120), (0, 200), (100, 80), (160, 20)])
def test_the_drone_flies_on_along_its_line_and_comes_home(delay_ms: int, burst_ms: int) -> None:
    flight = IdealFlight(SITE, CONFIG, visits=("A3",), seed=1)
    link, step = LateLink(delay_ms * 1_000_000, burst_ms * 1_000_000), flight.pilot.step

    def late(tick: TickInput) -> TickOutput:
        return step(link.carry(tick))

    flight.pilot.step = late  # type: ignore[method-assign]
    flown = flight.fly(80)
    assert (flown.phase, flown.visited) == (Phase.DONE, ["A3"]), flown.reason
    assert max(abs(k.y_m) for _, k in flown.truth) < 0.3


def test_a_silence_of_many_seconds_in_the_air_is_no_error_of_the_software() -> None:
    flight = IdealFlight(SITE, CONFIG, visits=("A2",))

    def fall_silent(phase: Phase, _: int) -> None:
        flight.faults.silent |= phase is Phase.FOLLOW

    flight.on_tick = fall_silent
    flown = flight.fly(30.0)
    assert flown.phase is Phase.LAND
    assert flown.reason == "vehicle telemetry lost"
    assert not [event for event in flown.events if "software" in event.text]
