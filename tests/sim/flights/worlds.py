"""How well the simulated worlds are flown: the table of many seeds.

python -m tests.sim.flights.worlds --world rough --seeds 7101-7140 flies each seed as `flightd sim` does (with
`--ideal`: by computed sight, without pictures and sockets, at a tenth of the work) and prints a line for each
and one for all; exit 1 where a flight was not completed.  `--nodes A2,A3` flies a short route.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from flightd.config.paths import shipped
from flightd.config.schema import load_config
from flightd.core.types import Phase
from flightd.sim.plant.wind import WindParams
from flightd.sim.unknowns import WorldKind, unknowns_of
from flightd.site.site import Site
from flightd.site.site_file import load_site
from tests.sim.ideal.ideal_flight import Flown, IdealFlight, rms_off_line

_LONGEST_S = 900.0


@dataclass(frozen=True, slots=True)
class Result:
    """What the table tells of one flight; NaN where it got to nothing that can be measured."""

    seed: int
    completed: bool
    rms_m: float
    hover_p95_m: float
    landed_m: float
    miscounted: int
    faults: str
    reason: str


def flown_by_pictures(world: WorldKind, seed: int, nodes: str) -> Result:
    """One flight of the whole pipeline, in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "flightd", "sim", "--json", "--out", folder]
        command += ["--world", str(world), "--seed", str(seed)]
        command += ["--set", f"mission.nodes={nodes}"] if nodes else []
        done = subprocess.run(command, capture_output=True, text=True, timeout=_LONGEST_S, check=False)
    summary: dict[str, Any] = json.loads(done.stdout)

    def number(key: str) -> float:
        return math.nan if summary[key] is None else float(summary[key])

    return Result(
        seed=seed,
        completed=summary["mission"] == "completed",
        rms_m=number("cross_track_rms_m"),
        hover_p95_m=number("hover_error_p95_m"),
        landed_m=number("landed_error_m"),
        miscounted=summary["nodes_miscounted"],
        faults=" ".join(fault["kind"] for fault in summary["faults"]),
        reason=summary["reason"],
    )


def flown_ideally(world: WorldKind, seed: int, nodes: str) -> Result:
    """One flight by computed sight, with that world's sensors and link."""
    config, site = load_config(shipped("sim.toml")), load_site(shipped("site-demo.toml"))
    visits = tuple(nodes.split(",")) if nodes else ()
    unknowns = unknowns_of(world, seed)
    wind, painted = unknowns.wind(WindParams(), told=False), unknowns.floor(site, seed)
    flight = IdealFlight(site, config, visits=visits, seed=seed, wind=wind, unknowns=unknowns, world=painted)
    flown = flight.fly(_LONGEST_S)
    end, pad = flown.truth[-1][1], site.nodes[site.home.node]
    completed = flown.phase is Phase.DONE
    return Result(
        seed=seed,
        completed=completed,
        rms_m=rms_off_line(flown, painted),
        hover_p95_m=hover_p95_m(flown, painted),
        landed_m=math.hypot(end.x_m - pad.x_m, end.y_m - pad.y_m) if completed else math.nan,
        miscounted=0,
        faults="",
        reason=flown.reason,
    )


def hover_p95_m(flown: Flown, site: Site) -> float:
    """How far from its node the drone hovered, all but the worst twentieth; NaN where it never did."""
    off_m = [
        math.hypot(k.x_m - site.nodes[output.goal].x_m, k.y_m - site.nodes[output.goal].y_m)
        for output, (phase, k) in zip(flown.outputs, flown.truth, strict=True)
        if phase is Phase.HOVER and output.goal in site.nodes
    ]
    return statistics.quantiles(off_m, n=20)[-1] if len(off_m) > 1 else math.nan


def summary_line(results: Sequence[Result]) -> str:
    """All flights in one line; root mean square, mean and worst of what could be measured."""
    done = sum(result.completed for result in results)
    rms = [result.rms_m for result in results if not math.isnan(result.rms_m)]
    p95 = [result.hover_p95_m for result in results if not math.isnan(result.hover_p95_m)]
    landed = [result.landed_m for result in results if not math.isnan(result.landed_m)]
    square = math.sqrt(statistics.fmean(one * one for one in rms)) if rms else math.nan
    return (
        f"{done} of {len(results)} completed, rms {square:.3f} m (worst {max(rms, default=math.nan):.3f}), "
        f"hover p95 {statistics.fmean(p95) if p95 else math.nan:.3f} m "
        f"(worst {max(p95, default=math.nan):.3f}), landed within {max(landed, default=math.nan):.3f} m, "
        f"{sum(result.miscounted for result in results)} miscounted"
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--world", type=WorldKind, default=WorldKind.ROUGH)
    parser.add_argument("--seeds", default="7101-7110", help="FIRST-LAST")
    parser.add_argument("--nodes", default="A2,A3", help="route; empty: all nodes")
    parser.add_argument("--ideal", action="store_true", help="by computed sight")
    given = parser.parse_args()
    first, _, last = given.seeds.partition("-")
    fly = flown_ideally if given.ideal else flown_by_pictures
    results = []
    print(f"{'seed':>6} {'rms':>6} {'p95':>6} {'landed':>6}  outcome")
    for seed in range(int(first), int(last or first) + 1):
        one = fly(given.world, seed, given.nodes)
        results.append(one)
        outcome = f"{'completed' if one.completed else 'ABORTED'}: {one.reason} {one.faults}"
        print(f"{seed:>6} {one.rms_m:6.3f} {one.hover_p95_m:6.3f} {one.landed_m:6.3f}  {outcome}", flush=True)
    print(summary_line(results))
    return 0 if all(result.completed for result in results) else 1


if __name__ == "__main__":
    sys.exit(main())
