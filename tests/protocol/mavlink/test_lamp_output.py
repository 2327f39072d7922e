"""A lamp on an output of the autopilot: ArduPilot's relays, PX4's actuators."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractAsyncContextManager

import pytest

from flightd.adapters.vehicle.mavlink.vehicle import MavlinkVehicle
from flightd.core.errors import TransientError
from tests.rigs.event_loops import virtual
from tests.rigs.vehicles import Rig, ardupilot_rig, px4_rig

RIGS = pytest.mark.parametrize("rig_of", [ardupilot_rig, px4_rig])


@RIGS
def test_an_output_is_switched_on_and_off(rig_of: Callable[[], AbstractAsyncContextManager[Rig]]) -> None:
    async def test() -> None:
        async with rig_of() as rig:
            assert isinstance(rig.vehicle, MavlinkVehicle)
            await rig.until(lambda: rig.vehicle.state() is not None)
            output = rig.vehicle.output(3)
            await output.switch(on=True)
            assert rig.peer.lamp_lit
            await output.switch(on=False)
            assert not rig.peer.lamp_lit
            await output.switch(on=True)
            output.release()
            await rig.until(lambda: not rig.peer.lamp_lit)

    virtual(test())


def test_what_the_autopilot_refuses_and_what_it_does_not_answer_is_told() -> None:
    async def test() -> None:
        async with ardupilot_rig() as rig:
            assert isinstance(rig.vehicle, MavlinkVehicle)
            await rig.until(lambda: rig.vehicle.state() is not None)
            with pytest.raises(TransientError, match="does not switch output 99: "):
                await rig.vehicle.output(99).switch(on=True)
            rig.cut(True)
            with pytest.raises(TransientError, match="does not switch output 0: no answer"):
                await rig.vehicle.output(0).switch(on=True)
            assert not rig.peer.lamp_lit

    virtual(test())
