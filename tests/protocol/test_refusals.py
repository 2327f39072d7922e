"""Refusals, time-outs, reboots and the pilot's switches of either MAVLink firmware, in virtual time.

Those of one firmware alone stand with its adapter; `test_facts_covered` says where each is.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from functools import partial
from typing import Any

import pytest

from flightd.adapters.vehicle.mavlink.ardupilot import ArduPilotVehicle
from flightd.core.refusal import words
from flightd.core.types import Demand
from flightd.runtime.clock import LoopClock
from tests.protocol.mavlink.scripted_autopilot import ScriptedAutopilot, scripted
from tests.rigs.ardrone import Ear, bench, make_drone
from tests.rigs.event_loops import virtual
from tests.rigs.vehicles import PATIENT_COPTER, PATIENT_PX4, Rig, ardupilot_rig, px4_rig

BOTH = {"ardupilot": ardupilot_rig, "px4": px4_rig}


@pytest.fixture(params=list(BOTH))
def on_rig(request: pytest.FixtureRequest) -> Callable[[Any], Any]:
    def run(test: Any) -> Any:
        async def main() -> Any:
            async with BOTH[request.param]() as rig:
                return await test(rig)

        return virtual(main())

    return run


def test_a_reboot_in_control_is_hands_off(on_rig: Any) -> None:
    async def test(rig: Rig) -> None:
        await rig.until(lambda: rig.vehicle.state() is not None)
        rig.vehicle.demand(Demand.FLY)
        await rig.until(lambda: rig.known().armed)
        rig.peer.reboot()
        await asyncio.sleep(10.0)
        assert not rig.known().in_control
        assert not rig.known().armed
        assert not any(await rig.stream(1.0))

    on_rig(test)


def test_armed_and_never_flown_it_disarms_and_only_a_new_demand_arms_again(on_rig: Any) -> None:
    async def test(rig: Rig) -> None:
        await rig.until(lambda: rig.vehicle.state() is not None)
        rig.vehicle.demand(Demand.FLY)
        await rig.until(lambda: rig.known().armed)
        await rig.until(lambda: not rig.known().armed, 12.0)  # nobody asked for a climb
        await asyncio.sleep(5.0)
        assert not rig.known().armed
        rig.vehicle.demand(Demand.STANDBY)
        rig.vehicle.demand(Demand.FLY)
        await rig.until(lambda: rig.known().armed)

    on_rig(test)


@pytest.mark.parametrize("height_m", [None, 1.0])
def test_the_pilots_disarm_switch_is_final(on_rig: Any, height_m: float | None) -> None:
    async def test(rig: Rig) -> None:
        await rig.until(lambda: rig.vehicle.state() is not None)
        rig.vehicle.demand(Demand.FLY)
        await rig.until(lambda: rig.known().armed)
        if height_m is not None:
            await rig.take_off(height_m)
        rig.peer.pilot_disarm()
        await rig.stream(4.0, climb_mps=0.5)
        assert not rig.known().armed
        assert rig.peer.truth().height_m == pytest.approx(0.1, abs=0.02)

    on_rig(test)


@pytest.mark.parametrize(
    ("make_rig", "alone_s"),
    [(partial(ardupilot_rig, patience=PATIENT_COPTER), 5.0), (partial(px4_rig, patience=PATIENT_PX4), 3.0)],
)
def test_a_daemon_that_died_in_the_air_and_comes_back_takes_the_flight_over(
    make_rig: Any, alone_s: float
) -> None:
    async def test() -> None:
        async with make_rig() as rig:
            await rig.take_off(1.5)
            rig.cut(True)  # it was killed: it says nothing more
            rig.flying_task.cancel()
            await asyncio.wait([rig.flying_task])
            rig.cut(False)
            address = rig.peer.address
            second = type(rig.vehicle)(f"udpout://{address[0]}:{address[1]}", LoopClock())
            running = asyncio.create_task(second.run())
            mode = rig.peer.mode
            rig.vehicle = second
            await asyncio.sleep(alone_s)
            assert rig.peer.mode == mode, "before any demand nothing is commanded"
            assert rig.peer.truth().height_m > 0.8
            second.demand(Demand.FLY)
            await rig.until(lambda: rig.known().in_control)
            assert all(await rig.stream(3.0))
            height_m = rig.peer.truth().height_m
            await rig.stream(2.0, climb_mps=0.3)
            assert rig.peer.truth().height_m > height_m + 0.3
            running.cancel()
            await asyncio.wait([running])

    virtual(test())


def test_one_found_flying_whose_parameters_are_not_answered_is_brought_down_all_the_same() -> None:
    """The heartbeats of the daemon that came back keep the autopilot's own failsafe from landing it."""

    async def test() -> None:
        async with ardupilot_rig(patience=PATIENT_COPTER) as rig:
            assert rig.flying_task is not None
            await rig.take_off(1.5)
            rig.cut(True)  # it was killed: it says nothing more
            rig.flying_task.cancel()
            await asyncio.wait([rig.flying_task])
            rig.cut(False)
            rig.peer.parameters.answer = lambda *_: None
            host, port = rig.peer.address
            rig.vehicle = second = ArduPilotVehicle(f"udpout://{host}:{port}", LoopClock())
            running = asyncio.create_task(second.run())
            await rig.until(lambda: second.state() is not None)
            second.demand(Demand.KEEP)
            await rig.until(lambda: rig.known().in_control, 1.5)
            assert "GUID_OPTIONS" in words(rig.known().refusal)
            assert not any(await rig.stream(1.0)), "what thrust means to it is not known"
            second.demand(Demand.LAND)
            await rig.until(lambda: not rig.peer.armed, 20.0)
            assert rig.peer.truth().height_m < 0.15
            running.cancel()
            await asyncio.wait([running])

    virtual(test())


