"""Whole missions that count shelves, flown by ideal sight and an ideal code reader."""

from __future__ import annotations

import math
import os
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from flightd.config.mission import Heading
from flightd.config.schema import load_config
from flightd.config.sweep import ScanMode
from flightd.core.inventory import LocationState
from flightd.core.scanning import CountedPlace, Finding
from flightd.core.types import Command, CommandKind, EventLevel, Phase
from flightd.site.site import Site
from flightd.site.site_file import load_site
from tests.rigs.brisk import BRISK
from tests.sim.ideal.ideal_flight import Flown, IdealFlight
from tests.sim.ideal.ideal_front import IdealFront, Label, Stock
from tests.unit.mission.shelves import FITTED, SIGHT, SITE

CONFIG = load_config(Path(__file__).parents[3] / "configs" / "sim.toml").with_values(
    front_camera=FITTED, scan={"mode": ScanMode.STOP}, mission=BRISK
)
NODES = ("A2", "A3")
PLACES = [place.code for place in SITE.locations.values() if place.node in NODES]
EMPTY, TORN, COVERED, TWO, *READ = PLACES
LABELS = {code: [Label(f"PALLET {code}", 0.1, 0.1)] for code in [*READ, TORN]}
STOCK = Stock(
    LABELS | {TWO: [Label("FRONT", -0.1), Label("SECOND", 0.1)]},
    frozenset({EMPTY}),
    frozenset({TORN}),
    frozenset({COVERED}),
)
PLAIN = Stock(
    LABELS | {code: [Label(f"PALLET {code}", 0.1, 0.1)] for code in (COVERED, TWO, TORN)}, STOCK.empty
)
"""Nothing that is looked at again from elsewhere, for what takes no notice of it: a flight half as long."""

ONE_SIDED = replace(
    SITE, locations={code: place for code, place in SITE.locations.items() if place.side == "left"}
)
"""Half of the shelves on the map, for what takes no notice of the side."""


def scan_flight(
    visits: tuple[str, ...] = NODES, seed: int = 5, site: Site = SITE, stock: Stock = STOCK, **others: Any
) -> IdealFlight:
    front = IdealFront(SITE, SIGHT, stock)
    return IdealFlight(site, CONFIG, visits=visits, seed=seed, front=front, **others)


def places_of(site: Site, *nodes: str) -> set[str]:
    return {place.code for place in site.locations.values() if place.node in nodes}


def findings(flown: Flown) -> dict[str, Finding]:
    found = [finding for output in flown.outputs for finding in output.findings]
    assert len({finding.location for finding in found}) == len(found), "one state for each location"
    return {finding.location: finding for finding in found}


def test_a_flight_counts_every_location_of_its_nodes_and_proves_them_at_home() -> None:
    flown = scan_flight().fly()
    assert (flown.phase, flown.visited) == (Phase.DONE, list(NODES))
    found = findings(flown)
    assert {code: finding.state for code, finding in found.items()} == {
        EMPTY: LocationState.EMPTY,
        TORN: LocationState.UNREADABLE,
        COVERED: LocationState.OCCLUDED,
        TWO: LocationState.SEVERAL,
    } | dict.fromkeys(READ, LocationState.READ)
    for code in READ:
        assert [read.text for read in found[code].reads] == [f"PALLET {code}"]
    confirmed = {c for output in flown.outputs for s in output.settled if s.confirmed for c in s.locations}
    assert confirmed == set(PLACES)
    assert Counter(output.phase for output in flown.outputs)[Phase.SCAN] > 0


def test_what_was_not_proven_when_it_landed_is_left_over_for_the_next_flight() -> None:
    flight = scan_flight(site=ONE_SIDED, stock=PLAIN)
    assert flight.pilot.left_over == NODES
    at_last: list[tuple[str, ...]] = []

    def order(phase: Phase, now_ns: int) -> None:
        mission = flight.pilot.mission
        if phase is Phase.SCAN and mission.goal.node == NODES[-1] and not at_last:
            at_last.append(mission.remaining)
            mission.command(Command("1", CommandKind.LAND), now_ns)

    flight.on_tick = order
    flown = flight.fly()
    assert (flown.phase, at_last) == (Phase.ABORTED, [NODES[-1:]])
    assert set(findings(flown)) >= places_of(ONE_SIDED, "A2")
    assert flight.pilot.left_over == NODES
    rest = scan_flight(flight.pilot.left_over, site=ONE_SIDED, stock=PLAIN)
    assert rest.fly().phase is Phase.DONE
    assert rest.pilot.left_over == (), "all is proven"


def test_a_pause_amid_a_scan_loses_and_doubles_nothing() -> None:
    flight = scan_flight(("A2",), site=ONE_SIDED)
    paused: list[int] = []

    def order(phase: Phase, now_ns: int) -> None:
        mission = flight.pilot.mission
        if phase is Phase.SCAN and not paused:
            mission.command(Command("1", CommandKind.PAUSE), now_ns)
            paused.append(now_ns)
        elif phase is Phase.HOLD and now_ns - paused[0] > 3_000_000_000:
            mission.command(Command("2", CommandKind.RESUME), now_ns)

    flight.on_tick = order
    flown = flight.fly()
    assert flown.phase is Phase.DONE
    assert set(findings(flown)) == places_of(ONE_SIDED, "A2")


