"""Whole fleets in the world without pixels, judged by where the drones truly are."""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import replace

import pytest

from flightd.fleet.traffic.cells import CellSize
from flightd.fleet.traffic.plan import Action
from flightd.sim.fleet.judge import FleetJudge
from flightd.sim.fleet.simulation import FleetScenario, FleetSimulation, fly_fleet
from flightd.sim.fleet.world import FleetDrone, Unknowns

SMALL = FleetScenario(drones=4, aisles=6, nodes=8, hours=3.0, failing=1, fails_s=(60.0, 240.0))
LEFT_ALONE = replace(SMALL, hub_kills_per_h=0.0, broker_kills_per_h=0.0)
ROUGH = Unknowns(pace_sigma=0.2, slow_per_h=8, link_cuts_per_h=20, link_cut_s=60, doubts_per_h=10, doubt_s=40)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_fleet_in_trouble_counts_every_place_or_says_why_not(seed: int) -> None:
    result = fly_fleet(replace(SMALL, seed=seed, unknowns=ROUGH))
    assert result.judge.faults == []
    assert result.good
    assert result.failed
    document = result.document()
    assert set(result.reasons.values()) <= {
        f"{result.failed[0]} {what} there" for what in ("failed", "is silent")
    }
    assert 0 < document["places"] - document["counted"] <= 16 * len(result.reasons)
    assert document["least_distance_m"] > 0.9
    assert document["least_charge"] >= SMALL.endurance.reserve


@pytest.mark.parametrize("contacts", [0, 2])
def test_stations_that_are_killed_again_and_again_let_nobody_meet_and_lose_nothing(contacts: int) -> None:
    result = fly_fleet(replace(SMALL, contacts=contacts, hub_kills_per_h=40.0, broker_kills_per_h=20.0))
    assert result.judge.faults == []
    assert result.hub_kills > 10
    assert result.broker_kills > 5
    assert result.failed
    assert 0 < result.places - result.counted <= 16 * len(result.reasons)
    assert 1 <= len(result.reasons) <= 3, "beside the one that failed"


def test_a_drone_takes_nothing_twice_that_two_stations_tell_it() -> None:
    simulation = FleetSimulation(replace(SMALL, hours=0.2, failing=0, closes_aisle=False))
    told: list[tuple[str, int, int]] = []
    tell = simulation.world.tell

    def twice(name: str, first: int, actions: Sequence[Action], *, paused: bool) -> None:
        tell(name, first, actions, paused=paused)
        drone = simulation.world.drones[name]
        had = list(drone.base)
        tell(name, first, actions, paused=paused)
        assert list(drone.base) == had
        told.append((name, first, len(had)))

    simulation.world.tell = twice  # type: ignore[method-assign]
    simulation.run()
    assert any(length > 2 for _, _, length in told)


def test_the_same_seed_flies_the_same() -> None:
    scenario = replace(SMALL, hours=0.15, unknowns=ROUGH)
    first, second, other = (fly_fleet(replace(scenario, seed=seed)).document() for seed in (5, 5, 6))
    assert first == second
    assert first != other


def test_a_closed_aisle_is_left_alone_while_it_is_closed() -> None:
    scenario = replace(SMALL, failing=0, closed_from=0.0, closed_to=0.4, hours=2.0)
    simulation = FleetSimulation(scenario)
    closed = simulation.closed_aisle
    seen: set[str] = set()
    step = simulation.world.step

    def watched(dt_s: float) -> None:
        step(dt_s)
        if simulation.now_s < 0.4 * 7200.0:
            vertices = simulation.lanes.vertices
            seen.update(vertices[drone.place].node for drone in simulation.world.drones.values())

    simulation.world.step = watched  # type: ignore[method-assign]
    result = simulation.run()
    inside = {node.id for node in simulation.site.aisle_nodes(closed)[2:-2]}
    assert seen
    assert not seen & inside
    assert result.good
    assert result.counted == result.places


