"""How good the plans of a fleet's traffic are, beside open solvers of multi-agent path finding (MAPF).

Both plan the same drones on the same floors by MAPF's rules: a drone is a point, goes one node in a step or
waits, may follow another one directly, shares no node and swaps with nobody, and begins at a node to stay on
its goal for good.  flightd's turns and climbs take no time here; it flies 2 m a second on nodes 2 m apart.

Printed, a line of JSON for each case: the steps until the last drone of all is there, by each solver, null
where it finds no plan; and the longest of the shortest ways, which no plan can beat.  Exit 1 where flightd's
is longer than 1.2 times the best of the solvers named by --of.

python -m tools.bench_mapf [--lacam3 build/main] [--seeds 1 2 3 4] [--of pypibt py-lacam]

Solvers are taken where they are: lacam3's program by --lacam3, the Python packages pypibt and pycam
(py-lacam) from PYTHONPATH.  Their sources: github.com/Kei18/lacam3, pypibt, py-lacam.
"""

from __future__ import annotations

import argparse
import json
import math
import random
import re
import subprocess
import sys
import tempfile
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeAlias
from unittest.mock import patch

import numpy as np
import numpy.typing as npt

from flightd.fleet.traffic import traffic_control
from flightd.fleet.traffic.cells import CellSize, Conflicts
from flightd.fleet.traffic.lanes import LaneGraph, lanes_of
from flightd.fleet.traffic.traffic_control import TrafficControl
from flightd.mission.plan.leg_times import Pace
from flightd.sim.fleet.hall import SPACING_M, fleet_hall
from flightd.sim.fleet.planning_bench import CASES, BenchCase
from flightd.site.site import Site

Cell: TypeAlias = tuple[int, int]
"""Row and column."""

MOST_TIMES = 1.2
_AT_ONCE = 1e9
_STEP = Pace(1.5, 1e6, _AT_ONCE, SPACING_M, _AT_ONCE, 1e6, _AT_ONCE, 0.0, 0.0, 0.001, 0.001)
_MOST_STEPS = 1500
_STANDS_S = 0.3
"""Take-off, landing and launches of a plan in steps of a second, all of them together."""


@dataclass(frozen=True)
class Instance:
    """Drones that go from one node to another; `grid` (H, W) is true where there is floor to fly over."""

    starts: tuple[str, ...]
    goals: tuple[str, ...]
    grid: npt.NDArray[np.bool_]
    cells: dict[str, Cell]

    def places(self, nodes: Sequence[str]) -> list[Cell]:
        return [self.cells[node] for node in nodes]


def instance_of(site: Site, lanes: LaneGraph, case: BenchCase, seed: int, *, home: bool) -> Instance:
    """From the pads to nodes in the aisles, or the other way round."""
    shelves = [name for name, node in site.nodes.items() if len(node.aisle) < 3]
    goals = random.Random(seed).sample(shelves, case.drones)
    pads = [lanes.vertices[pad].node for pad in lanes.pads][: case.drones]
    corner = (min(n.x_m for n in site.nodes.values()), min(n.y_m for n in site.nodes.values()))
    cells = {
        name: (round((node.y_m - corner[1]) / SPACING_M), round((node.x_m - corner[0]) / SPACING_M))
        for name, node in site.nodes.items()
    }
    grid = np.zeros((1 + max(y for y, _ in cells.values()), 1 + max(x for _, x in cells.values())), np.bool_)
    for lane in lanes.lanes:
        a, b = (lanes.vertices[end] for end in (lane.a, lane.b))
        if not (a.pad or b.pad):
            (ya, xa), (yb, xb) = cells[a.node], cells[b.node]
            grid[min(ya, yb) : max(ya, yb) + 1, min(xa, xb) : max(xa, xb) + 1] = True
    starts, ends = (goals, pads) if home else (pads, goals)
    return Instance(tuple(starts), tuple(ends), grid, cells)


def flightd_steps(lanes: LaneGraph, instance: Instance) -> int | None:
    """By the fleet's own traffic, whose drones are points here."""

    def points(lanes: LaneGraph, _: CellSize) -> Conflicts:
        return tuple((resource,) for resource in range(len(lanes.boxes)))

    with patch.object(traffic_control, "conflicts_of", points):
        control = TrafficControl(lanes, _STEP, CellSize())
    for i, (start, goal) in enumerate(zip(instance.starts, instance.goals, strict=True)):
        control.enter(f"drone-{i}", lanes.over(start), ends=(lanes.over(goal),))
    if control.replan(list(control.drones), 0):
        return None
    last_ms = max(course.ahead[-1].end_ms for course in control.drones.values() if course.ahead)
    return math.ceil(last_ms / 1000 - _STANDS_S)