def test_going_home_ends_the_scan_at_once() -> None:
    flight = scan_flight()

    def order(phase: Phase, now_ns: int) -> None:
        if phase is Phase.SCAN and flight.pilot.mission.goal.visit:
            flight.pilot.mission.command(Command("1", CommandKind.HOME), now_ns)
            flight.on_tick = lambda _phase, _now_ns: None

    flight.on_tick = order
    flown = flight.fly()
    assert flown.phase is Phase.ABORTED
    assert len(findings(flown)) < len(PLACES)


def test_locations_counted_before_are_not_looked_at_again() -> None:
    flight = scan_flight()
    flight.counted = tuple(map(CountedPlace, PLACES[:-1]))
    flown = flight.fly()
    assert flown.visited == list(NODES)
    assert set(findings(flown)) == {PLACES[-1]}


def test_without_racks_the_drone_hovers_and_goes_on() -> None:
    bare = replace(SITE, racks=(), locations={})
    flown = IdealFlight(bare, CONFIG, visits=("A2",), seed=5).fly()
    assert (flown.phase, flown.visited) == (Phase.DONE, ["A2"])
    assert Phase.SCAN not in {output.phase for output in flown.outputs}


def test_with_the_nose_to_the_shelf_no_leg_begins_with_half_a_turn() -> None:
    front = IdealFront(SITE, SIGHT, PLAIN)
    config = CONFIG.with_values(mission={"heading": Heading.SHELF})
    flight = IdealFlight(SITE, config, visits=NODES, seed=5, front=front)
    flown = flight.fly()
    assert set(findings(flown)) == set(PLACES)
    sides = [phase for phase, k in flown.truth if phase is Phase.TURN]
    assert len(sides) * 0.02 < 0.5 * len(NODES) * math.pi / CONFIG.mission.turn_rate_radps


def test_from_aisle_to_aisle_it_flies_where_it_sees_both() -> None:
    """The last view of a node is a low one, from which a line 3.4 m off is long out of sight."""
    site = load_site(Path(__file__).parents[3] / "configs" / "site-racks-small.toml")
    visits = ("A1", "B1")
    labels = {
        code: [Label(f"PALLET {code}")] for code, place in site.locations.items() if place.node in visits
    }
    front = IdealFront(site, SIGHT, Stock(labels))
    flown = IdealFlight(site, CONFIG, visits=visits, seed=5, front=front).fly()
    assert (flown.phase, flown.visited) == (Phase.DONE, list(visits))
    between = [k.height_m for phase, k in flown.truth if phase is Phase.FOLLOW and 1.2 < k.y_m < 2.2]
    assert min(between) > CONFIG.mission.height_m - 0.3
    assert Phase.RELOCATE not in {output.phase for output in flown.outputs}


@pytest.mark.parametrize("phase", [Phase.CLIMB, Phase.SCAN])
@pytest.mark.parametrize("seed", range(1, 1 + int(os.environ.get("FLIGHTD_SEEDS", "1"))))
def test_going_blind_in_front_of_a_shelf_is_down_before_it_drifts_there(phase: Phase, seed: int) -> None:
    flight = scan_flight(("A2",), seed)

    def blind(now: Phase, _now_ns: int) -> None:
        flight.faults.blank |= now is phase and flight.airframe.height_m > 1.0

    flight.on_tick = blind
    flown = flight.fly(60)
    assert flight.faults.blank
    assert flown.phase is Phase.ABORTED
    assert flown.truth[-1][1].height_m < 0.2
    nearest = min(
        math.hypot(max(s.x0_m - k.x_m, 0.0, k.x_m - s.x1_m), k.y_m - s.y_m)
        for s in SITE.shelves
        for _, k in flown.truth
    )
    assert nearest > 0.3, "half the width of the drone"
    events = [event.text for event in flown.events if event.name == "hazard"]
    assert any("camera" in text for text in events), events


@pytest.mark.parametrize("elsewhere", [False, True])
def test_a_doubt_on_the_way_costs_no_location(elsewhere: bool) -> None:
    """It ends where it began and all stays, or it ends elsewhere and what is withdrawn is counted again."""
    doubted = list[str]()
    flight = scan_flight(site=ONE_SIDED, stock=PLAIN)

    def doubt(phase: Phase, now_ns: int) -> None:
        visited = flight.pilot.mission.visited
        if phase is Phase.FOLLOW and visited and not doubted:
            doubted.append(visited[0])
            flight.pilot.scanner.doubt()
            if elsewhere:
                flight.pilot.scanner.withdraw(now_ns, "elsewhere")

    flight.on_tick = doubt
    flown = flight.fly()
    assert (flown.phase, set(flown.visited), len(flown.visited)) == (Phase.DONE, set(NODES), len(NODES))
    settled = [s for output in flown.outputs for s in output.settled]
    assert {code for s in settled if s.confirmed for code in s.locations} == places_of(ONE_SIDED, *NODES)
    assert any(not s.confirmed for s in settled) is elsewhere
    visits = [event.text for event in flown.events if event.name == "visited"]
    assert visits.count(doubted[0]) == 1 + elsewhere


def test_a_reader_that_never_answers_is_no_completed_count() -> None:
    flight = IdealFlight(ONE_SIDED, CONFIG, visits=("A2",), seed=5)
    flown = flight.fly()
    assert flown.phase is Phase.ABORTED
    assert "no picture of a shelf was read" in flown.reason
    assert [event.level for event in flown.events if event.name == "not_counted"] == [EventLevel.ERROR]
    pad = flown.truth[-1][1]
    assert math.hypot(pad.x_m, pad.y_m) < 0.3, "it comes home all the same"
