"""Every shipped scenario flown, one after the other, and judged against the table of hazards."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass, replace
from typing import Any, Final, TypeAlias

from flightd.app.simulation.launch import fly
from flightd.app.simulation.simulation import Simulation
from flightd.app.simulation.summary import kinematics_of
from flightd.core.errors import RunError
from flightd.core.snapshot import Snapshot
from flightd.core.topics import Topic
from flightd.core.types import Event, Status
from flightd.mission.safety.hazard_table import HAZARDS
from flightd.replay.log import read_log
from flightd.sim.judge.verdict import ScenarioVerdict, judge
from flightd.sim.scenario.scenario import Scenario
from flightd.sim.scenario.scenario_files import load_scenario, shipped_scenarios

SHORT_ROUTE: Final = 'mission.nodes=["A2", "A4"]'
"""On the demo site, past the place where the shipped faults begin."""

Prepare: TypeAlias = Callable[[Scenario, str], Simulation]
Observe: TypeAlias = Callable[[str, Simulation], AbstractContextManager[Callable[[Snapshot], None]]]
"""Gives, for the hazard that is flown now, what looks on."""


@dataclass(frozen=True, slots=True)
class SweptFlight:
    """One hazard's flight; `error` is why it ended early, "" when it did not."""

    simulation: Simulation
    verdict: ScenarioVerdict
    error: str

    @property
    def as_it_should(self) -> bool:
        """Whether it went as the table of hazards says."""
        return not (self.verdict.wrong or self.error)

    def document(self) -> dict[str, Any]:
        """As JSON has it."""
        return asdict(self.verdict) | {
            "error": self.error,
            "real_time": self.simulation.speed is not None,
            "seed": self.simulation.seed,
        }


def fly_every_hazard(prepare: Prepare, observe: Observe) -> Iterator[SweptFlight]:
    """Fly what `prepare` makes of each hazard's shipped scenario, in the order of the table."""
    paths = shipped_scenarios()
    for row in HAZARDS:
        simulation = prepare(load_scenario(paths[row.name]), row.name)
        ended = ""
        with observe(row.name, simulation) as observer:
            try:
                fly(replace(simulation, observer=observer))
            except RunError as err:
                ended = str(err)
        yield SweptFlight(simulation, verdict_of(simulation, row.name), ended)


def verdict_of(simulation: Simulation, name: str) -> ScenarioVerdict:
    """What the logs of a flight say of the hazard `name`, which its scenario expects."""
    expected = simulation.scenario.expect
    assert expected is not None
    row = next(row for row in HAZARDS if row.name == name)
    flight = read_log(simulation.flight_log, {Topic.STATUS, Topic.EVENT})
    truth = read_log(simulation.truth_log, {Topic.TRUTH, Topic.FAULT}).entries
    told = [(entry.topic, entry.message) for entry in truth if isinstance(entry.message, dict)]
    return judge(
        row,
        expected,
        simulation.site,
        [note["stamp_ns"] for topic, note in told if topic == Topic.FAULT and note["began"]],
        flight.messages(Status),
        flight.messages(Event),
        kinematics_of([entry for entry in truth if entry.topic == Topic.TRUTH]),
    )
