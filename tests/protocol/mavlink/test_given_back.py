"""A vehicle that nobody flies once a pilot had it is landed by its autopilot; what he flies is not."""

from __future__ import annotations

import asyncio

import pytest

from flightd.core.types import Demand
from flightd.sim.autopilot.copter import CopterMode
from flightd.sim.autopilot.px4 import Px4Mode
from flightd.sim.autopilot.radio import RadioParams
from tests.rigs.event_loops import virtual
from tests.rigs.vehicles import Rig, ardupilot_rig, px4_rig

_OWN_MODES = [CopterMode.ALT_HOLD, CopterMode.STABILIZE]


async def _taken(rig: Rig, mode: int) -> None:
    """In the air, in a mode of the pilot's, our hands off."""
    await rig.take_off()
    assert rig.peer.pilot_mode(mode)
    await rig.until(lambda: not rig.known().in_control)
    rig.vehicle.demand(Demand.HANDS_OFF)
    await asyncio.sleep(2.0)


@pytest.mark.parametrize("mode", _OWN_MODES, ids=lambda mode: mode.name)
def test_given_back_by_the_pilot_it_is_landed(mode: CopterMode) -> None:
    """In GUIDED_NOGPS it holds its height, level, for as long as our heartbeats come."""

    async def test() -> None:
        async with ardupilot_rig() as rig:
            await _taken(rig, mode)
            assert rig.peer.pilot_mode(CopterMode.GUIDED_NOGPS)
            assert 1.4 < await rig.until(lambda: rig.peer.mode == CopterMode.LAND, 3.0) < 2.2
            await rig.until(lambda: not rig.peer.armed, 15.0)
            assert rig.peer.truth().height_m < 0.15

    virtual(test())


def test_let_go_of_in_our_own_mode_it_is_landed() -> None:
    async def test() -> None:
        async with ardupilot_rig() as rig:
            await rig.take_off()
            rig.vehicle.demand(Demand.HANDS_OFF)
            await rig.until(lambda: not rig.peer.armed, 15.0)
            assert rig.peer.truth().height_m < 0.15

    virtual(test())


@pytest.mark.parametrize("mode", _OWN_MODES, ids=lambda mode: mode.name)
def test_what_a_pilot_flies_is_left_to_him(mode: CopterMode) -> None:
    async def test() -> None:
        async with ardupilot_rig() as rig:
            await _taken(rig, mode)
            for _ in range(300):
                await asyncio.sleep(0.1)
                assert rig.peer.mode == mode

    virtual(test())


def test_a_pilot_may_pass_through_the_mode_in_which_it_obeys_us() -> None:
    async def test() -> None:
        async with ardupilot_rig() as rig:
            await _taken(rig, CopterMode.ALT_HOLD)
            for _ in range(5):
                assert rig.peer.pilot_mode(CopterMode.GUIDED_NOGPS)
                await asyncio.sleep(0.8)
                assert rig.peer.pilot_mode(CopterMode.ALT_HOLD)
                await asyncio.sleep(0.8)
            await asyncio.sleep(5.0)
            assert rig.peer.mode == CopterMode.ALT_HOLD

    virtual(test())


def test_a_pilot_who_is_not_heard_is_taken_to_fly() -> None:
    """The mode that was told last is that of the past."""

    async def test() -> None:
        async with ardupilot_rig() as rig:
            await _taken(rig, CopterMode.ALT_HOLD)
            assert rig.peer.pilot_mode(CopterMode.GUIDED_NOGPS)
            await asyncio.sleep(0.9)
            rig.peer.link.down.params = RadioParams(loss=1.0)
            assert rig.peer.pilot_mode(CopterMode.ALT_HOLD)
            await asyncio.sleep(10.0)
            assert rig.peer.mode == CopterMode.ALT_HOLD

    virtual(test())


def test_px4_does_not_come_back_to_a_mode_whose_setpoints_nobody_sends() -> None:
    async def test() -> None:
        async with px4_rig() as rig:
            await _taken(rig, Px4Mode.ALTCTL)
            assert not rig.peer.pilot_mode(Px4Mode.OFFBOARD)

    virtual(test())
