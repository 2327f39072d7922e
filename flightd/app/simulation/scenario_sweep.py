"""Every shipped scenario flown, one after the other, and judged against the table of hazards."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass, replace
from typing import Any, Final, TypeAlias

from flightd.app.simulation.judgement import judge_flight
from flightd.app.simulation.launch import FlightInterruptedError, fly
from flightd.app.simulation.simulation import Simulation
from flightd.app.simulation.sweep_log import SweepLog, SweptRow
from flightd.core.errors import FlightdError
from flightd.core.snapshot import Snapshot
from flightd.core.utc_time import utc_day
from flightd.mission.safety.hazard_table import HAZARDS, Hazard
from flightd.runtime.ending_signals import raised_signals
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
class Origin:
    """What the flights of a sweep are evidence of: the world, the vehicle and the code that was flown."""

    world: str
    vehicle: str
    code: str


def as_it_should(row: Mapping[str, Any]) -> bool:
    """Whether it went as the table of hazards says."""
    return not (row["faults"] or row["error"])


def fly_every_hazard(
    prepare: Prepare, observe: Observe, seeds: Sequence[int], log: SweepLog, origin: Origin
) -> Iterator[SweptRow]:
    """Fly what `prepare` makes of each hazard's shipped scenario with each seed, in the table's order; those
    in `log` are told as they were.  What goes wrong with one is its row's error.  FlightInterruptedError when
    a signal ends it all."""
    paths = shipped_scenarios()
    for hazard in HAZARDS:
        scenario = load_scenario(paths[hazard.name])
        for seed in seeds:
            row = log.row(hazard.name, seed)
            if row is None:
                try:
                    with raised_signals(_interrupted):
                        simulation = prepare(scenario, hazard.name, seed)
                except FlightInterruptedError:
                    raise
                except FlightdError as err:
                    row = _row(_unjudged(hazard), str(err), scenario.needs_real_time, seed, origin)
                else:
                    row = _flown(hazard, simulation, observe, origin)
                log.append(row)
            yield row


def _flown(hazard: Hazard, simulation: Simulation, observe: Observe, origin: Origin) -> SweptRow:
    errors: list[str] = []
    for log in (simulation.flight_log, simulation.truth_log):
        log.unlink(missing_ok=True)  # a flight that does not begin is not judged by an older one's
    with observe(hazard.name, simulation) as observer:
        try:
            fly(replace(simulation, observer=observer))
        except FlightInterruptedError:
            raise
        except FlightdError as err:
            errors.append(str(err))
    verdict: HazardVerdict | None = None
    try:
        with raised_signals(_interrupted):
            verdict = judge_flight(simulation).hazard
    except FlightInterruptedError:
        raise
    except FlightdError as err:
        errors.append(f"not judged: {err}")
    by_clock, origin = simulation.speed is not None, replace(origin, world=simulation.unknowns.kind)
    return _row(verdict or _unjudged(hazard), "; ".join(errors), by_clock, simulation.seed, origin)


def _interrupted(number: signal.Signals) -> FlightInterruptedError:
    return FlightInterruptedError(number, None)


def _row(verdict: HazardVerdict, error: str, by_clock: bool, seed: int, origin: Origin) -> SweptRow:
    told = {"error": error, "real_time": by_clock, "seed": seed, "flown": utc_day(time.time_ns()).isoformat()}
    return asdict(verdict) | told | asdict(origin)


def _unjudged(hazard: Hazard) -> HazardVerdict:
    return HazardVerdict(
        hazard.name,
        found_s=None,
        action=hazard.action.value,
        phases=(),
        outcome="not judged",
        down_s=None,
        min_clearance_m=None,
        off_leg_max_m=None,
        max_overshoot_m=None,
        uncontrolled_s=None,
        faults=(),
    )