@pytest.mark.parametrize(
    ("result", "text"),
    [
        (1, "temporarily rejected"),
        (2, "denied"),
        (3, "unsupported"),
        (4, "failed"),
        (6, "result 6"),
        (7, "wants COMMAND_LONG"),
        (8, "wants COMMAND_INT"),
        (9, "result 9"),
        (None, "no answer"),
    ],
)
@pytest.mark.parametrize(("command", "what"), [(176, "mode GUIDED_NOGPS"), (400, "arming")])
def test_every_answer_but_acceptance_is_told_and_tried_again(
    command: int, what: str, result: int | None, text: str
) -> None:
    async def test() -> None:
        autopilot = ScriptedAutopilot()
        autopilot.results[command] = result
        async with scripted(autopilot) as (_, vehicle):
            vehicle.demand(Demand.FLY)
            await asyncio.sleep(4.0)
            state = vehicle.state()
            assert state is not None
            assert words(state.refusal) == f"{what}: {text}"
            assert not state.armed
            assert len(autopilot.commands(command)) > 1
            autopilot.results[command] = 0
            await asyncio.sleep(4.0)
            state = vehicle.state()
            assert state is not None
            assert (state.in_control, state.armed, words(state.refusal)) == (True, True, "")

    virtual(test())


def test_the_ardrones_command_watchdog_is_reset_at_once() -> None:
    async def main() -> None:
        drone = make_drone()
        ear = Ear(drone)
        async with bench(drone) as b:
            await b.hovering()
            command, lost = drone.command, [True]
            drone.command = (  # type: ignore[method-assign]
                lambda datagram, now_ns: None if lost[0] else command(datagram, now_ns)
            )
            await asyncio.sleep(0.2)  # its watchdog takes 50 ms
            lost[0] = False
            ear.commands.clear()
            await b.until(lambda: ear.named("COMWDG"), limit_s=0.3)
            await asyncio.sleep(0.2)
            assert b.state.in_control

    virtual(main())
