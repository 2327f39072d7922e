"""A vehicle whose companion dies in the air is landed by its autopilot; one that would not is not armed."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.adapters.vehicle.mavlink.link.codec import Codec, FrameParser
from flightd.core.refusal import words
from flightd.core.types import Demand
from flightd.sim.autopilot.autopilot import PeerConfig
from flightd.sim.autopilot.copter import CopterMode
from flightd.sim.autopilot.radio import RadioParams
from tests.protocol.mavlink.scripted_autopilot import ARM, ScriptedAutopilot, known, scripted
from tests.rigs.event_loops import virtual
from tests.rigs.vehicles import ardupilot_rig, px4_rig


@pytest.mark.parametrize("make", [ardupilot_rig, px4_rig], ids=["ardupilot", "px4"])
def test_it_lands_and_disarms_by_itself(make: Callable[[], Any]) -> None:
    async def test() -> None:
        async with make() as rig:
            await rig.take_off()
            rig.cut(True)
            await rig.until(lambda: not rig.peer.armed, 15.0)
            assert rig.peer.truth().height_m < 0.15

    virtual(test())


def test_an_autopilot_as_it_is_shipped_lands_within_a_second_of_its_companions_death() -> None:
    async def test() -> None:
        async with ardupilot_rig() as rig:
            await rig.take_off()
            rig.cut(True)
            assert 0.4 < await rig.until(lambda: rig.peer.mode == CopterMode.LAND, 3.0) < 0.95

    virtual(test())


def test_arducopter_waits_four_seconds_at_its_height_before_a_failsafe_lands_it() -> None:
    async def test() -> None:
        async with ardupilot_rig() as rig:
            await rig.take_off()
            rig.cut(True)
            await rig.until(lambda: rig.peer.mode == CopterMode.LAND, 3.0)
            height_m = rig.peer.truth().height_m
            await asyncio.sleep(3.5)
            assert rig.peer.truth().height_m == pytest.approx(height_m, abs=0.1)
            await asyncio.sleep(1.5)
            assert rig.peer.truth().height_m < height_m - 0.3

    virtual(test())


def test_an_uplink_that_loses_two_of_five_is_no_dead_companion() -> None:
    """Of the heartbeats that half a second holds nine in a row may be lost."""

    async def test() -> None:
        async with ardupilot_rig() as rig:
            await rig.take_off()
            rig.peer.link.up.params = RadioParams(loss=0.4)
            await rig.stream(40.0, hz=10.0)
            assert rig.peer.mode == CopterMode.GUIDED_NOGPS

    virtual(test())


def test_what_else_beats_on_the_vehicle_does_not_keep_it_in_the_air() -> None:
    """A gimbal, on a cable of its own, that has the vehicle's system id."""
    kind, none = dialect.MAV_TYPE_GIMBAL, dialect.MAV_AUTOPILOT_INVALID
    codec = Codec(1, dialect.MAV_COMP_ID_GIMBAL)
    frame = codec.pack(dialect.MAVLink_heartbeat_message(kind, none, 0, 0, 4, 3))
    (beat,) = FrameParser(codec).datagram(frame)

    async def test() -> None:
        async with ardupilot_rig() as rig:
            await rig.take_off()
            (channel,) = rig.peer.link.channels.values()
            rig.cut(True)
            for _ in range(30):
                rig.peer.received(channel, beat)
                await asyncio.sleep(0.5)
            assert not rig.peer.armed
            assert rig.peer.truth().height_m < 0.15

    virtual(test())


