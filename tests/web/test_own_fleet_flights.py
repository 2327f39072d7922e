"""The station flies drones of one hall by traffic control: the daemon's own tick and mission on real ground
links."""

from __future__ import annotations

import pytest

from flightd.core.types import Phase
from tests.rigs.event_loops import real
from tests.rigs.waiting import until
from tests.web.live_flight import LiveFlight
from tests.web.own_fleet_rig import flown, waiting

_SPEED = 5.0


@pytest.mark.realtime(cores=0.8)
def test_a_drone_visits_its_nodes_round_one_that_a_person_took_and_one_that_fell_silent() -> None:
    written: list[tuple[str, str, str, str]] = []

    async def go(flights: dict[str, LiveFlight]) -> None:
        a, b, c = (flights[name] for name in "abc")
        async with flown(flights, _SPEED, written) as fleet:
            await fleet.until_told("flies", lambda flies: flies)
            for drone, nodes in (("b", ["B3"]), ("c", ["B4"]), ("a", ["A3"])):
                asked = await fleet.ask("POST", "/api/fleet/tour", {"nodes": nodes, "drone": drone})
                assert asked == (200, {})
            await until(lambda: c.phase is Phase.FOLLOW and c.at_m[0] < 7.0, 90)
            c.fall_silent()
            await until(lambda: b.phase is Phase.FOLLOW and b.at_m[0] > 2.1, 90)
            b.pace(0.5)  # it comes to B3 no sooner than the act to it
            assert (await fleet.station.act("b", id="by-ann-1", command="pause"))[0] == 200
            await fleet.until_told("done", lambda done: done == ["A3"])
            await fleet.until_told("drones", lambda told: [n for n in told if told[n]["flown"]] == ["a"])
            await until(lambda: a.phase is Phase.DONE, 120)
            assert "A3" in fleet.passed["a"]
            assert b.phase is Phase.HOLD
            assert (await fleet.ask("POST", "/api/fleet/stop"))[0] == 200
            await until(lambda: b.phase in {Phase.LAND, Phase.ABORTED}, 60)
            assert fleet.judge.faults == []

    with waiting("abc") as flights:
        real(go(flights))
    flown_by = {drone for what, drone, outcome, _ in written if (what, outcome) == ("start", "accepted")}
    assert flown_by == {"a", "b", "c"}
