"""The short routes of the demo site on which each hazard is flown: along an aisle, where shelves leave the
body 0.9 m on either side, and across to the next one, where the ends of racks leave it 0.3 m."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from flightd.sim.scenario.fault_schema import Fault, WindChange
from flightd.sim.scenario.scenario import Scenario


@dataclass(frozen=True, slots=True)
class SweepRoute:
    """Where it goes from the pad at A1; the faults that begin at a place do so where `place_m` (map, m) says,
    None for where their scenario says."""

    name: str
    nodes: tuple[str, ...]
    place_m: tuple[float, float] | None = None

    @property
    def setting(self) -> str:
        """As `--set` takes it."""
        return f"mission.nodes={list(self.nodes)}".replace("'", '"')

    def laid(self, scenario: Scenario) -> Scenario:
        """The scenario with its faults on this route."""
        return scenario.model_copy(update={"fault": tuple(self._laid(fault) for fault in scenario.fault)})

    def _laid(self, fault: Fault) -> Fault:
        if self.place_m is None or fault.at_x_m is None:
            return fault
        x_m, y_m = self.place_m
        update = {"at_x_m": x_m, "at_y_m": y_m}
        if isinstance(fault, WindChange):  # what blows across the one way blows across the other
            update |= {"mean_x_mps": -fault.mean_y_mps, "mean_y_mps": fault.mean_x_mps}
        return fault.model_copy(update=update)


ALONG: Final = SweepRoute("along", ("A2", "A4"))
"""Past the place where the shipped faults begin."""
ACROSS: Final = SweepRoute("across", ("A1", "B1", "B2"), (0.0, 1.3))
"""A fault begins where the drone comes between the racks' ends, one stop behind it: on a battery that has
done nothing no other one would follow."""
ROUTES: Final = (ALONG, ACROSS)
AS_SET: Final = replace(ALONG, name="as set")
"""Where another `mission.nodes` is set on top, all seeds fly that."""


def digest(scenario: Path) -> str:
    """Of what goes wrong in a scenario's file and on which routes, by which flights of an older one are told
    from these."""
    return hashlib.sha256(scenario.read_bytes() + repr(ROUTES).encode()).hexdigest()[:12]


def route_by_seed(seed: int) -> SweepRoute:
    """Odd seeds fly along, even ones across."""
    return ROUTES[1 - seed % 2]


def route_of(seed: int, scenario: Scenario) -> SweepRoute:
    """The seed's; along also what is made for the aisle: a drone that stands
    elsewhere in it, or what happens at one of its nodes."""
    for_aisle = any(scenario.vehicle.start_offset_m) or any(fault.at_node for fault in scenario.fault)
    return ALONG if for_aisle else route_by_seed(seed)