def pypibt_steps(instance: Instance, seed: int) -> int | None:
    starts, goals = instance.places(instance.starts), instance.places(instance.goals)
    solver: Any = import_module("pypibt").PIBT(instance.grid, starts, goals, seed=seed)
    plan = solver.run(max_timestep=_MOST_STEPS)
    return len(plan) - 1 if list(plan[-1]) == goals else None


def py_lacam_steps(instance: Instance, seed: int, limit_s: float) -> int | None:
    config: Any = import_module("pycam.mapf_utils").Config
    plan = import_module("pycam").LaCAM().solve(
        grid=instance.grid,
        starts=config(instance.places(instance.starts)),
        goals=config(instance.places(instance.goals)),
        seed=seed,
        time_limit_ms=round(limit_s * 1000),
        flg_star=True,
        verbose=0,
    )  # fmt: skip
    return len(plan) - 1 if plan else None


def lacam3_steps(program: Path, instance: Instance, seed: int, limit_s: float) -> int | None:
    """By its program, which reads a map and a scenario of the MovingAI benchmarks."""
    high, wide = instance.grid.shape
    rows = ("".join("." if free else "@" for free in row) for row in instance.grid)
    ways = zip(instance.places(instance.starts), instance.places(instance.goals), strict=True)
    with tempfile.TemporaryDirectory() as made:
        floor, scenario, result = (Path(made) / name for name in ("floor.map", "floor.scen", "result.txt"))
        floor.write_text("\n".join([f"type octile\nheight {high}\nwidth {wide}\nmap", *rows, ""]))
        lines = (f"0\tfloor.map\t{wide}\t{high}\t{x}\t{y}\t{gx}\t{gy}\t0\n" for (y, x), (gy, gx) in ways)
        scenario.write_text("version 1\n" + "".join(lines))
        given = [
            "-m",
            floor,
            "-i",
            scenario,
            "-o",
            result,
            "-N",
            len(instance.starts),
            "-t",
            limit_s,
            "-s",
            seed,
        ]
        subprocess.run(  # noqa: S603 - a solver that is named on the command line
            [program, *map(str, given), "-l"], check=True, capture_output=True
        )
        told = dict(re.findall(r"^(\w+)=(.*)$", result.read_text(), re.MULTILINE))
    return int(told["makespan"]) if told["solved"] == "1" else None


def least_steps(instance: Instance) -> int:
    """The longest of the shortest ways."""
    return max(
        _distance(instance.grid, start, goal)
        for start, goal in zip(instance.places(instance.starts), instance.places(instance.goals), strict=True)
    )


def _distance(grid: npt.NDArray[np.bool_], start: Cell, goal: Cell) -> int:
    known, front = {start: 0}, deque([start])
    while goal not in known:
        y, x = front.popleft()
        for at in ((y - 1, x), (y + 1, x), (y, x - 1), (y, x + 1)):
            inside = 0 <= at[0] < grid.shape[0] and 0 <= at[1] < grid.shape[1]
            if inside and grid[at] and at not in known:
                known[at] = known[y, x] + 1
                front.append(at)
    return known[goal]


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--lacam3", type=Path, help="its program")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--limit-s", type=float, default=30.0)
    parser.add_argument("--of", nargs="+", default=["pypibt", "py-lacam"], metavar="SOLVER")
    options = parser.parse_args()
    solvers: dict[str, Callable[[Instance, int, float], int | None]] = {}
    if find_spec("pypibt"):
        solvers["pypibt"] = lambda instance, seed, _: pypibt_steps(instance, seed)
    if find_spec("pycam"):
        solvers["py-lacam"] = py_lacam_steps
    if options.lacam3:
        solvers["lacam3"] = lambda *asked: lacam3_steps(options.lacam3, *asked)
    good = True
    for case in CASES:
        site = fleet_hall(case.aisles, case.nodes, case.drones)
        lanes = lanes_of(site)
        for seed in options.seeds:
            for home in (False, True):
                instance = instance_of(site, lanes, case, seed, home=home)
                own = flightd_steps(lanes, instance)
                others = {name: solve(instance, seed, options.limit_s) for name, solve in solvers.items()}
                told = {"drones": case.drones, "nodes": len(site.nodes), "seed": seed, "home": home}
                print(
                    json.dumps({**told, "flightd": own, **others, "least": least_steps(instance)}), flush=True
                )
                best = min((n for name, n in others.items() if name in options.of and n), default=math.inf)
                good &= own is not None and own <= MOST_TIMES * best
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
