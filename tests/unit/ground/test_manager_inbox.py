"""What a fleet's manager says while a drone is not heard, and more than is taken."""

from __future__ import annotations

import asyncio

import pytest

from flightd.fleet.vda5050.codec import MalformedError, Version
from flightd.fleet.vehicle.signals import Malformed, Missed
from flightd.ground.mqtt.manager_inbox import ManagerInbox
from tests.rigs.event_loops import virtual
from tests.unit.fleet.vehicle_rig import instant, order
from tests.unit.ground.managed_rig import Managed


@pytest.mark.parametrize("version", list(Version))
def test_an_order_that_came_while_the_drone_was_not_heard_sends_nobody_off_later(version: Version) -> None:
    demo = Managed(version)

    async def go() -> None:
        async with demo.flown():
            demo.heard(False)
            await asyncio.sleep(60.0)
            demo.drone.hear(order("A1 A2"))
            await asyncio.sleep(1200.0)
            demo.heard()
            await asyncio.sleep(10.0)
            assert demo.link.asked == []
            assert (demo.errors, demo.state.order_id) == (["DRONE_NOT_HEARD"], "")
            told = {one.info_type: one.info_descriptor for one in demo.state.information or ()}
            assert told["droppedMessages"] == "1 since the station began"
            assert [line[2] for line in demo.written] == ["refused"]
            demo.drone.hear(order("A1 A2", name="again"))
            await asyncio.sleep(10.0)
            assert (demo.errors, demo.link.asked[:1]) == ([], ["plan A2, to wait there"])

    virtual(go())


def test_what_comes_as_the_drone_is_missed_for_a_moment_is_taken() -> None:
    demo = Managed()

    async def go() -> None:
        async with demo.flown():
            demo.heard(False)
            demo.drone.hear(order("A1 A2"))
            await asyncio.sleep(4.0)
            demo.heard()
            await asyncio.sleep(5.0)
            assert (demo.errors, demo.state.order_id) == ([], "o")

    virtual(go())


def test_who_was_not_heard_is_held_and_cancelled_late_but_not_sent_on() -> None:
    demo = Managed()

    async def go() -> None:
        async with demo.flown():
            demo.drone.hear(order("A1 A2 A3"))
            demo.drone.hear(instant("startPause", "held"))
            await asyncio.sleep(1.0)
            demo.heard(False)
            demo.drone.hear(instant("stopPause", "on"))
            await asyncio.sleep(600.0)
            demo.heard()
            await asyncio.sleep(5.0)
            assert demo.link.asked == []
            assert (demo.actions["on"], demo.state.paused) == ("FAILED", True)
            assert demo.errors == ["INVALID_INSTANT_ACTION"]
            demo.heard(False)
            demo.drone.hear(instant("cancelOrder", "off"))
            await asyncio.sleep(600.0)
            demo.heard()
            await asyncio.sleep(1.0)
            assert (demo.actions["off"], demo.drone.vehicle.is_idle) == ("FINISHED", True)

    virtual(go())


def test_no_number_of_questions_takes_the_place_of_a_cancel() -> None:
    demo = Managed()

    async def go() -> None:
        async with demo.flown():
            demo.drone.hear(order("A1 A2 A3"))
            await asyncio.sleep(1.0)
            demo.heard(False)
            for i in range(40):
                demo.drone.hear(instant("stateRequest", f"before {i}"))
            demo.drone.hear(instant("cancelOrder", "off"))
            for i in range(40):
                demo.drone.hear(instant("stateRequest", f"after {i}"))
            await asyncio.sleep(4.0)
            demo.heard()
            await asyncio.sleep(1.0)
            assert (demo.actions["off"], demo.drone.vehicle.is_idle) == ("FINISHED", True)
            assert demo.actions["before 0"] == "FINISHED"
            assert {demo.actions[f"after {i}"] for i in range(16, 40)} == {"FAILED"}
            assert "after 15" not in demo.actions, "counted alone"
            assert "INVALID_INSTANT_ACTION" in demo.errors
            told = {one.info_type: one.info_descriptor for one in demo.state.information or ()}
            assert told["droppedMessages"] == "48 since the station began"

    virtual(go())


def test_who_sends_more_than_is_taken_is_told_of_each_of_the_newest() -> None:
    inbox = ManagerInbox("demo")
    for i in range(35):
        inbox.hear(order("A1 A2", number=i), 0.0)
    inbox.hear(instant("stateRequest", "after them"), 0.0)
    taken = inbox.take()
    assert len(taken) == 36
    refusals = [one.refusal.error for one in taken[32:] if isinstance(one, Missed)]
    assert refusals == ["INSUFFICIENT_MEMORY"] * 3 + ["INVALID_INSTANT_ACTION"]
    assert inbox.dropped == 4
    assert inbox.take() == []
    wrong = Malformed("order", MalformedError("no JSON", told={}))
    for _ in range(100):
        inbox.hear(wrong, 0.0)
    assert (inbox.take(), inbox.dropped) == ([wrong] * 56, 72)
