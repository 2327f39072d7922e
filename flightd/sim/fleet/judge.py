"""Judges a fleet by the truth: shared cells, standstill, batteries, and whether every place has its
answer."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from flightd.fleet.traffic.cells import CellSize
from flightd.sim.fleet.world import FleetDrone

STANDSTILL_S = 600.0
"""Nobody moves or charges for so long while work is left: a deadlock."""


@dataclass(frozen=True, slots=True)
class FleetFault:
    """One thing that was wrong."""

    kind: str
    at_s: float
    drones: tuple[str, ...]
    value: float


class FleetJudge:
    """Sees every step.  Two drones share a cell where the cylinders of their bodies with clearance meet."""

    def __init__(self, cell: CellSize, reserve: float) -> None:
        self._across_m = cell.body_m + 2 * cell.clearance_m
        self._upright_m = cell.upright_m
        self._reserve = reserve
        self.least_m = math.inf
        self.faults: list[FleetFault] = []
        self._meeting: set[tuple[str, str]] = set()
        self._below: set[str] = set()
        self._moved_s = 0.0
        self._stuck = False

    def see(self, at_s: float, drones: Sequence[FleetDrone], *, work_left: bool) -> None:
        """One step."""
        meeting: set[tuple[str, str]] = set()
        for a, b in itertools.combinations(drones, 2):
            dx, dy = abs(a.x_m - b.x_m), abs(a.y_m - b.y_m)
            if dx < 6.0 and dy < 6.0 and abs(a.z_m - b.z_m) < self._upright_m:
                across_m = math.hypot(dx, dy)
                self.least_m = min(self.least_m, across_m)
                if across_m < self._across_m:
                    meeting.add((a.name, b.name))
                    if (a.name, b.name) not in self._meeting:
                        self.faults.append(FleetFault("shared_cell", at_s, (a.name, b.name), across_m))
        self._meeting = meeting
        for drone in drones:
            if not drone.failed and drone.charge < self._reserve and drone.name not in self._below:
                self._below.add(drone.name)
                self.faults.append(FleetFault("below_reserve", at_s, (drone.name,), drone.charge))
        busy = any(d.speed_mps > 0.0 or d.timer_s > 0.0 or (d.charging and d.charge < 1.0) for d in drones)
        if busy or not work_left:
            self._moved_s, self._stuck = at_s, False
        elif at_s - self._moved_s > STANDSTILL_S and not self._stuck:
            self._stuck = True
            self.faults.append(FleetFault("deadlock", at_s, (), at_s - self._moved_s))

    def end(self, at_s: float, unanswered: Sequence[str]) -> None:
        """Places that are neither counted nor have a reason why not."""
        if unanswered:
            self.faults.append(FleetFault("unanswered", at_s, (), float(len(unanswered))))

    def count(self, kind: str) -> int:
        """Faults of one kind."""
        return sum(fault.kind == kind for fault in self.faults)


def fault_document(fault: FleetFault) -> Mapping[str, Any]:
    """As JSON has it."""
    return {
        "kind": fault.kind,
        "at_s": round(fault.at_s, 1),
        "drones": list(fault.drones),
        "value": round(fault.value, 3),
    }
