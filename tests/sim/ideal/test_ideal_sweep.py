"""A flight past shelves with the simulator's airframe, wind and sensors, and an ideal code reader."""

from __future__ import annotations

import math
from functools import cache

from flightd.config.sweep import ScanMode
from flightd.core.inventory import LocationState
from flightd.core.types import Phase
from tests.sim.ideal.ideal_flight import Flown, IdealFlight
from tests.sim.ideal.ideal_front import IdealFront
from tests.sim.ideal.test_ideal_scan import (
    CONFIG,
    COVERED,
    EMPTY,
    NODES,
    PLACES,
    READ,
    STOCK,
    TORN,
    TWO,
    findings,
)
from tests.unit.mission.shelves import SIGHT, SITE

SWEEP = CONFIG.with_values(scan={"mode": ScanMode.SWEEP})


class Lamp:
    """Whether it was wanted lit, tick by tick."""

    def __init__(self) -> None:
        self.told: list[bool] = []

    def shine(self, on: bool) -> None:
        self.told.append(on)

    async def run(self) -> None: ...


@cache
def whole_flight() -> tuple[Flown, Lamp]:
    """Past all shelves and home, by a lamp."""
    flight = IdealFlight(SITE, SWEEP, visits=NODES, seed=5, front=IdealFront(SITE, SIGHT, STOCK))
    flight.lamp = lamp = Lamp()
    flown = flight.fly()
    assert flown.phase is Phase.DONE, flown.reason
    return flown, lamp


def test_the_lamp_is_lit_while_shelves_are_looked_at_and_at_no_other_time() -> None:
    flown, lamp = whole_flight()
    phases = [phase for phase, _ in flown.truth]
    assert len(lamp.told) == len(phases)
    lit = [phase for phase, on in zip(phases, lamp.told, strict=True) if on]
    assert Phase.FOLLOW in lit
    assert set(lit) <= {Phase.FOLLOW, Phase.HOVER, Phase.TURN, Phase.SCAN}
    after = phases[len(lamp.told) - lamp.told[::-1].index(True) :]
    assert Phase.FOLLOW in after, "dark on the way home"


def test_shelves_are_counted_in_passing_at_the_height_of_each_level_and_nose_to_them() -> None:
    flown, _ = whole_flight()
    assert set(flown.visited) == set(NODES)
    found = findings(flown)
    assert {code: finding.state for code, finding in found.items()} == {
        EMPTY: LocationState.EMPTY,
        TORN: LocationState.UNREADABLE,
        COVERED: LocationState.OCCLUDED,
        TWO: LocationState.SEVERAL,
    } | dict.fromkeys(READ, LocationState.READ)
    assert {finding.node for finding in found.values()} == set(NODES)
    confirmed = {c for output in flown.outputs for s in output.settled if s.confirmed for c in s.locations}
    assert confirmed == set(PLACES)
    legs = [k for phase, k in flown.truth if phase is Phase.FOLLOW and 1.5 < k.x_m < 2.4]
    sides = {round(math.degrees(k.yaw_rad) / 90.0) for k in legs}
    assert sides >= {-1, 1}, "nose to one shelf, then to the other"
    levels = {min((0.9, 1.8), key=lambda level_m: abs(level_m - k.height_m)) for k in legs}
    assert levels == {0.9, 1.8}
    assert max(abs(k.y_m) for k in legs) < 0.15, "along the line"