def test_two_that_are_too_near_share_a_cell_once_until_they_part() -> None:
    judge = FleetJudge(CellSize(), 0.15)
    a, b = (FleetDrone(name, 0, random.Random(1)) for name in "ab")
    for at_s, apart_m in enumerate((2.0, 0.5, 0.4, 2.0, 0.5)):
        b.x_m = apart_m
        judge.see(at_s, [a, b], work_left=True)
    assert [(fault.kind, fault.at_s) for fault in judge.faults] == [("shared_cell", 1), ("shared_cell", 4)]
    assert judge.least_m == 0.4


def test_below_the_reserve_and_standing_still_are_faults() -> None:
    judge = FleetJudge(CellSize(), 0.15)
    drone = FleetDrone("a", 0, random.Random(1), charge=0.1)
    drone.base.append(None)  # type: ignore[arg-type]
    for at_s in range(0, 1300, 100):
        judge.see(float(at_s), [drone], work_left=True)
    assert [fault.kind for fault in judge.faults] == ["below_reserve", "deadlock"]
    judge.end(1300.0, ["A1"])
    assert judge.count("unanswered") == 1


def test_a_fleet_fills_its_batteries_at_shared_docks_alone_and_waits_for_them_at_home() -> None:
    docked = replace(LEFT_ALONE, drones=5, aisles=10, nodes=10, failing=0, closes_aisle=False, swaps=1)
    simulation = FleetSimulation(docked)
    filled: dict[str, int] = {}
    charge = {drone.name: drone.charge for drone in simulation.world.drones.values()}
    step = simulation.world.step

    def watched(dt_s: float) -> None:
        step(dt_s)
        for drone in simulation.world.drones.values():
            if drone.charge > charge[drone.name]:
                filled[drone.name] = drone.place
            charge[drone.name] = drone.charge

    simulation.world.step = watched  # type: ignore[method-assign]
    result = simulation.run()
    assert result.judge.faults == []
    assert result.counted == result.places
    (dock,) = simulation.docks
    assert len(filled) >= 3
    assert set(filled.values()) == {dock.place}
    document = result.document()
    assert document["docks"][0]["kind"] == "swap"
    assert document["docks"][0]["landings"] >= len(filled)
    assert document["waited_for_docks_s"] > 0.0


def test_who_lands_without_contact_says_so_lands_anew_and_takes_another_dock_in_the_end() -> None:
    docked = replace(
        LEFT_ALONE, aisles=10, nodes=10, failing=0, closes_aisle=False, contacts=2, misaligned=1.0
    )
    result = fly_fleet(replace(docked, hours=0.6, misaligned=1.0))
    document = result.document()
    assert {fault.kind for fault in result.judge.faults} <= {"deadlock"}, "nobody flies below its reserve"
    assert all(dock["landings"] == dock["without_contact"] > 0 for dock in document["docks"])
    first = document["docks_told"][0].split()[0]
    of_first = [line.partition(" ")[2] for line in document["docks_told"] if line.startswith(f"{first} ")]
    (one, other) = dict.fromkeys(line.split()[5].rstrip(":") for line in of_first if "contact" in line)
    assert of_first[:4] == [
        f"has no contact on dock {one}: it lands anew",
        f"has no contact on dock {one}: it lands anew",
        f"has no contact on dock {one} after 3 landings: it takes another, if there is one",
        f"has no contact on dock {other}: it lands anew",
    ]
    assert fly_fleet(replace(docked, misaligned=0.3)).good


def test_a_full_battery_that_takes_no_more_is_no_missing_contact() -> None:
    docked = replace(LEFT_ALONE, aisles=10, nodes=10, failing=0, closes_aisle=False, contacts=4)
    simulation = FleetSimulation(docked)
    step, full = simulation.world.step, 0

    def watched(dt_s: float) -> None:
        nonlocal full
        step(dt_s)
        places = {dock.place for dock in simulation.docks}
        full += sum(
            drone.place in places and drone.charge == 1.0 and not drone.charging
            for drone in simulation.world.drones.values()
        )

    simulation.world.step = watched  # type: ignore[method-assign]
    document = simulation.run().document()
    assert full > 50
    assert document["docks_told"] == []
