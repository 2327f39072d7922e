"""What goes wrong in flight is told a fleet's manager by the standard's own names and levels."""

from __future__ import annotations

from pathlib import Path

import pytest

from flightd.core.errors import InputError
from flightd.core.types import CommandKind
from flightd.fleet.vda5050.codec import Version, encoded
from tests.rigs.broker import Mosquitto, mosquitto
from tests.rigs.event_loops import real
from tests.rigs.waiting import until
from tests.unit.fleet.vehicle_rig import order
from tests.web.fleet_manager import Manager, and_a_turn
from tests.web.paper_station import managed_drone

_LEVELS = {Version.V2_1: ("FATAL", "FATAL"), Version.V3_0: ("CRITICAL", "FATAL")}
_SPEED = 4.0


@pytest.mark.parametrize("version", list(Version))
def test_a_node_that_cannot_be_reached_and_a_lost_position_are_told_word_for_word(
    version: Version, tmp_path: Path
) -> None:
    unreachable, lost = _LEVELS[version]

    async def go(broker: Mosquitto) -> None:
        manager = Manager(version, "a")

        def errors() -> list[tuple[str, str]]:
            return [(one["errorType"], one["errorLevel"]) for one in manager.last("state").get("errors", [])]

        async with manager.watching(broker), managed_drone(broker, version) as drone:
            await until(lambda: manager.last("state").get("lastNodeId") == "A1")
            await manager.say("order", encoded(order("A1 A2", number=0), version))
            await until(lambda: drone.waits_at == "A2" and manager.last("state")["lastNodeId"] == "A2")
            assert errors() == []
            drone.refuses[CommandKind.GOTO] = InputError("refused: a pallet stands there")
            await manager.say("order", encoded(order("A2 A3", number=1, first=2), version))
            await until(lambda: errors() == [("NODE_UNREACHABLE", unreachable)])
            assert manager.last("state")["errors"][0]["errorDescription"] == "a pallet stands there"
            drone.refuses.clear()
            drone.sees = False
            await until(lambda: errors() == [("LOCALIZATION_ERROR", lost)])
            drone.sees = True
            await until(lambda: errors() == [] and manager.last("state")["lastNodeId"] == "A3")

    with mosquitto(tmp_path) as broker:
        real(and_a_turn(go(broker)), _SPEED)
