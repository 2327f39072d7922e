"""Range finders as they are fitted: one that begins above where the vehicle stands, and two together."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from flightd.sim.autopilot.autopilot import PeerConfig
from flightd.sim.sensors.instruments import SensorParams
from tests.rigs.event_loops import virtual
from tests.rigs.vehicles import ardupilot_rig, px4_rig

RIGS: dict[str, Callable[[PeerConfig], Any]] = {"ardupilot": ardupilot_rig, "px4": px4_rig}


@pytest.mark.parametrize("name", list(RIGS))
def test_a_vehicle_that_stands_lower_than_its_range_finder_measures_takes_off(name: str) -> None:
    """It waited for a height for ever."""

    async def test() -> None:
        config = PeerConfig(ready_s=0.5, sensors=SensorParams(range_min_m=0.2))
        async with RIGS[name](config) as rig:
            await rig.until(lambda: rig.vehicle.state() is not None)
            await rig.until(lambda: rig.known().height_m == pytest.approx(0.2), 3.0)
            await rig.take_off(1.5)
            assert rig.known().height_m == pytest.approx(rig.peer.truth().height_m, abs=0.1)

    virtual(test())


@pytest.mark.parametrize("name", list(RIGS))
def test_of_two_range_finders_one_is_flown_by(name: str) -> None:
    """The height leapt to and fro by 10 cm, and to nothing on the floor."""

    async def test() -> None:
        async with RIGS[name](PeerConfig(ready_s=0.5, second_range_m=0.1)) as rig:
            await rig.take_off(1.5)
            off_m = []
            for _ in range(100):
                await rig.stream(0.02)
                off_m.append(rig.known().height_m - rig.peer.truth().height_m)
            assert max(map(abs, off_m)) < 0.06

    virtual(test())
