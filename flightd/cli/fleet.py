"""`flightd fleet`: many drones on one floor.  What it needs is imported when it runs."""

from __future__ import annotations

import json
import sys
from typing import Annotated

import typer

from flightd.cli.application import group
from flightd.cli.options import AsJson
from flightd.cli.tables import stdout
from flightd.core.errors import RunError

_DOCK_LINES = 6


def register(app: typer.Typer) -> None:
    """Hang the commands under `app`."""
    fleet = group("flightd fleet sim\nflightd fleet bench")
    fleet.command("sim")(sim)
    fleet.command("bench")(bench)
    app.add_typer(fleet, name="fleet", help="Fly many drones on one floor, and measure their traffic.")


def sim(
    drones: Annotated[int, typer.Option(min=1, max=50, help="How many fly.")] = 10,
    aisles: Annotated[int, typer.Option(min=2, max=100, help="Aisles with shelves.")] = 40,
    nodes: Annotated[int, typer.Option(min=2, max=100, help="Nodes in each of them.")] = 48,
    hours: Annotated[float, typer.Option(min=0.1, max=48.0, help="Simulated, at most.")] = 8.0,
    seed: Annotated[int, typer.Option(min=0, help="The same seed flies the same.")] = 1,
    failing: Annotated[int, typer.Option(min=0, max=50, help="Drones that fail between shelves.")] = 2,
    closes: Annotated[
        bool, typer.Option("--close/--no-close", help="Close an aisle for a tenth of the hours.")
    ] = True,
    swaps: Annotated[int, typer.Option(min=0, max=20, help="Docks that swap a battery, for all.")] = 0,
    contacts: Annotated[int, typer.Option(min=0, max=20, help="Docks that charge by contact, for all.")] = 0,
    misaligned: Annotated[
        float, typer.Option(min=0.0, max=1.0, help="Share of landings without contact, on these.")
    ] = 0.1,
    hub_kills: Annotated[
        float, typer.Option(min=0.0, max=60.0, help="Kills of the station an hour; a new one goes on.")
    ] = 2.0,
    broker_kills: Annotated[
        float, typer.Option(min=0.0, max=60.0, help="Times an hour that all links are cut at once.")
    ] = 2.0,
    compare: Annotated[
        bool, typer.Option("--compare", help="Fly one drone alone, too: the speed-up.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Let a fleet count a hall in a fast world without pixels, and judge it by where the drones truly are.

    Their pace is not what is planned, links are cut, positions doubted, batteries drawn and charged; drones
    fail between shelves, an aisle is closed, the station is killed and another one goes on.  Each drone is
    charged on its own pad, unless there are docks, which all of them share then.  Bad is: a shared cell, a
    deadlock, a battery below its reserve, a place that is neither counted nor has a reason why not.

    \b
    Examples:
      flightd fleet sim
      flightd fleet sim --drones 3 --aisles 8 --nodes 6 --hours 1
      flightd fleet sim --seed 7 --compare --json
      flightd fleet sim --swaps 1 --contacts 3
    """
    from flightd.sim.fleet.simulation import FleetScenario, alone, fly_fleet

    scenario = FleetScenario(
        drones,
        aisles,
        nodes,
        hours,
        seed,
        failing,
        closes_aisle=closes,
        swaps=swaps,
        contacts=contacts,
        misaligned=misaligned,
        hub_kills_per_h=hub_kills,
        broker_kills_per_h=broker_kills,
    )
    result = fly_fleet(scenario)
    document = result.document()
    if compare:
        document["speed_up"] = round(result.places_per_hour / fly_fleet(alone(scenario)).places_per_hour, 2)
    if as_json:
        print(json.dumps(document, indent=2))
    else:
        for line in _in_words(document):
            print(line)
    if not result.good:
        raise RunError(f"the fleet's flight is bad: {len(result.judge.faults)} faults")


def _in_words(d: dict[str, object]) -> list[str]:
    lines = [
        f"{d['drones']} drones, {d['aisles']} aisles, seed {d['seed']}: {d['verdict']}",
        f"{d['counted']} of {d['places']} places counted in {_hours(d['end_s'])},"
        f" {d['places_per_hour']:g} an hour, {_hours(d['flown_s'])} in the air",
        f"shared cells {d['shared_cells']}, deadlocks {d['deadlocks']},"
        f" below the reserve {d['below_reserve']}, places without an answer {d['unanswered']}",
        f"{_distance(d['least_distance_m'])}least charge {d['least_charge']}, planned {d['replans']} times",
        f"killed: the station {d['hub_kills']} times, all links {d['broker_kills']} times",
    ]
    lines += _dock_lines(d)
    if d["failed"]:
        lines.append(f"failed: {', '.join(map(str, _listed(d['failed'])))}")
    reasons: dict[str, list[str]] = {}
    told = d["not_counted"]
    for node, why in told.items() if isinstance(told, dict) else ():
        reasons.setdefault(str(why), []).append(str(node))
    lines += [f"not counted, {why}: {_some(nodes)}" for why, nodes in reasons.items()]
    if "speed_up" in d:
        lines.append(f"speed-up over one drone {d['speed_up']}")
    return lines


def _distance(least_m: object) -> str:
    """Nothing of a drone alone."""
    return "" if least_m is None else f"least distance of two drones {least_m} m, "


def _dock_lines(d: dict[str, object]) -> list[str]:
    """None without docks."""
    if "docks" not in d:
        return []
    docks = [dock for dock in _listed(d["docks"]) if isinstance(dock, dict)]
    told = [f"{dock['dock']} ({dock['kind']}) {dock['landings']}" for dock in docks]
    lines = [f"landings on docks: {', '.join(told)}; waited for one {_hours(d['waited_for_docks_s'])}"]
    shown = _listed(d["docks_told"])[:_DOCK_LINES]
    more = int(str(d["docks_told_count"])) - len(shown)
    return [*lines, *map(str, shown), *([f"and {more} more of docks"] if more > 0 else [])]


def _listed(value: object) -> list[object]:
    return list(value) if isinstance(value, list) else []


def _some(nodes: list[str]) -> str:
    return f"{' '.join(nodes[:12])}{' …' if len(nodes) > 12 else ''} ({len(nodes)} nodes)"


def _hours(seconds: object) -> str:
    return f"{float(str(seconds)) / 3600:.2f} h"


def bench(as_json: AsJson = False) -> None:
    """Measure how long planning takes: 20 drones on 200 nodes, 100 drones on 2,000 nodes, processor time.

    \b
    Examples:
      flightd fleet bench
      flightd fleet bench --json
    """
    from flightd.sim.fleet.planning_bench import CASES, as_table, measure

    measured = [measure(case) for case in CASES]
    if as_json:
        sys.stdout.write(json.dumps([each.document() for each in measured], indent=2) + "\n")
    else:
        stdout().print(as_table(measured))
