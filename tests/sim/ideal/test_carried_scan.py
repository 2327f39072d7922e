"""Shelves counted by a drone that is sure of the wrong node: its labels find it out, nothing is booked."""

from __future__ import annotations

from pathlib import Path

import pytest

from flightd.config.schema import load_config
from flightd.config.sweep import ScanMode
from flightd.core.inventory import LocationState
from flightd.core.types import Phase
from flightd.site.site import Site
from flightd.site.site_file import parse_site
from tests.rigs.brisk import BRISK
from tests.sim.ideal.ideal_flight import Flown, IdealFlight
from tests.sim.ideal.ideal_front import IdealFront, Label, Stock
from tests.sim.ideal.test_carried import wrong_visits
from tests.unit.mission.shelves import FITTED, SIGHT

CONFIG = load_config(Path(__file__).parents[3] / "configs" / "sim.toml").with_values(
    front_camera=FITTED, scan={"mode": ScanMode.STOP}, mission=BRISK
)
ALIKE = parse_site(
    """
[site]
name = "alike"
ceiling_m = 6.0

[[aisle]]
id = "A"
x_m = 0.0
y_m = 0.0
spacing_m = [1.3, 1.3, 1.3, 1.3, 1.3, 1.3, 1.3]
shelf_height_m = 2.4

[[rack]]
bay_width_m = 1.3
levels_m = [0.9]
positions = 3
sides = ["left"]

[[pad]]
id = "home"
node = "A4"
""",
    "alike",
)
SURE = {"expert": {"carried": 1e-6}}
"""The pad is believed without a doubt, so that only the shelves can say otherwise."""


def stock(
    site: Site, swapped: dict[str, str] | None = None, unlabelled: frozenset[str] = frozenset()
) -> Stock:
    """A pallet in every place and each place's own label below it; `swapped` ones hang wrong, those of
    `unlabelled` nodes are gone."""
    told = swapped or {}
    labels = {}
    for code, place in site.locations.items():
        labels[code] = [Label(f"PALLET {code}", 0.1, 0.1)]
        if place.node not in unlabelled:
            labels[code].append(Label(told.get(code, code), 0.0, -0.12, 0.04))
    return Stock(labels)


def fly(visits: tuple[str, ...], carried_to: str, goods: Stock) -> Flown:
    config = CONFIG.with_values(localisation=SURE)
    front = IdealFront(ALIKE, SIGHT, goods)
    flight = IdealFlight(ALIKE, config, visits=visits, seed=6, front=front, carried_to=carried_to)
    return flight.fly(300)


def booked(flown: Flown) -> dict[str, tuple[str, ...]]:
    """What stands in the inventory at the end: confirmed findings, by location."""
    pending: dict[str, tuple[str, ...]] = {}
    confirmed: dict[str, tuple[str, ...]] = {}
    for output in flown.outputs:
        for finding in output.findings:
            assert finding.state is LocationState.READ
            pending[finding.location] = tuple(read.text for read in finding.reads)
        for settled in output.settled:
            for code in settled.locations:
                text = pending.pop(code)
                if settled.confirmed:
                    confirmed[code] = text
    assert not pending
    return confirmed


def places_of(*nodes: str) -> set[str]:
    return {place.code for place in ALIKE.locations.values() if place.node in nodes}


@pytest.mark.parametrize("carried_to", ["A5", "A3"])
def test_carried_one_cell_off_the_first_labels_tell_and_nothing_wrong_is_booked(carried_to: str) -> None:
    flown = fly(("A3", "A4"), carried_to, stock(ALIKE))
    assert [event for event in flown.events if event.name == "map_contradiction"]
    assert flown.phase is Phase.DONE
    assert wrong_visits(flown, ALIKE) == []
    found = booked(flown)
    assert found == {code: (f"PALLET {code}",) for code in found}
    assert found.keys() == places_of("A3", "A4")


def test_what_was_counted_before_the_labels_told_is_withdrawn() -> None:
    """Believed over A3 and really over A4, where no label hangs; the next shelf has labels."""
    flown = fly(("A3", "A2"), "A5", stock(ALIKE, unlabelled=frozenset({"A4"})))
    withdrawn = [s.locations for output in flown.outputs for s in output.settled if not s.confirmed]
    assert {code for codes in withdrawn for code in codes} == places_of("A3")
    assert flown.phase is Phase.DONE
    found = booked(flown)
    assert found == {code: (f"PALLET {code}",) for code in places_of("A3", "A2")}, "A3 is visited again"
    assert sorted(flown.visited) == ["A2", "A3"]


@pytest.mark.parametrize("home", ["A6", "A3"])
def test_one_label_that_hangs_wrong_costs_a_look_and_nothing_else(home: str) -> None:
    here, there = min(places_of("A5")), min(places_of(home))
    flown = fly(("A5", "A6"), "", stock(ALIKE, {here: there}))
    assert flown.phase is Phase.DONE
    assert flown.visited == ["A5", "A6"]
    found = booked(flown)
    assert found == {code: (f"PALLET {code}",) for code in places_of("A5", "A6")}
