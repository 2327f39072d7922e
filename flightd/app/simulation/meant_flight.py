"""What a simulated flight was to do: what its configuration says, or what a person chose on the ground."""

from __future__ import annotations

from dataclasses import dataclass, replace

from flightd.app.build import plan_of
from flightd.app.simulation.simulation import Simulation
from flightd.core.count_choice import ALL, CountChoice
from flightd.core.types import Command, CommandKind, Event, EventLevel
from flightd.mission.plan.flight_plan import FlightPlan
from flightd.replay.log import FlightLog


@dataclass(frozen=True, slots=True)
class MeantFlight:
    """The plan, and what was to be counted on it."""

    plan: FlightPlan
    choice: CountChoice = ALL


def meant_flight(simulation: Simulation, flown: FlightLog) -> MeantFlight:
    """The last plan that was ordered over the ground link and taken, as `flown` (its commands and events) has
    it; that of the configuration where none was."""
    taken_ns = {event.stamp_ns for event in flown.messages(Event) if _tells_of_a_plan(event)}
    ordered = Command("", CommandKind.PLAN)
    for entry in flown.entries:
        command = entry.message
        if isinstance(command, Command) and command.kind is CommandKind.PLAN and entry.stamp_ns in taken_ns:
            ordered = command
    if not ordered.nodes:
        return MeantFlight(simulation.plan())
    order = replace(simulation.setting.order, nodes=ordered.nodes, best_order=False)
    return MeantFlight(
        plan_of(simulation.config, simulation.site, order), CountChoice.of(ordered.levels, ordered.counts)
    )


def _tells_of_a_plan(event: Event) -> bool:
    return event.name == "plan" and event.level is EventLevel.INFO