@pytest.mark.parametrize(
    ("make", "name", "value"),
    [
        (ardupilot_rig, "FS_GCS_ENABLE", 0.0),
        (ardupilot_rig, "FS_GCS_TIMEOUT", 1.5),
        (ardupilot_rig, "FS_GCS_TIMEOUT", 0.2),
        (ardupilot_rig, "GUID_TIMEOUT", 3.0),
        (ardupilot_rig, "BATT_FS_LOW_ACT", 0.0),
        (ardupilot_rig, "EK3_SRC1_POSZ", 2.0),
        (px4_rig, "EKF2_HGT_REF", 2),
        (ardupilot_rig, "SYSID_MYGCS", 255.0),
        (ardupilot_rig, "SYSID_MYGCS", 1.0),
        (px4_rig, "COM_OBL_RC_ACT", 0),
        (px4_rig, "COM_OF_LOSS_T", 5.0),
    ],
)
def test_nothing_is_armed_that_would_stay_in_the_air_or_is_wrong_for_the_job(
    make: Callable[[PeerConfig], Any], name: str, value: float
) -> None:
    async def test() -> None:
        async with make(PeerConfig(ready_s=0.5, parameters={name: value})) as rig:
            await rig.until(lambda: rig.vehicle.state() is not None)
            rig.vehicle.demand(Demand.FLY)
            await asyncio.sleep(6.0)
            assert not rig.known().armed
            assert name in words(rig.known().refusal)
            assert "flightd doctor --fix" in words(rig.known().refusal)

    virtual(test())


@pytest.mark.parametrize("name", ["GUID_TIMEOUT", "FS_GCS_ENABLE", "FS_GCS_TIMEOUT", "SYSID_MYGCS"])
def test_nothing_is_armed_whose_way_down_is_not_known(name: str) -> None:
    async def test() -> None:
        autopilot = ScriptedAutopilot()
        del autopilot.parameters[name]
        async with scripted(autopilot) as (_, vehicle):
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(20.0)  # the examination gives up meanwhile
            assert not autopilot.commands(ARM)
            assert words(known(vehicle).refusal) == f"{name} not read yet"

    virtual(test())


@pytest.mark.parametrize(
    ("make", "name", "value"), [(ardupilot_rig, "FS_GCS_ENABLE", 0.0), (px4_rig, "COM_OBL_RC_ACT", 0)]
)
def test_what_would_not_be_armed_is_told_before_anybody_asks_for_a_flight(
    make: Callable[[PeerConfig], Any], name: str, value: float
) -> None:
    async def test() -> None:
        async with make(PeerConfig(ready_s=0.5, parameters={name: value})) as rig:
            await rig.until(lambda: rig.vehicle.state() is not None)
            await rig.until(lambda: name in words(rig.known().unfit), 6.0)
        async with make(PeerConfig(ready_s=0.5)) as rig:
            await rig.until(lambda: rig.vehicle.state() is not None)
            await rig.until(lambda: not rig.known().unfit, 6.0)
            assert not rig.known().armed

    virtual(test())


def test_what_nobody_but_a_person_can_choose_is_told_as_that() -> None:
    async def test() -> None:
        async with ardupilot_rig(PeerConfig(ready_s=0.5, parameters={"BATT_LOW_VOLT": 0.0})) as rig:
            await rig.until(lambda: rig.vehicle.state() is not None)
            await rig.until(lambda: "BATT_LOW_VOLT" in words(rig.known().unfit), 6.0)
            assert "choose it yourself" in words(rig.known().unfit)
            assert "--fix" not in words(rig.known().unfit)

    virtual(test())


def test_after_a_reboot_the_parameters_are_looked_at_anew() -> None:
    async def test() -> None:
        async with ardupilot_rig() as rig:
            await rig.until(lambda: rig.vehicle.state() is not None)
            await rig.until(lambda: not rig.known().unfit, 6.0)
            await asyncio.sleep(5.0)
            rig.peer.parameters["LAND_SPEED"] = 200.0
            rig.peer.reboot()
            await rig.until(lambda: "LAND_SPEED" in words(rig.known().unfit), 15.0)

    virtual(test())


@pytest.mark.parametrize(
    ("make", "name", "value"), [(ardupilot_rig, "LAND_SPEED", 200.0), (px4_rig, "EKF2_HGT_REF", 2)]
)
def test_a_parameter_that_an_autopilot_drops_from_a_burst_is_judged_before_it_arms(
    make: Any, name: str, value: float
) -> None:
    """It is asked for alone in the end; what is not answered then does not exist."""
    config = PeerConfig(ready_s=0.5, parameters={name: value}, parameter_queue=1)

    async def test() -> None:
        async with make(config) as rig:
            rig.vehicle.demand(Demand.FLY)
            for _ in range(300):
                await asyncio.sleep(0.1)
                assert not rig.peer.armed
            assert f"{name} is" in str(rig.known().unfit)

    virtual(test())
