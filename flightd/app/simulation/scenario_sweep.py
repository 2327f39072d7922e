"""Every shipped scenario flown, one after the other, and judged against the table of hazards."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass, replace
from typing import Any, TypeAlias

from flightd.app.simulation.judgement import judge_flight
from flightd.app.simulation.launch import FlightInterruptedError, fly
from flightd.app.simulation.simulation import Simulation
from flightd.app.simulation.sweep_log import SweepLog, SweptRow
from flightd.app.simulation.sweep_routes import ROUTES, SweepRoute, digest
from flightd.core.errors import FlightdError
from flightd.core.snapshot import Snapshot
from flightd.core.utc_time import utc_day
from flightd.mission.safety.hazard_table import HAZARDS, Hazard
from flightd.runtime.ending_signals import raised_signals
from flightd.sim.judge.hazard_verdict import HazardVerdict
from flightd.sim.scenario.scenario import Scenario
from flightd.sim.scenario.scenario_files import load_scenario, shipped_scenarios

Prepare: TypeAlias = Callable[[Scenario, str, int, SweepRoute], Simulation]
"""Makes the flight of a scenario that is laid on a route, its name, a seed and the route."""
Routes: TypeAlias = Callable[[int, Scenario], SweepRoute]
"""The route of a seed and a scenario."""
Observe: TypeAlias = Callable[[str, Simulation], AbstractContextManager[Callable[[Snapshot], None]]]
"""Gives, for the scenario that is flown now, what looks on."""


def hazard_scenarios() -> dict[str, Hazard]:
    """The shipped scenarios by name, in the table's order: each row's own, then those that make it happen in
    another way, which are named ROW-WAY."""
    names = sorted(shipped_scenarios())
    return {name: row for row in HAZARDS for name in names if name.partition("-")[0] == row.name}


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
    prepare: Prepare, observe: Observe, seeds: Sequence[int], log: SweepLog, origin: Origin, routes: Routes
) -> Iterator[SweptRow]:
    """Fly what `prepare` makes of each hazard's shipped scenarios with each seed, on its route, in the
    table's order; those in `log` are told as they were.  What goes wrong with one is its row's error.
    FlightInterruptedError when a signal ends it all."""
    paths = shipped_scenarios()
    for name, hazard in hazard_scenarios().items():
        shipped = load_scenario(paths[name])
        for seed in seeds:
            route = routes(seed, shipped)
            row = log.row(name, seed)
            if row is None:
                try:
                    with raised_signals(_interrupted):
                        simulation = prepare(route.laid(shipped), name, seed, route)
                except FlightInterruptedError:
                    raise
                except FlightdError as err:
                    row = _row(name, _unjudged(hazard), str(err), shipped.needs_real_time, seed, origin)
                else:
                    row = _flown(name, hazard, simulation, observe, origin)
                shown = digest(paths[name]) if route in ROUTES else ""  # another one is evidence of none
                row |= {"route": route.name, "scenario": shown}
                log.append(row)
            yield row


def _flown(name: str, hazard: Hazard, simulation: Simulation, observe: Observe, origin: Origin) -> SweptRow:
    errors: list[str] = []
    for log in (simulation.flight_log, simulation.truth_log):
        log.unlink(missing_ok=True)  # a flight that does not begin is not judged by an older one's
    with observe(name, simulation) as observer:
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
    told = verdict or _unjudged(hazard)
    return _row(name, told, "; ".join(errors), by_clock, simulation.seed, origin)


def _interrupted(number: signal.Signals) -> FlightInterruptedError:
    return FlightInterruptedError(number, None)


def _row(
    name: str, verdict: HazardVerdict, error: str, by_clock: bool, seed: int, origin: Origin
) -> SweptRow:
    told = asdict(verdict) | {"hazard": name, "error": error, "real_time": by_clock, "seed": seed}
    return told | {"flown": utc_day(time.time_ns()).isoformat()} | asdict(origin)


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
