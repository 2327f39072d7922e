"""The plan of one drone that has several places to go to, one after the other, and then a pad to stay on."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from flightd.fleet.traffic.plan import Action, Plan, Stop
from flightd.fleet.traffic.sipp import Effort, Sipp

_INTERVALS: Final = 4
"""Safe intervals of one stop that are tried before the stop is given up."""


@dataclass(frozen=True, slots=True)
class Request:
    """Where a drone will stand at `at_ms` (a configuration at rest) and what it is to do from there.  Its
    `stops` in their order, then one of the vertices `ends`, the first that can be had, to stay at.  Of two
    drones that want the same the one with the higher `priority` has it."""

    drone: str
    configuration: int
    at_ms: int
    stops: tuple[Stop, ...]
    ends: tuple[int, ...]
    priority: float = 0.0


def plan_tour(sipp: Sipp, request: Request, effort: Effort) -> Plan | None:
    """The plan, each leg the earliest one from which the rest can be done; None where there is none, or
    `effort` does not suffice to find it.

    One leg is optimal.  Several are planned one by one, and taken back where they lead into a trap."""
    for end in request.ends:
        goals = (*request.stops, Stop(end, end, 0))
        actions = _from(sipp, goals, request.configuration, request.at_ms, effort)
        if actions is not None:
            return Plan(tuple(actions))
    return None


def _from(
    sipp: Sipp, goals: Sequence[Stop], configuration: int, at_ms: int, effort: Effort
) -> list[Action] | None:
    if not goals:
        return []
    legs = sipp.legs(configuration, at_ms, goals[0], effort)
    for leg in itertools.islice(legs, _INTERVALS):
        rest = _from(sipp, goals[1:], leg.configuration, leg.end_ms, effort)
        if rest is not None:
            return [*leg.actions, *rest]
    return None
