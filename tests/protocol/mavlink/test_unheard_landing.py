"""A vehicle whose telemetry is lost for good, while it still hears us, is brought down and disarmed."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from functools import partial
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.core.types import Demand
from flightd.sim.autopilot.autopilot import PeerConfig
from flightd.sim.autopilot.copter import CopterMode
from flightd.sim.autopilot.radio import RadioParams
from tests.protocol.mavlink.scripted_autopilot import LAND, SET_MODE, scripted
from tests.rigs.event_loops import virtual
from tests.rigs.patient_loop import patient
from tests.rigs.vehicles import Rig, ardupilot_rig, mavsdk_rig, px4_rig

_RAW = PeerConfig(ready_s=0.5, parameters={"GUID_OPTIONS": 8})
_DEAF = RadioParams(loss=1.0)


async def _fly_unheard(rig: Rig, limit_s: float, up: RadioParams | None = None) -> float:
    """Take off, lose the downlink for good, and demand the landing 3 s later as the mission does; the time
    from then until the vehicle has disarmed.  `up` is what becomes of the uplink."""
    await rig.take_off()
    rig.peer.link.down.params, rig.peer.link.up.params = _DEAF, up or rig.peer.link.up.params
    await rig.stream(3.0)
    rig.vehicle.demand(Demand.LAND)
    loop = asyncio.get_running_loop()
    start_s = loop.time()
    while rig.peer.armed and loop.time() - start_s < limit_s:
        await rig.stream(0.1, climb_mps=-0.35)
    assert not rig.peer.armed
    assert rig.peer.truth().height_m < 0.15
    return loop.time() - start_s


@pytest.mark.parametrize(
    "make", [ardupilot_rig, partial(ardupilot_rig, _RAW), px4_rig], ids=["ardupilot", "raw thrust", "px4"]
)
def test_it_lands_and_disarms_though_nobody_hears_it(make: Callable[[], Any]) -> None:
    async def test() -> None:
        async with make() as rig:
            assert await _fly_unheard(rig, 17.0) < 17.0

    virtual(test())


def test_mavsdk_lands_it_too() -> None:
    async def test() -> None:
        async with mavsdk_rig() as rig:
            await _fly_unheard(rig, 17.0)

    patient(test())


def test_an_uplink_that_loses_half_of_all_still_brings_it_down() -> None:
    async def test() -> None:
        async with ardupilot_rig(_RAW) as rig:
            await _fly_unheard(rig, 30.0, up=RadioParams(loss=0.5))

    virtual(test())


def test_the_landing_is_ordered_again_and_again_ever_more_rarely() -> None:
    async def test() -> None:
        async with scripted() as (autopilot, vehicle):
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(3.0)
            autopilot.link.down.params = _DEAF
            await asyncio.sleep(3.5)
            autopilot.heard.clear()
            vehicle.demand(Demand.LAND)
            await asyncio.sleep(9.0)
            early = [m.param2 for m in autopilot.commands(SET_MODE)]
            assert len(early) >= 6
            assert set(early) == {LAND}
            assert len(autopilot.commands(dialect.MAV_CMD_NAV_LAND)) == len(early)
            autopilot.heard.clear()
            await asyncio.sleep(10.0)
            assert 1 <= len(autopilot.commands(SET_MODE)) <= 3

    virtual(test())


def test_heard_again_in_the_landing_mode_it_is_still_ours() -> None:
    async def test() -> None:
        async with ardupilot_rig(_RAW) as rig:
            await rig.take_off(2.5)
            rig.peer.link.down.params = _DEAF
            await rig.stream(3.2)
            rig.vehicle.demand(Demand.LAND)
            await rig.stream(1.0)
            assert rig.peer.mode == CopterMode.LAND
            rig.peer.link.down.params = RadioParams()
            await rig.until(lambda: rig.known().mode == "LAND", 3.0)
            assert rig.known().in_control

    virtual(test())


def test_a_pilot_who_took_it_unheard_keeps_it_between_the_orders() -> None:
    async def test() -> None:
        async with ardupilot_rig(_RAW) as rig:
            await rig.take_off(3.0)
            rig.peer.link.down.params = _DEAF
            await rig.stream(3.2)
            rig.vehicle.demand(Demand.LAND)
            await rig.stream(3.5)  # the first orders are over
            assert rig.peer.pilot_mode(CopterMode.ALT_HOLD)
            await rig.stream(1.0)
            assert rig.peer.mode == CopterMode.ALT_HOLD

    virtual(test())
