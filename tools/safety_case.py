"""The safety case of the guide: each hazard with its cause, how it is found and answered, and the evidence.

python -m tools.safety_case SWEEP.json... [--pairs PAIRS.json...] [--add | --renew]

The evidence is what flightd sim --scenario all --seeds N --json printed, and what python -m
tests.sim.hazards.hazard_pairs N --json wrote; then run python -m tools.write_guide.  With --add they are told
together with those that the page tells of already, where both are of the same code and vehicle, and of other
seeds.  With --renew they take the place of those of the same hazard, and the other rows stay as old as they
are.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from flightd.app.simulation.scenario_sweep import hazard_scenarios
from flightd.app.simulation.sweep_routes import digest
from flightd.guide.pages import FOLDER
from flightd.sim.scenario.scenario_files import shipped_scenarios

EVIDENCE = FOLDER / "safety-evidence.json"
_WORST = {"min_clearance_m": min, "off_leg_max_m": max, "max_overshoot_m": max, "down_s": max}
_COUNTS = ("flights", "good", "safe")
_ORIGIN = ("vehicle", "code")
_NOT_KEPT = "not kept"


class MixedError(ValueError):
    """Flights that are no evidence of one thing."""


def evidence_of(flights: Iterable[Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """What the flights of a sweep show of each hazard: how many there were and were good, the worst figures
    of all of them (None where none was measured)."""
    found: dict[str, dict[str, Any]] = {}
    by_hazard: dict[str, list[Mapping[str, Any]]] = {}
    for flight in flights:
        by_hazard.setdefault(flight["hazard"], []).append(flight)
    for hazard, flown in by_hazard.items():
        row: dict[str, Any] = {
            "flights": len(flown),
            "good": sum(not (flight["faults"] or flight["error"]) for flight in flown),
            **_origin(hazard, flown),
        }
        for key, worst in _WORST.items():
            values = [flight[key] for flight in flown if flight[key] is not None]
            row[key] = worst(values) if values else None
        found[hazard] = row
    return found


def evidence_of_pairs(flights: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """What flights with two random faults each show: how many there were and were safe, the worst figures."""
    nearest = [flight["min_clearance_m"] for flight in flights if flight["min_clearance_m"] is not None]
    above = [flight["max_overshoot_m"] for flight in flights if flight["max_overshoot_m"] is not None]
    return {
        "flights": len(flights),
        "safe": sum(not flight["unsafe"] for flight in flights),
        "min_clearance_m": min(nearest, default=None),
        "max_overshoot_m": max(above, default=None),
        **_origin("two faults", flights),
    }


def _origin(name: str, flights: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """What the flights of one row are of, as far as they tell.  MixedError where that is not one thing."""
    found: dict[str, Any] = {}
    for key in (*_ORIGIN, "scenario"):
        values = {str(flight.get(key, _NOT_KEPT)) for flight in flights}
        if len(values) > 1:
            raise MixedError(f"{name}: flights of different {key}: {', '.join(sorted(values))}")
        if values - {_NOT_KEPT}:
            found[key] = values.pop()
    seeds = sorted(flight["seed"] for flight in flights if "seed" in flight)
    if len(set(seeds)) < len(seeds):
        raise MixedError(f"{name}: one seed is told twice")
    days = [flight["flown"] for flight in flights if "flown" in flight]
    return found | ({"seeds": seeds} if seeds else {}) | ({"flown": max(days)} if days else {})


def together(name: str, told: Mapping[str, Any], more: Mapping[str, Any]) -> dict[str, Any]:
    """The evidence of two lots of flights of one kind: numbers of flights are added, of the figures the worse
    one stays.  MixedError where they are not of one code, vehicle and other seeds."""
    if not (told.get("flights") and more.get("flights")):
        return dict(told if told.get("flights") else more or told)
    for key in _ORIGIN:
        if told.get(key) is None or told.get(key) != more.get(key):
            text = f"{key} {told.get(key, _NOT_KEPT)}, these of {more.get(key, _NOT_KEPT)}"
            raise MixedError(f"{name}: the flights told of are of {text}; --renew tells of these alone")
    if str(more["code"]).endswith("-dirty"):
        raise MixedError(f"{name}: code {more['code']} is not known to be the same; commit it, or --renew")
    if again := set(told["seeds"]) & set(more["seeds"]):
        raise MixedError(f"{name}: told of already: seeds {_seeds_text(sorted(again))}")
    if told.get("scenario") != more.get("scenario"):
        raise MixedError(
            f"{name}: its scenario is another one since, or not kept; --renew tells of these alone"
        )
    both: dict[str, Any] = {key: told[key] for key in (*_ORIGIN, "scenario") if key in told}
    both |= {"seeds": sorted([*told["seeds"], *more["seeds"]]), "flown": max(told["flown"], more["flown"])}
    for key in [key for key in {**told, **more} if key not in both]:
        values = [found[key] for found in (told, more) if found.get(key) is not None]
        worst = sum if key in _COUNTS else _WORST[key]
        both[key] = worst(values) if values else None
    return both


def markdown() -> str:
    """The table as the guide prints it."""
    told = json.loads(EVIDENCE.read_text(encoding="utf-8"))
    evidence = told["hazards"]
    paths = shipped_scenarios()
    lines = [
        f"Last flown on {told['flown']}, in the {told['world']} world.",
        "",
        "| hazard | cause | found by | action | flown | good | nearest | off its leg | too high | down in"
        " | seeds | flown on | vehicle, code |",
        f"|{13 * '---|'}",
    ]
    for name, row in hazard_scenarios().items():
        shown = evidence.get(name)
        found_by = row.found_by if name == row.name else f"as `{row.name}`"
        cells = [f"`{name}`", _cause(paths[name]), found_by, str(row.action)]
        if shown is None:
            cells += ["not yet", *[""] * 8]
        elif shown.get("scenario") != digest(paths[name]):
            cells += ["not since its scenario or routes changed", *[""] * 8]
        else:
            cells += [*_cells(shown), *_origin_cells(shown)]
        lines.append(f"| {' | '.join(cells)} |")
    if pairs := told.get("pairs"):
        text = (
            f"Two random faults at random moments: {pairs['flights']} flights, {pairs['safe']} safe; nearest"
            f" {pairs['min_clearance_m']:.2f} m, at most {pairs['max_overshoot_m']:.2f} m too high."
        )
        seeds, flown, code = _origin_cells(pairs)
        lines += ["", f"{text} Seeds: {seeds}; flown on: {flown}; vehicle, code: {code}."]
    return "\n".join(lines) + "\n"


def _cells(shown: Mapping[str, Any]) -> list[str]:
    figures = [
        "-" if shown[key] is None else f"{shown[key]:.2f} {'s' if key == 'down_s' else 'm'}" for key in _WORST
    ]
    return [str(shown["flights"]), str(shown["good"]), *figures]


def _origin_cells(shown: Mapping[str, Any]) -> list[str]:
    """Which seeds, when, and what was flown."""
    seeds = _seeds_text(shown["seeds"]) if "seeds" in shown else _NOT_KEPT
    of = [str(shown[key]) for key in _ORIGIN if key in shown]
    return [seeds, shown.get("flown", _NOT_KEPT), ", ".join(of) or _NOT_KEPT]


def _seeds_text(seeds: Sequence[int]) -> str:
    """Seeds in order, runs of them by their ends."""
    runs: list[list[int]] = []
    for seed in seeds:
        if runs and seed == runs[-1][1] + 1:
            runs[-1][1] = seed
        else:
            runs.append([seed, seed])
    return ", ".join(f"{first} to {last}" if last > first else f"{first}" for first, last in runs)


def _cause(scenario: Path) -> str:
    """What goes wrong in a scenario: the sentence at the head of its file."""
    lines = scenario.read_text(encoding="utf-8").splitlines()
    head = [line.lstrip("# ") for line in lines[: next(i for i, line in enumerate(lines) if line[:1] != "#")]]
    return " ".join(head)


def main(arguments: Sequence[str]) -> int:
    plain = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=plain)
    parser.add_argument("sweeps", type=Path, nargs="+")
    parser.add_argument("--pairs", type=Path, nargs="+", default=[])
    parser.add_argument("--add", action="store_true")
    parser.add_argument("--renew", action="store_true")
    options = parser.parse_args(arguments)
    flights, pairs = _read(options.sweeps, "flights"), _read(options.pairs, "pairs")
    (world,) = {flight["world"] for flight in flights}  # one page tells of one world
    try:
        document = _document(parser, options, world, flights, pairs)
    except MixedError as err:
        parser.error(str(err))
    EVIDENCE.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    print(f"{EVIDENCE.name}: {len(flights)} flights and {len(pairs)} with two faults")
    return 0


def _document(
    parser: argparse.ArgumentParser,
    options: argparse.Namespace,
    world: str,
    flights: Sequence[Mapping[str, Any]],
    pairs: Sequence[Mapping[str, Any]],
) -> dict[str, Any]:
    """What the file of the evidence holds."""
    hazards, of_pairs = evidence_of(flights), evidence_of_pairs(pairs)
    if options.add or options.renew:
        told = json.loads(EVIDENCE.read_text(encoding="utf-8"))
        if told["world"] != world:
            parser.error(
                f"{EVIDENCE.name} tells of the {told['world']} world, these flights are of the {world} one"
            )
        before, pairs_before = told["hazards"], told.get("pairs", {})
        if options.renew:
            hazards = {**before, **hazards}
            of_pairs = of_pairs if pairs else pairs_before
        else:
            names = before | hazards
            hazards = {name: together(name, before.get(name, {}), hazards.get(name, {})) for name in names}
            of_pairs = together("two faults", pairs_before, of_pairs)
    document = {"flown": f"{datetime.now(UTC):%Y-%m-%d}", "world": world, "hazards": hazards}
    if of_pairs.get("flights"):
        document["pairs"] = of_pairs
    return document


def _read(files: Iterable[Path], key: str) -> list[Mapping[str, Any]]:
    return [flight for file in files for flight in json.loads(file.read_text(encoding="utf-8"))[key]]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
