"""A plan that is handed over before the start, flown: its nodes and levels, and what it was said to take."""

from __future__ import annotations

from pathlib import Path

from flightd.config.schema import Config, load_config
from flightd.config.sweep import ScanMode
from flightd.core.count_choice import CountChoice, ShelfCount
from flightd.core.flight_order import ChosenPlan
from flightd.core.planned_flight import PlannedFlight
from flightd.core.topics import Topic
from flightd.core.types import Command, CommandKind, Phase
from tests.rigs.brisk import BRISK
from tests.sim.ideal.ideal_flight import Flown, IdealFlight
from tests.sim.ideal.ideal_front import IdealFront, Label, Stock
from tests.unit.mission.shelves import FITTED, SIGHT, SITE

CONFIG = load_config(Path(__file__).parents[3] / "configs" / "sim.toml").with_values(
    front_camera=FITTED, scan={"mode": ScanMode.STOP}, mission={"autostart": False, "start_countdown_s": 0.0}
)
BRISKLY = CONFIG.with_values(mission=BRISK)
ON_GROUND = {Phase.PREFLIGHT, Phase.ARMING, Phase.DONE}


def flown(
    *nodes: str,
    levels: tuple[int, ...] = (),
    counts: tuple[ShelfCount, ...] | None = None,
    then: Command | None = None,
    config: Config = CONFIG,
) -> tuple[Flown, PlannedFlight]:
    """The flight of a plan that comes once the drone is ready, and what was said of it before; `then` is
    ordered once it is at its first node."""
    stock = Stock({code: [Label(f"PALLET {code}", 0.1, 0.1)] for code in SITE.locations})
    flight = IdealFlight(SITE, config, front=IdealFront(SITE, SIGHT, stock))
    mission = flight.pilot.mission
    said: list[PlannedFlight] = []
    kept: list[object] = []

    later = [] if then is None else [then]

    def order(phase: Phase, _now_ns: int) -> None:
        if phase is Phase.HOVER and later:
            flight.commands.append(later.pop())
        if not said and CommandKind.START in mission.possible_commands:
            said.append(mission.planned(nodes, CountChoice.of(levels, counts), best_order=False))
            plan = Command("plan-0001", CommandKind.PLAN, nodes=nodes, levels=levels, counts=counts)
            flight.commands += [plan, Command("start-001", CommandKind.START, plan="plan-0001")]

    flight.on_tick = order
    flight.on_record = lambda topic, _ns, message: kept.append(message) if topic == Topic.PLAN else None
    done = flight.fly()
    assert kept == [ChosenPlan("plan-0001", nodes, levels, counts)]
    return done, said[0]


def test_it_counts_the_chosen_level_of_the_chosen_nodes_in_about_the_time_that_was_said() -> None:
    flight, said = flown("A3", "A2", levels=(1,))
    assert (flight.phase, flight.visited) == (Phase.DONE, ["A3", "A2"])
    found = {finding.location for output in flight.outputs for finding in output.findings}
    wanted = {
        place.code for place in SITE.locations.values() if place.node in {"A3", "A2"} and place.level == 1
    }
    assert found == wanted
    assert said.places == len(wanted)
    air_s = 0.02 * sum(output.phase not in ON_GROUND for output in flight.outputs)
    assert 0.9 < said.seconds / air_s < 1.4, "a view is often over before its longest"


def counted(flight: Flown) -> set[str]:
    return {finding.location for output in flight.outputs for finding in output.findings}


def of(*counts: ShelfCount) -> set[str]:
    places = SITE.locations.values()
    choice = CountChoice((), counts)
    return {at.code for at in places if choice.takes(at.node, at.side, at.level)}


def test_it_counts_at_each_node_the_side_and_levels_that_are_told_for_it_alone() -> None:
    low, right = ShelfCount("A2", "left", (1,)), ShelfCount("A3", "right")
    flight, said = flown("A2", "A3", "A4", counts=(low, right), config=BRISKLY)
    assert (flight.phase, flight.visited) == (Phase.DONE, ["A2", "A3", "A4"])
    assert counted(flight) == of(low, right)
    assert said.places == len(of(low, right))


def test_a_goto_says_what_is_counted_at_its_node_whatever_the_plan_says() -> None:
    low, other = ShelfCount("A2", "left", (1,)), ShelfCount("A3", "left")
    told = Command("goto-0001", CommandKind.GOTO, node="A4", counts=(ShelfCount("A4", "right", (2,)),))
    flight, _ = flown("A2", "A3", counts=(low, other), then=told, config=BRISKLY)
    assert counted(flight) == of(low, ShelfCount("A4", "right", (2,)))


def test_a_goto_that_says_nothing_of_it_has_all_counted_there() -> None:
    told = Command("goto-0001", CommandKind.GOTO, node="A4")
    flight, _ = flown("A2", counts=(), then=told, config=BRISKLY)
    assert counted(flight) == of(ShelfCount("A4"))


def test_in_passing_it_takes_about_the_time_that_was_said_too() -> None:
    nodes = tuple(SITE.nodes)
    flight, said = flown(*nodes, config=CONFIG.with_values(scan={"mode": ScanMode.SWEEP}))
    assert (flight.phase, set(flight.visited)) == (Phase.DONE, set(nodes))
    assert any(each.swept for each in said.sweeps)
    assert {finding.location for output in flight.outputs for finding in output.findings} == set(
        SITE.locations
    )
    air_s = 0.02 * sum(output.phase not in ON_GROUND for output in flight.outputs)
    assert 0.9 < said.seconds / air_s < 1.5, "the ways between its nodes are counted beside the passes"
