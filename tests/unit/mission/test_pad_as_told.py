"""A drone that is told to land on another pad: it waits there for its next flight, and begins that from
there."""

from __future__ import annotations

from dataclasses import replace

import pytest

from flightd.config.battery import BatteryConfig
from flightd.config.scan import ScanConfig
from flightd.core.errors import InputError
from flightd.core.scanning import CountedPlace
from flightd.core.types import CommandKind, Phase
from flightd.mission.scan.no_scan import NO_SCAN, AnyScanner
from flightd.mission.scan.scanner import Scanner
from flightd.site.site import Pad, Site
from flightd.site.site_file import parse_site, site_toml
from tests.unit.mission import shelves
from tests.unit.mission.configured import configured
from tests.unit.mission.driven import Flight
from tests.unit.mission.states import start

GOTO, PLAN, START, HOME = CommandKind.GOTO, CommandKind.PLAN, CommandKind.START, CommandKind.HOME
DOCK = Pad("dock", "A3", 0.5, start=False, shared=True)
HALL = replace(shelves.SITE, pads=(*shelves.SITE.pads, DOCK))


def flown(site: Site = HALL, scanner: AnyScanner = NO_SCAN, battery: BatteryConfig | None = None) -> Flight:
    """A flight that holds over A2."""
    flight = Flight(configured(battery, dwell_s=0.5, autostart=False), site, scanner)
    flight.run(0.2)
    flight.order(PLAN, nodes=("A2",), waits=True)
    start(flight)
    flight.to(Phase.HOLD, 120.0)
    return flight


def unseeing() -> Scanner:
    """A scanner that never gets a picture."""
    return Scanner(HALL, shelves.SIGHT, ScanConfig(max_height_m=4.0, view_s=0.4, retakes=0))


def lands_at(flight: Flight) -> str:
    return flight.mission.outlook(flight.now_ns).lands_at


def test_it_waits_on_the_pad_that_it_was_told_and_flies_on_from_there() -> None:
    flight = flown()
    assert lands_at(flight) == HALL.home.node
    flight.order(GOTO, "A3", lands=True)
    assert lands_at(flight) == "A3"
    assert flight.land() is Phase.PREFLIGHT
    assert flight.mission.stand[0] == "A3"
    flight.run(30.0)
    assert flight.phase is Phase.PREFLIGHT, "nobody ordered another flight"
    assert {PLAN, START} <= flight.mission.possible_commands
    assert flight.mission.planned(("A2",), best_order=False).way[0] == "A3"
    flight.order(PLAN, nodes=("A2",), waits=True)
    start(flight)
    flight.to(Phase.HOLD, 120.0)
    flight.order(HOME)
    assert lands_at(flight) == HALL.home.node
    assert flight.land() is Phase.ABORTED


def test_each_flight_counts_its_own_nodes() -> None:
    flight = flown()
    assert list(flight.mission.visited) == ["A2"]
    flight.order(GOTO, "A3", lands=True)
    assert flight.land() is Phase.PREFLIGHT
    assert list(flight.mission.visited) == []
    flight.order(PLAN, nodes=("A4", "A2"), waits=True)
    start(flight)
    flight.to(Phase.HOLD, 120.0)
    assert list(flight.mission.visited) == ["A4", "A2"]
    begun = [event.text for event in flight.mission.drain_events() if event.name == "phase"]
    assert sum(text.startswith("preflight -> arming:") for text in begun) == 2, "by that a station knows"


def test_what_an_earlier_flight_visited_is_nothing_done_on_the_battery_in_hand() -> None:
    flight = flown(battery=BatteryConfig(swap=True))
    flight.order(GOTO, "A3", lands=True)
    assert flight.land() is Phase.PREFLIGHT
    flight.order(PLAN, nodes=("A2", "A4"))
    start(flight)
    flight.run(120.0, until=lambda: len(flight.mission.visited) == 1)
    flight.set(battery_frac=0.15)
    assert flight.land() is Phase.SWAP


def test_where_it_holds_already_it_comes_down() -> None:
    flight = flown()
    flight.order(GOTO, "A3", waits=True)
    flight.to(Phase.FOLLOW)
    flight.to(Phase.HOLD, 120.0)
    flight.order(GOTO, "A3", lands=True)
    assert flight.land() is Phase.PREFLIGHT
    assert flight.mission.stand[0] == "A3"


@pytest.mark.parametrize("what", ["battery", "person", "another node"])
def test_what_turns_it_from_there_brings_it_home(what: str) -> None:
    flight = flown()
    flight.order(GOTO, "A3", lands=True)
    flight.to(Phase.FOLLOW)
    if what == "battery":
        flight.set(battery_frac=0.15)
        flight.run(0.04)
    elif what == "person":
        flight.order(HOME)
    else:
        flight.order(GOTO, "A2")
    assert lands_at(flight) == HALL.home.node
    assert flight.land() in {Phase.ABORTED, Phase.DONE}


def test_by_itself_it_never_turns_to_a_pad_that_is_shared() -> None:
    assert [pad.id for pad in HALL.own_charge_pads] == [HALL.home.id]
    only = replace(HALL, pads=(replace(HALL.home, charge=False), DOCK))
    assert [pad.id for pad in only.own_charge_pads] == [HALL.home.id], "where none charges, home"


def test_a_shared_pad_is_written_and_read_and_nobody_starts_there_at_first() -> None:
    text = site_toml(HALL)
    assert parse_site(text, "hall").pads == HALL.pads
    with pytest.raises(InputError, match=r"pad\[1\] \(dock\).shared: needs charge"):
        parse_site(text.replace("start = false\nshared", "shared"), "hall")


def test_its_next_flight_counts_anew_what_an_earlier_one_has_counted() -> None:
    scanner = unseeing()
    flight = flown(scanner=scanner)
    scanner.go_on_with(map(CountedPlace, HALL.locations))
    assert not scanner.wants("A2")
    flight.order(GOTO, "A3", lands=True)
    assert flight.land() is Phase.PREFLIGHT
    assert scanner.wants("A2")


def test_it_lands_nowhere_from_where_no_way_leads_home() -> None:
    edges = (replace(edge, one_way=(edge.a, edge.b) == ("A2", "A3")) for edge in HALL.edges)
    there = replace(HALL, edges=tuple(edges))
    flight = flown(there)
    flight.order(GOTO, "A3", lands=True)
    assert lands_at(flight) == there.home.node
    assert any("goto A3 refused" in event.text for event in flight.mission.drain_events())


def test_a_flight_that_saw_no_shelf_says_so_on_the_pad_that_it_was_told() -> None:
    flight = flown(scanner=unseeing())
    flight.order(GOTO, "A3", lands=True)
    assert flight.land() is Phase.PREFLIGHT
    assert [event.name for event in flight.mission.drain_events()].count("not_counted") == 1
