"""A simulated flight is judged by what was ordered: the plan that a person chose, where it was taken."""

from __future__ import annotations

from pathlib import Path

import pytest

from flightd.adapters.recorder.recorder import McapRecorder, wait_for_disk
from flightd.app.simulation.meant_flight import MeantFlight, meant_flight
from flightd.app.simulation.prepare import SimOptions, prepare
from flightd.app.simulation.simulation import Simulation
from flightd.core.count_choice import ALL
from flightd.core.topics import Topic
from flightd.core.types import Command, CommandKind, Event, EventLevel
from flightd.replay.log import read_log
from flightd.sim.scenario.scenario import Scenario

S = 1_000_000_000


@pytest.fixture
def simulation(tmp_path: Path) -> Simulation:
    return prepare(SimOptions(), Scenario(), tmp_path, lambda _: None)


def meant(simulation: Simulation, *ordered: tuple[Command, Event]) -> MeantFlight:
    with McapRecorder(simulation.flight_log, when_full=wait_for_disk) as log:
        for command, answer in ordered:
            log.record(Topic.COMMAND, answer.stamp_ns, command)
            log.record(Topic.EVENT, answer.stamp_ns, answer)
    return meant_flight(simulation, read_log(simulation.flight_log))


def chosen(*nodes: str, levels: tuple[int, ...] = ()) -> Command:
    return Command("12345678", CommandKind.PLAN, nodes=nodes, levels=levels)


def taken(at_s: int) -> Event:
    return Event(at_s * S, EventLevel.INFO, "plan", "as it was ordered")


def refused(at_s: int) -> Event:
    return Event(at_s * S, EventLevel.WARNING, "command", "plan refused: the vehicle is armed")


def test_without_an_order_it_is_what_the_configuration_says(simulation: Simulation) -> None:
    told = meant(simulation, (Command("12345678", CommandKind.START), taken(1)))
    assert (told.plan, told.choice) == (simulation.plan(), ALL)


def test_the_last_plan_that_was_taken_is_meant_in_its_order(simulation: Simulation) -> None:
    first, last = (chosen("A2", levels=(1,)), taken(1)), (chosen("A3", "A2", levels=(2,)), taken(2))
    told = meant(simulation, first, last, (chosen("B1"), refused(3)))
    assert [stop.node for stop in told.plan.stops if stop.visit] == ["A3", "A2"]
    assert told.plan.to_visit == {"A2", "A3"}
    assert told.choice.levels == (2,)


def test_an_order_of_no_nodes_goes_back_to_the_configuration(simulation: Simulation) -> None:
    told = meant(simulation, (chosen("A2", levels=(1,)), taken(1)), (chosen(), taken(2)))
    assert (told.plan, told.choice) == (simulation.plan(), ALL)
