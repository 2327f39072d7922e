"""How long it takes to plan a whole fleet at once, and how good the plans are: the traffic's benchmark.

Every drone leaves its pad, counts at a node of its own that is drawn by the seed, and comes back: the hardest
moment of a fleet, for all leave at the same time.  Times are processor time.
"""

from __future__ import annotations

import random
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from flightd.fleet.traffic.action_graph import ActionGraph, Course
from flightd.fleet.traffic.cells import CellSize, conflicts_of
from flightd.fleet.traffic.lanes import LaneGraph, lanes_of
from flightd.fleet.traffic.motions import MotionNet, at_rest, vertex_of
from flightd.fleet.traffic.plan import Stop
from flightd.fleet.traffic.prioritised import WEIGHT, PrioritisedPlanner
from flightd.fleet.traffic.tours import Request
from flightd.sim.fleet.hall import fleet_hall
from flightd.sim.fleet.simulation import PACE

if TYPE_CHECKING:
    from rich.table import Table

_DWELL_MS: Final = 20_000


@dataclass(frozen=True, slots=True)
class BenchCase:
    """A hall, and how many drones are planned in it."""

    drones: int
    aisles: int
    nodes: int
    weight: float = WEIGHT
    seed: int = 1


CASES: Final = (BenchCase(20, 5, 10), BenchCase(100, 20, 25))
"""About 200 and 2,000 nodes, those of the docks among them."""


@dataclass(frozen=True, slots=True)
class Measured:
    """`setup_s` is spent once for a site; `plan_s` for all plans, `graph_s` for their order.  `alone_s` is
    the longest flight of a drone that is alone: no plan of all is over sooner."""

    drones: int
    weight: float
    site_nodes: int
    setup_s: float
    plan_s: float
    graph_s: float
    planned: int
    states: int
    makespan_s: float
    alone_s: float

    def document(self) -> dict[str, Any]:
        """As JSON has it."""
        return {
            "drones": self.drones,
            "weight": self.weight,
            "nodes": self.site_nodes,
            "setup_s": round(self.setup_s, 3),
            "plan_s": round(self.plan_s, 3),
            "graph_s": round(self.graph_s, 3),
            "planned": self.planned,
            "states": self.states,
            "makespan_s": round(self.makespan_s, 1),
            "alone_s": round(self.alone_s, 1),
        }


def measure(case: BenchCase) -> Measured:
    """Plan one case."""
    site = fleet_hall(case.aisles, case.nodes, case.drones)
    began_s = time.process_time()
    lanes = lanes_of(site)
    conflicts = conflicts_of(lanes, CellSize())
    planner = PrioritisedPlanner(MotionNet(lanes, PACE), conflicts, case.weight)
    setup_s = time.process_time() - began_s
    requests = _requests(case, lanes, [node for node in site.nodes if _has_shelves(site.nodes[node].aisle)])
    began_s = time.process_time()
    planned = planner.plan(requests)
    plan_s = time.process_time() - began_s
    began_s = time.process_time()
    ActionGraph(
        {
            request.drone: Course(vertex_of(request.configuration), 0, planned.plans[request.drone].actions)
            for request in requests
            if request.drone in planned.plans
        },
        conflicts,
    )
    graph_s = time.process_time() - began_s
    alone = [planner.plan([request]).plans[request.drone].end_ms for request in requests]
    return Measured(
        case.drones,
        case.weight,
        len(site.nodes),
        setup_s,
        plan_s,
        graph_s,
        len(planned.plans),
        planned.states,
        max(plan.end_ms for plan in planned.plans.values()) / 1000,
        max(alone) / 1000,
    )


def _has_shelves(aisle: str) -> bool:
    return len(aisle) < 3  # the docks' names are longer


def _requests(case: BenchCase, lanes: LaneGraph, nodes: Sequence[str]) -> list[Request]:
    goals = random.Random(case.seed).sample(nodes, case.drones)
    return [
        Request(
            f"drone-{i}",
            at_rest(pad, 0),
            0,
            (Stop(lanes.over(goal), lanes.column_of[goal], _DWELL_MS),),
            (pad,),
        )
        for i, (pad, goal) in enumerate(zip(lanes.pads, goals, strict=False), start=1)
    ]


def as_table(measured: Sequence[Measured]) -> Table:
    """For people."""
    from rich.table import Table  # noqa: PLC0415

    table = Table(title="Planning a fleet at once, processor time", title_justify="left")
    for heading in (
        "drones",
        "weight",
        "nodes",
        "site, once",
        "plans",
        "order",
        "planned",
        "makespan",
        "longest alone",
    ):
        table.add_column(heading, justify="right")
    for each in measured:
        table.add_row(
            str(each.drones),
            f"{each.weight:g}",
            str(each.site_nodes),
            f"{each.setup_s:.2f} s",
            f"{each.plan_s:.2f} s",
            f"{each.graph_s:.2f} s",
            str(each.planned),
            f"{each.makespan_s:.0f} s",
            f"{each.alone_s:.0f} s",
        )
    return table
