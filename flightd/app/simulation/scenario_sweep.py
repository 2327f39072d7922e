"""Every shipped scenario flown, one after the other, and judged against the table of hazards."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass, replace
from typing import Any, Final, TypeAlias

from flightd.app.simulation.judgement import judge_flight
from flightd.app.simulation.launch import fly
from flightd.app.simulation.simulation import Simulation
from flightd.core.errors import RunError
from flightd.core.snapshot import Snapshot
from flightd.mission.safety.hazard_table import HAZARDS
from flightd.sim.judge.hazard_verdict import HazardVerdict
from flightd.sim.scenario.scenario import Scenario
from flightd.sim.scenario.scenario_files import load_scenario, shipped_scenarios

SHORT_ROUTE: Final = 'mission.nodes=["A2", "A4"]'
"""On the demo site, past the place where the shipped faults begin."""

Prepare: TypeAlias = Callable[[Scenario, str, int], Simulation]
"""Makes the flight of a scenario, a hazard's name and a seed."""
Observe: TypeAlias = Callable[[str, Simulation], AbstractContextManager[Callable[[Snapshot], None]]]
"""Gives, for the hazard that is flown now, what looks on."""


@dataclass(frozen=True, slots=True)
class SweptFlight:
    """One hazard's flight; `error` is why it ended early, "" when it did not."""

    simulation: Simulation
    verdict: HazardVerdict
    error: str

    @property
    def as_it_should(self) -> bool:
        """Whether it went as the table of hazards says."""
        return not (self.verdict.faults or self.error)

    def document(self) -> dict[str, Any]:
        """As JSON has it."""
        return asdict(self.verdict) | {
            "error": self.error,
            "real_time": self.simulation.speed is not None,
            "seed": self.simulation.seed,
            "world": self.simulation.unknowns.kind,
        }


def fly_every_hazard(prepare: Prepare, observe: Observe, seeds: Sequence[int]) -> Iterator[SweptFlight]:
    """Fly what `prepare` makes of each hazard's shipped scenario with each seed, in the table's order."""
    paths = shipped_scenarios()
    for row in HAZARDS:
        scenario = load_scenario(paths[row.name])
        for seed in seeds:
            simulation = prepare(scenario, row.name, seed)
            ended = ""
            with observe(row.name, simulation) as observer:
                try:
                    fly(replace(simulation, observer=observer))
                except RunError as err:
                    ended = str(err)
            verdict = judge_flight(simulation).hazard
            assert verdict is not None, "each shipped scenario expects a hazard"
            yield SweptFlight(simulation, verdict, ended)
