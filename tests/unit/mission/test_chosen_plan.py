"""Plans over nodes that somebody chose: what is refused, what is taken, what they are said to need."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightd.app.build import pilot_of
from flightd.config.battery import BatteryConfig
from flightd.config.schema import load_config
from flightd.core.count_choice import CountChoice, ShelfCount
from flightd.core.errors import InputError
from flightd.core.types import Command, CommandKind, Phase
from flightd.mission.mission import Mission
from flightd.sim.random_sites import random_site
from flightd.site.site_file import load_site
from tests.unit.mission import shelves
from tests.unit.mission.configured import configured
from tests.unit.mission.driven import SITE, Flight
from tests.unit.mission.shelves import FITTED

CONFIGS = Path(__file__).parents[3] / "configs"
CONFIG = load_config(CONFIGS / "sim.toml")
DEMO = load_site(CONFIGS / "site-demo.toml")
READY = configured(dwell_s=1.0, autostart=False, start_countdown_s=0.0)


def waiting(**battery: float) -> Flight:
    """A drone that is ready and waits for a start."""
    params = READY.model_copy(update={"battery": BatteryConfig(**battery)}) if battery else READY
    flight = Flight(params)
    flight.run(0.2)
    return flight


def ordered(flight: Flight, *nodes: str, levels: tuple[int, ...] = (), id: str = "plan-0001") -> list[str]:  # noqa: A002
    """Order a plan; what is said about it."""
    flight.mission.drain_events()
    flight.mission.command(Command(id, CommandKind.PLAN, nodes=nodes, levels=levels), flight.now_ns)
    return [event.text for event in flight.mission.drain_events()]


def demo_mission(**values: object) -> Mission:
    return pilot_of(CONFIG.with_values(**values), DEMO).mission


NODES = tuple(SITE.nodes)


def test_a_plan_is_flown_in_its_order_in_place_of_the_configured_one() -> None:
    flight = waiting()
    chosen = NODES[3], NODES[1]
    assert ordered(flight, *chosen)[-1] == "2 nodes"
    assert flight.mission.standing.nodes == flight.mission.remaining == chosen
    flight.order(CommandKind.START)
    flight.to(Phase.LAND, 600.0)
    assert tuple(flight.mission.visited) == chosen


def test_no_nodes_mean_the_configured_plan_again() -> None:
    flight = waiting()
    before = flight.mission.remaining
    ordered(flight, NODES[2])
    assert ordered(flight)[-1] == "as configured again"
    assert flight.mission.remaining == before
    assert flight.mission.standing.id == ""


@pytest.mark.parametrize(
    ("nodes", "levels", "why"),
    [
        (("nowhere",), (), "no node nowhere"),
        ((NODES[0],), (1,), "counts no shelves"),
    ],
)
def test_what_cannot_be_flown_is_refused_in_one_line_and_changes_nothing(
    nodes: tuple[str, ...], levels: tuple[int, ...], why: str
) -> None:
    flight = waiting()
    before = flight.mission.standing
    (_, said) = ordered(flight, *nodes, levels=levels)
    assert said.startswith("plan refused: ")
    assert why in said
    assert "\n" not in said
    assert flight.mission.standing == before


def test_a_node_beyond_the_batterys_reserve_is_refused() -> None:
    mission = demo_mission(battery={"flight_s": 60.0}, mission={"nodes": ("A2",)})
    far = max(DEMO.nodes, key=lambda node: DEMO.distance_m(DEMO.home.node, node))
    with pytest.raises(InputError, match=f"does not reach {far}"):
        mission.planned((far,), best_order=False)


def test_it_is_taken_only_disarmed_on_the_ground_before_a_start() -> None:
    flight = waiting()
    assert CommandKind.PLAN in flight.mission.possible_commands
    flight.set(armed=True)
    flight.run(0.02, follow=False)
    assert CommandKind.PLAN not in flight.mission.possible_commands
    assert ordered(flight, NODES[1])[-1] == "plan refused: the vehicle is armed"
    flight.set(armed=False)
    flight.run(0.1, follow=False)
    flight.order(CommandKind.START)
    assert CommandKind.PLAN not in flight.mission.possible_commands
    flight.to(Phase.FOLLOW)
    before = flight.mission.standing
    assert "refused" in ordered(flight, NODES[1])[-1]
    assert flight.mission.standing == before


def test_a_plan_never_starts_anything() -> None:
    flight = waiting()
    ordered(flight, NODES[1])
    flight.run(30.0)
    assert flight.phase is Phase.PREFLIGHT


def test_a_start_for_another_plan_than_stands_does_not_start() -> None:
    flight = waiting()
    ordered(flight, NODES[1], id="plan-one")
    ordered(flight, NODES[2], id="plan-two")
    flight.mission.command(Command("s", CommandKind.START, plan="plan-one"), flight.now_ns)
    flight.run(5.0)
    assert flight.phase is Phase.PREFLIGHT
    flight.mission.command(Command("t", CommandKind.START, plan="plan-two"), flight.now_ns)
    flight.to(Phase.FOLLOW)


def test_only_the_chosen_levels_are_counted() -> None:
    config = CONFIG.with_values(front_camera=FITTED)
    mission = pilot_of(config, shelves.SITE).mission
    every = mission.planned(("A2", "A3"), best_order=False)
    low = mission.planned(("A2", "A3"), CountChoice((1,)), best_order=False)
    places = [place for place in shelves.SITE.locations.values() if place.node in {"A2", "A3"}]
    assert every.places == len(places)
    assert low.places == sum(place.level == 1 for place in places)
    assert 0 < low.places < every.places
    assert low.seconds < every.seconds
    with pytest.raises(InputError, match="nothing is counted on level 9"):
        mission.planned(("A2",), CountChoice((9,)), best_order=False)


@pytest.mark.parametrize(
    ("count", "why"),
    [
        (ShelfCount("Q7"), "there is no place Q7$"),
        (ShelfCount("A2", "left", (2, 9)), None),
        (ShelfCount("A3", levels=(8, 9)), "there is no place A3 on level 8, 9$"),
        (ShelfCount("A3", "left", (9,)), "there is no place A3 left on level 9$"),
    ],
)
def test_a_count_of_what_is_not_there_is_refused_where_shelves_are_counted(
    count: ShelfCount, why: str | None
) -> None:
    counts = ShelfCount("A2"), count
    demo_mission().planned(("A2",), CountChoice((), counts), best_order=False)
    mission = pilot_of(CONFIG.with_values(front_camera=FITTED), shelves.SITE).mission
    with pytest.raises(InputError, match=why) if why else nullcontext():
        mission.planned(("A2",), CountChoice((), counts), best_order=False)


def test_asking_changes_nothing() -> None:
    mission = demo_mission()
    before = mission.standing
    mission.planned(("A4", "A2"), best_order=True)
    assert mission.standing == before


@settings(max_examples=40, deadline=None)
@given(st.data())
def test_an_estimate_visits_each_chosen_node_once_and_needs_more_for_more(data: st.DataObject) -> None:
    site = random_site(data.draw(st.integers(0, 5)))
    mission = Flight(READY, site).mission
    nodes = data.draw(st.lists(st.sampled_from(sorted(site.nodes)), min_size=1, max_size=10))
    best = data.draw(st.booleans())
    planned = mission.planned(nodes, best_order=best)
    assert sorted(planned.nodes) == sorted(set(nodes))
    assert best or planned.nodes == tuple(dict.fromkeys(nodes))
    assert planned.seconds > 0
    assert planned.batteries >= 1
    assert planned.seconds <= planned.batteries * planned.battery_s + 1e-6 or planned.charge < 1
    if best:
        assert planned.seconds <= mission.planned(nodes, best_order=False).seconds + 5.0
    longer = mission.planned([*planned.nodes, *planned.nodes[:1]], best_order=False)
    assert longer.nodes == planned.nodes


@settings(max_examples=30, deadline=None)
@given(st.lists(st.text(max_size=8), max_size=6), st.lists(st.integers(-3, 200), max_size=4))
def test_whatever_is_ordered_the_standing_plan_can_be_flown(nodes: list[str], levels: list[int]) -> None:
    flight = waiting()
    ordered(flight, *nodes, levels=tuple(levels))
    standing = flight.mission.standing
    assert standing.nodes
    assert set(standing.nodes) <= set(SITE.nodes)
    assert flight.phase is Phase.PREFLIGHT
