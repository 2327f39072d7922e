"""What a flight has found is proven on its pad, or told and taken back."""

from __future__ import annotations

from dataclasses import replace

import pytest

from flightd.config.battery import BatteryConfig
from flightd.config.sweep import ScanMode
from flightd.core.types import Phase
from tests.unit.mission.test_sweep_flight import PLACES, Sweep, booked_of, config

BARELY = 0.96
"""Sure enough to fly by, and not to prove anything."""


def over_pad(*, swap: bool = False) -> Sweep:
    """All of it is counted by a drone that is barely sure, and now comes down on its pad."""
    scan = {"mode": ScanMode.STOP}
    flight = Sweep(config().with_values(scan=scan, battery=BatteryConfig(swap=swap)))
    flight.integrity = BARELY
    if swap:
        flight.fly(900.0, until=lambda: flight.phase is Phase.SCAN and flight.mission.goal.node == "A3")
        flight.set(battery_frac=0.19)
    flight.fly(900.0)
    assert flight.mission.state.on_pad, flight.mission.reason
    assert flight.findings
    assert booked_of(flight) == []
    return flight


def comes_down(flight: Sweep) -> None:
    """It lands, and what became of it is noted."""
    flight.run(1.0)
    flight.down()
    flight.events += flight.mission.drain_events()
    flight.settled += flight.scanner.drain()[1]


def test_a_place_that_becomes_certain_on_the_way_down_proves_the_count() -> None:
    flight = over_pad()
    flight.integrity = 1.0
    comes_down(flight)
    assert flight.phase is Phase.DONE
    assert sorted(booked_of(flight)) == sorted(PLACES)
    assert flight.said("unproven") == []


def test_what_stays_unproven_down_to_the_pad_is_told() -> None:
    flight = over_pad()
    comes_down(flight)
    assert flight.phase is Phase.DONE
    assert flight.settled == [], "pending in the inventory"
    (text,) = flight.said("unproven")
    assert text == f"{len(PLACES)} findings are not proven and stay pending, at A1, A2, A3, A4"
    assert flight.scanner.unproven == ("A1", "A2", "A3", "A4")


def test_a_drone_that_turns_out_to_be_elsewhere_on_its_way_down_proves_nothing() -> None:
    flight = over_pad()
    flight.integrity = 1.0
    here, away = flight.inputs.pose, flight.site.nodes["A3"]
    assert here is not None
    for pose in (replace(here, node=away.id, x_m=away.x_m, integrity=1.0), replace(here, integrity=1.0)):
        flight.set(pose=pose)
        flight.run(0.1, follow=False)
    comes_down(flight)
    assert booked_of(flight) == []


@pytest.mark.parametrize("sure", [True, False])
def test_the_next_batterys_way_proves_nothing_that_was_not_certain_down_to_the_pad(sure: bool) -> None:
    flight = over_pad(swap=True)
    before = {finding.location for finding in flight.findings}
    assert 0 < len(before) < len(PLACES)
    flight.integrity = 1.0 if sure else BARELY
    comes_down(flight)
    assert flight.phase is Phase.SWAP, flight.mission.reason
    withdrawn = {code for one in flight.settled if not one.confirmed for code in one.locations}
    assert (set(booked_of(flight)), withdrawn) == ((before, set()) if sure else (set(), before))
    flight.integrity = 1.0
    flight.set(battery_frac=0.9, height_m=0.1)
    flight.fly(900.0)
    assert flight.mission.state.on_pad, flight.mission.reason
    assert sorted(booked_of(flight)) == sorted(PLACES)
    again = [finding.location for finding in flight.findings if finding.location in before]
    assert len(again) == len(before) * (1 if sure else 2), "counted again where it was withdrawn"
