"""The adapter's word fails in the air, in an aisle that is not the pad's: what it told last grows old."""

from __future__ import annotations

import pytest

from flightd.core.types import Phase
from tests.sim.hazards.test_hazards import CONFIG, SITE, shelf_distance_m
from tests.sim.ideal.ideal_flight import IdealFlight


@pytest.mark.parametrize(
    ("for_good", "limit_s", "reason"),
    [(False, 100.0, "landed on the pad"), (True, 35.0, "vehicle telemetry lost")],
)
def test_a_vehicle_that_fails_to_tell_is_not_one_that_disarmed(
    for_good: bool, limit_s: float, reason: str
) -> None:
    """It was: then the drone was believed on its pad, flew on from there, and into a rack."""
    flight = IdealFlight(SITE, CONFIG, visits=("B4",), seed=2)
    failed_ns: list[int] = []

    def watch(phase: Phase, now_ns: int) -> None:
        at = flight.airframe.kinematics(now_ns)
        on_leg = phase is Phase.FOLLOW and at.x_m > 2.5 and at.y_m > 1.0
        flight.faults.untold = (on_leg and not failed_ns) or (bool(failed_ns) and for_good)
        if flight.faults.untold:
            failed_ns.append(now_ns)

    flight.on_tick = watch
    flown = flight.fly(limit_s)
    assert flown.reason == reason
    after = [at for _, at in flown.truth if at.stamp_ns > failed_ns[0]]
    assert min(map(shelf_distance_m, after)) > 0.5
    assert after[-1].height_m < 0.15
