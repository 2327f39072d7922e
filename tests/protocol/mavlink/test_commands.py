"""Commands and their acknowledgement: repeated, waited for, the refusal told."""

from __future__ import annotations

import asyncio
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from flightd.core.refusal import words
from flightd.core.types import Demand
from flightd.sim.autopilot.autopilot import PeerConfig
from flightd.sim.autopilot.copter import CopterMode
from tests.protocol.mavlink.scripted_autopilot import (
    ARM,
    LAND,
    SET_MODE,
    ScriptedAutopilot,
    known,
    scripted,
)
from tests.rigs.event_loops import virtual
from tests.rigs.vehicles import ardupilot_rig


def test_an_unanswered_command_is_repeated_with_rising_confirmation() -> None:
    async def test() -> None:
        autopilot = ScriptedAutopilot()
        autopilot.results[SET_MODE] = [None, None, 0]
        async with scripted(autopilot) as (_, vehicle):
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(3.0)
            assert [m.confirmation for m in autopilot.commands(SET_MODE)] == [0, 1, 2]
            assert known(vehicle).in_control

    virtual(test())


def test_a_dead_command_channel_is_told_and_tried_again_for_ever() -> None:
    async def test() -> None:
        autopilot = ScriptedAutopilot()
        autopilot.results[ARM] = None
        async with scripted(autopilot) as (_, vehicle):
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(10.0)
            assert words(known(vehicle).refusal) == "arming: no answer"
            assert len(autopilot.commands(ARM)) > 12
            autopilot.results[ARM] = 0
            await asyncio.sleep(3.0)
            assert known(vehicle).armed
            assert known(vehicle).refusal is None

    virtual(test())


def test_in_progress_is_waited_for_and_strange_results_are_refusals() -> None:
    async def test() -> None:
        autopilot = ScriptedAutopilot()
        autopilot.results[SET_MODE] = 5
        async with scripted(autopilot) as (_, vehicle):
            autopilot.obeys = False

            def finish(message: Any) -> None:
                if message.command == SET_MODE:
                    ack = dialect.MAVLink_command_ack_message(SET_MODE, 0, 0, 0, 1, 191)
                    asyncio.get_running_loop().call_later(2.0, autopilot.say, ack)

            autopilot.after = finish
            await asyncio.sleep(2.0)  # its parameters are read first
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(1.9)
            assert len(autopilot.commands(SET_MODE)) == 1
            assert not known(vehicle).in_control
            await asyncio.sleep(0.3)
            assert known(vehicle).in_control
        autopilot = ScriptedAutopilot()
        autopilot.results[SET_MODE] = 42
        async with scripted(autopilot) as (_, vehicle):
            await asyncio.sleep(2.0)
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(1.0)
            assert words(known(vehicle).refusal) == "mode GUIDED_NOGPS: result 42"

    virtual(test())


def test_a_command_that_stays_in_progress_is_given_up_and_never_holds_back_a_landing() -> None:
    async def test() -> None:
        autopilot = ScriptedAutopilot()
        autopilot.results[ARM] = 5
        async with scripted(autopilot) as (_, vehicle):

            def still_busy(message: Any) -> None:
                if message.command == ARM:
                    busy = dialect.MAVLink_command_ack_message(ARM, 5, 0, 0, 1, 191)
                    for second in range(1, 60):
                        asyncio.get_running_loop().call_later(second, autopilot.say, busy)

            autopilot.after = still_busy
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(5.0)
            assert len(autopilot.commands(ARM)) == 1
            assert known(vehicle).refusal is None
            await asyncio.sleep(7.0)
            assert words(known(vehicle).refusal) == "arming: in progress"
            await asyncio.sleep(3.0)  # it is asked again by now
            assert len(autopilot.commands(ARM)) == 2
            vehicle.demand(Demand.LAND)
            await asyncio.sleep(0.2)
            assert autopilot.mode == LAND

    virtual(test())


def test_another_clients_acknowledgement_is_not_ours() -> None:
    async def test() -> None:
        autopilot = ScriptedAutopilot()
        autopilot.results[SET_MODE] = None
        autopilot.obeys = False
        async with scripted(autopilot) as (_, vehicle):
            foreign = dialect.MAVLink_command_ack_message(SET_MODE, 0, 0, 0, 255, 190)
            autopilot.after = lambda message: autopilot.say(foreign)
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(2.0)
            assert not known(vehicle).in_control

    virtual(test())


def test_arming_is_retried_with_the_autopilots_reason_until_it_is_ready() -> None:
    async def test() -> None:
        async with ardupilot_rig(PeerConfig(ready_s=20.0)) as rig:
            await asyncio.sleep(1.0)
            rig.vehicle.demand(Demand.FLY)
            await asyncio.sleep(3.0)
            assert words(rig.known().refusal) == "arming: failed (PreArm: Gyros still settling)"
            assert rig.known().in_control
            assert not rig.known().armed
            assert 14.0 < await rig.until(lambda: rig.known().armed, 30.0) < 19.0
            assert rig.known().refusal is None

    virtual(test())


def test_a_disarm_demand_on_the_floor_never_disarms_the_pilot() -> None:
    async def test() -> None:
        async with ardupilot_rig() as rig:
            await rig.take_off(1.0)
            while rig.known().armed:
                await rig.stream(0.1, climb_mps=-0.3)
            rig.vehicle.demand(Demand.DISARM)
            await asyncio.sleep(1.0)
            assert rig.peer.pilot_mode(CopterMode.ALT_HOLD)
            assert rig.peer.pilot_arm()
            await asyncio.sleep(5.0)
            assert rig.known().armed

    virtual(test())
