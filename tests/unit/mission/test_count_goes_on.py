"""A count that another flight goes on with: what was booked before is compared with what is found now."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection
from dataclasses import replace

import pytest

from flightd.config.schema import Config
from flightd.config.sweep import ScanMode
from flightd.core.scanning import CountedPlace
from flightd.core.types import Command, CommandKind, Phase
from flightd.site.site import Pad, Site
from tests.sim.ideal.ideal_front import IdealFront, Label, Stock
from tests.unit.mission.shelves import BARE_ENDS, SIGHT, read
from tests.unit.mission.test_sweep_flight import Sweep, booked_of, config, flight_order, labels_of

ONE, OTHER = "AL-02-2-2", "CR-04-1-1"
LABELS = labels_of(BARE_ENDS) | {code: [Label("PALLET 9")] for code in (ONE, OTHER)}
AT_C4 = {place.code for place in BARE_ENDS.locations.values() if place.node == "C4"}


def by_stops(mode: ScanMode = ScanMode.STOP, scan: dict[str, int] | None = None) -> Config:
    """A drone that flies as ordered, and may change its battery."""
    by_order = {"autostart": False, "start_countdown_s": 0.0}
    return config().with_values(scan={"mode": mode} | (scan or {}), mission=by_order, battery={"swap": True})


def going_on(
    left: Collection[str],
    site: Site = BARE_ENDS,
    mode: ScanMode = ScanMode.STOP,
    levels: tuple[int, ...] = (),
    *,
    waits: bool = False,
    scan: dict[str, int] | None = None,
) -> Sweep:
    """A flight to the nodes at which places were left uncounted; the others were read as they are."""
    flight = Sweep(by_stops(mode, scan), Stock(LABELS), site)
    counted = [
        CountedPlace(code, (read(LABELS[code][0].text),)) for code in site.locations if code not in left
    ]
    flight.scanner.go_on_with(counted)
    nodes = tuple(sorted({site.locations[code].node for code in left}))
    plan = Command("1", CommandKind.PLAN, nodes=nodes, levels=levels, waits=waits)
    flight.mission.command(plan, flight.now_ns)
    flight.run(0.2)
    flight.order(CommandKind.START)
    return flight


@pytest.mark.parametrize("mode", ScanMode)
def test_a_pallet_that_was_booked_elsewhere_is_looked_for_at_both_places_again(mode: ScanMode) -> None:
    flight = going_on(AT_C4, mode=mode)
    flight.fly(900.0, until=lambda: bool(flight.said("contradiction")))
    withdrawn = [code for one in flight.settled if one.booked for code in one.locations]
    assert sorted(withdrawn) == [ONE, OTHER]
    flight.fly(900.0)
    assert flight.mission.state.on_pad, flight.mission.reason
    a, b = flight_order(flight, ONE, OTHER)
    assert flight.said("contradiction") == [
        f"one code at {ONE} and {OTHER}: to be looked at again",
        f"one code at {a} and {b}: counted at each",
    ]
    assert flight.said("recount") == ["A2, C4 to visit again"]
    assert Counter(booked_of(flight)) == Counter([ONE, *AT_C4])
    found = Counter(finding.location for finding in flight.findings)
    assert found == Counter([ONE, OTHER, *AT_C4])


def test_what_hangs_at_two_places_as_earlier_flights_found_is_asked_about_no_more() -> None:
    flight = going_on(AT_C4 - {OTHER})
    third = min(AT_C4 - {OTHER})
    flight.front = IdealFront(BARE_ENDS, SIGHT, Stock(LABELS | {third: [Label("PALLET 9")]}))
    flight.fly(900.0)
    assert flight.mission.state.on_pad, flight.mission.reason
    assert flight.said("contradiction") == []
    assert sorted(booked_of(flight)) == sorted(AT_C4 - {OTHER})


def test_a_place_on_a_level_that_is_not_counted_now_is_withdrawn_and_left() -> None:
    flight = going_on(AT_C4, levels=(1,))
    flight.fly(900.0)
    assert flight.mission.state.on_pad, flight.mission.reason
    assert len(flight.said("contradiction")) == 1
    assert flight.said("recount") == ["C4 to visit again"]
    assert ONE in {code for one in flight.settled if one.booked for code in one.locations}
    assert ONE not in flight.states


def test_a_place_to_which_no_open_way_leads_is_told_and_the_other_looked_at_again() -> None:
    closed = replace(BARE_ENDS, blocked=(("A1", "A2"), ("A2", "A3")))
    flight = going_on(AT_C4, closed)
    flight.fly(900.0)
    assert flight.mission.state.on_pad, flight.mission.reason
    assert [text.split(":")[0] for text in flight.said("recount")] == ["A2 left out", "C4 to visit again"]
    assert sorted(booked_of(flight)) == sorted(AT_C4)


def relocated(flight: Sweep) -> None:
    """Until it has lost its position, and found it again."""
    flight.integrity = 0.3
    flight.fly(30.0, until=lambda: flight.phase is Phase.RELOCATE)
    assert flight.phase is Phase.RELOCATE, flight.mission.reason
    flight.integrity = 1.0
    flight.fly(30.0, until=lambda: flight.phase is not Phase.RELOCATE)
    flight.fly(1.0)


def test_a_place_that_cannot_be_reached_costs_no_other_its_look_after_a_doubt() -> None:
    flight = going_on(
        {code for code, place in BARE_ENDS.locations.items() if place.node in {"B3", "C4"}},
        replace(BARE_ENDS, blocked=(("A1", "A2"), ("A2", "A3"))),
        scan={"confirm_stops": 20},
    )
    flight.fly(900.0, until=lambda: bool(flight.said("contradiction")))
    flight.scanner.withdraw(flight.now_ns, "its labels are another node's")
    flight.scanner.doubted = True
    for wanted in (True, False):
        flight.fly(30.0, until=lambda: (flight.phase is Phase.RELOCATE) is wanted)  # noqa: B023
    flight.fly(900.0)
    assert flight.mission.state.on_pad, flight.mission.reason
    assert "A2" in {text.split(" left out")[0] for text in flight.said("recount")}
    assert not flight.scanner.wants("B3")
    assert not flight.scanner.wants("C4")


def test_one_that_is_led_flies_to_no_place_by_itself_after_a_doubt() -> None:
    flight = going_on(AT_C4, waits=True)
    flight.fly(900.0, until=lambda: bool(flight.said("contradiction")))
    relocated(flight)
    goals = set[str]()

    def holds() -> bool:
        goals.add(flight.mission.goal.node)
        return flight.phase is Phase.HOLD

    flight.fly(300.0, until=holds)
    assert flight.phase is Phase.HOLD
    assert goals == {"C4"}
    assert flight.said("recount") == []


def test_the_next_flight_of_a_daemon_is_compared_with_the_one_before() -> None:
    hall = replace(BARE_ENDS, pads=(*BARE_ENDS.pads, Pad("dock", "C5", 0.5, start=False, shared=True)))
    flight = Sweep(by_stops(), Stock(LABELS), hall)
    flight.run(0.2)
    for node, lands in (("A2", True), ("C4", False)):
        flight.order(CommandKind.PLAN, nodes=(node,), waits=lands)
        flight.run(0.2)
        flight.order(CommandKind.START)
        if lands:
            flight.fly(300.0, until=lambda: flight.phase is Phase.HOLD)
            flight.order(CommandKind.GOTO, "C5", lands=True)
        flight.fly(900.0)
        flight.down()
        flight.run(0.1)
        flight.set(height_m=0.1)
        flight.run(0.2)
    first, *_ = flight.said("contradiction")
    assert first == f"one code at {ONE} and {OTHER}: to be looked at again"
    withdrawn = [code for one in flight.settled if one.booked for code in one.locations]
    assert sorted(withdrawn) == [ONE, OTHER]


def came_down(flight: Sweep) -> Phase:
    """What becomes of a flight whose battery is low now."""
    flight.set(battery_frac=0.15)
    flight.fly(900.0)
    assert flight.mission.state.on_pad, flight.mission.reason
    flight.down()
    return flight.phase


def test_a_battery_on_which_more_was_taken_back_than_counted_is_not_the_last() -> None:
    at_b3 = next(code for code, place in BARE_ENDS.locations.items() if place.node == "B3")
    flight = going_on((at_b3, OTHER))
    flight.fly(900.0, until=lambda: bool(flight.said("visited")))
    assert came_down(flight) is Phase.SWAP
    flight.set(battery_frac=0.9, height_m=0.1)
    flight.run(0.2)
    flight.order(CommandKind.START)
    flight.fly(900.0, until=lambda: bool(flight.said("recount")))
    assert came_down(flight) is Phase.SWAP
    assert {"A2", "C4"} <= {*flight.mission.remaining}


def test_what_an_earlier_flight_has_counted_is_nothing_done_on_the_battery_in_hand() -> None:
    flight = going_on(AT_C4)
    flight.fly(until=lambda: flight.phase is Phase.FOLLOW)
    assert came_down(flight) is Phase.DONE
