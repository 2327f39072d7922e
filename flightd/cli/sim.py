"""`flightd sim`: a whole mission in the simulator, with its report."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flightd.core.errors import RunError

if TYPE_CHECKING:
    from flightd.app.simulation.prepare import SimOptions
    from flightd.app.simulation.simulation import Simulation
    from flightd.app.simulation.sweep_routes import SweepRoute

EXAMPLES = """Examples:

  flightd sim                                  the demo site, one flight in lockstep
  flightd sim --seed 7 --json                  the summary as JSON
  flightd sim --speed 1                        in real time, over UDP between processes
  flightd sim --warehouse configs/site-large.toml --out /tmp/large
  flightd sim --truth-url tcp:127.0.0.1:5762 --vehicle-url tcp:127.0.0.1:5760   ArduCopter's SITL flies
  flightd sim --scenario camera_frozen --scenario wind.toml    what goes wrong, by name or file
  flightd sim --scenario all                   every hazard in turn, and one table
  flightd sim --world ideal                    a drone that is as its configuration says
  flightd sim --seeds 10                       ten flights, seeds 1 to 10, and one table
  flightd sim --camera stream:h264             by video over the network, in real time
  flightd sim --set mission.heading=shelf --set control.tilt_compensation=none
"""


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("sim", epilog=EXAMPLES)(sim)


def sim(
    config: Annotated[
        Path | None, typer.Option(help="Configuration file (default: configs/sim.toml).")
    ] = None,
    warehouse: Annotated[
        str | None, typer.Option(help="Site file, or random:SEED for a random site.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of wind, sensors, floor and camera.", min=0)] = 1,
    seeds: Annotated[
        int, typer.Option(help="So many flights, from --seed on, and one table.", min=1, max=10_000)
    ] = 1,
    vehicle: Annotated[
        str | None,
        typer.Option(help="ardupilot (default), px4, ardrone or mavsdk (flies PX4, in real time)."),
    ] = None,
    speed: Annotated[
        str | None,
        typer.Option(help="max (lockstep, the default), or a multiple of real time.", show_default=False),
    ] = None,
    scenario: Annotated[
        list[str] | None,
        typer.Option(help="Name or file of a scenario; several are laid over each other; all: each in turn."),
    ] = None,
    world: Annotated[
        str,
        typer.Option(
            help="How much of itself the drone keeps from its computer: ideal (nothing), usual or rough."
        ),
    ] = "usual",
    plant: Annotated[
        str, typer.Option(help="Whose airframe flies: own, or rotorpy (extra rotorpy).")
    ] = "own",
    camera: Annotated[
        str,
        typer.Option(
            help="How the down camera's pictures come: shared (memory), or in real time by RTP, stream:mjpeg"
            " or stream:h264 (extra ardrone)."
        ),
    ] = "shared",
    out: Annotated[Path, typer.Option(help="Folder for log, report and summary.")] = Path("out/sim"),
    settings: Annotated[
        list[str] | None, typer.Option("--set", help="KEY=VALUE over the configuration.")
    ] = None,
    truth_url: Annotated[
        str, typer.Option(help="tcp:HOST:PORT of an external simulator's second port: it is the airframe.")
    ] = "",
    vehicle_url: Annotated[
        str, typer.Option(help="Where its autopilot is flown, e.g. tcp:127.0.0.1:5760.")
    ] = "",
    as_json: Annotated[bool, typer.Option("--json", help="Print summary.json and nothing else.")] = False,
) -> None:
    """Fly a whole mission in the simulator and leave its log, report and summary.

    Exit code 0 where the simulator's judge calls the flight good, else 1.  Interrupted (Ctrl-C, SIGTERM),
    it leaves what was flown so far, with 128 and the signal's number; a second time, it ends at once.
    Of --scenario all each flight's row is in OUT/sweep.jsonl as soon as it ended; interrupted, the same
    command goes on with the rest."""
    from flightd.app.simulation.prepare import SimOptions
    from flightd.runtime.child_process import start_child_server

    options = SimOptions(
        config,
        warehouse,
        seed,
        vehicle,
        speed,
        tuple(settings or ()),
        truth_url,
        vehicle_url,
        world,
        plant,
        camera,
    )
    options.check()
    start_child_server()  # while the rest is imported
    _fly_all(options, scenario or [], seeds, out, as_json=as_json)


def _fly_all(options: SimOptions, scenario: Sequence[str], seeds: int, out: Path, *, as_json: bool) -> None:
    """One flight, one for each seed, or one for each hazard and seed, in folders of their own."""
    from flightd.app.simulation.flown_code import flown_code
    from flightd.app.simulation.prepare import prepare
    from flightd.app.simulation.scenario_sweep import Origin, hazard_scenarios
    from flightd.app.simulation.sweep_log import SweepLog, asked_of
    from flightd.app.simulation.sweep_routes import ALONG, AS_SET, route_of
    from flightd.cli.scenario_sweep import fly_seeds, sweep
    from flightd.sim.scenario.scenario import Scenario
    from flightd.sim.scenario.scenario_files import load_scenarios

    every = range(options.seed, options.seed + seeds)
    if scenario == ["all"]:

        def prepared(conditions: Scenario, name: str, seed: int, route: SweepRoute) -> Simulation:
            folder = out / name if seeds == 1 else out / name / f"seed-{seed}"
            return prepare(replace(options, seed=seed), conditions, folder, _say, sweep_route=route.setting)

        # what cannot be flown at all is refused here
        own = any(text.partition("=")[0].strip() == "mission.nodes" for text in options.settings)
        routes = (lambda *_: AS_SET) if own else route_of
        for route in dict.fromkeys(
            [AS_SET] if own else [ALONG, *(routes(seed, Scenario()) for seed in every[:2])]
        ):
            first = prepare(options, Scenario(), out, lambda _: None, sweep_route=route.setting)
        origin = Origin(options.world, first.config.vehicle.kind, flown_code())
        asked = asked_of(options, len(hazard_scenarios()) * seeds, seeds)
        sweep(prepared, every, SweepLog(out / "sweep.jsonl", asked, _say), origin, routes, as_json=as_json)
        return
    conditions = load_scenarios(scenario) if scenario else Scenario()
    if seeds == 1:
        _fly(prepare(options, conditions, out, _say), as_json=as_json)
        return
    each = (prepare(replace(options, seed=n), conditions, out / f"seed-{n}", _say) for n in every)
    fly_seeds(each, as_json=as_json)


def _fly(simulation: Simulation, *, as_json: bool) -> None:
    """Fly, write what came of it, and print it.  RunError where the judge calls it bad."""
    from flightd.app.simulation.launch import FlightInterruptedError, fly
    from flightd.app.simulation.summary import write_results
    from flightd.cli.flight_progress import FlightProgress
    from flightd.cli.scenario_sweep import faults_in_words
    from flightd.replay.report.page import write_report
    from flightd.runtime.ending_signals import end_at_once_on_signals
    from flightd.studies.counted_stock import counted_beside

    started = time.monotonic()
    interrupted: FlightInterruptedError | None = None
    with FlightProgress(shown=not as_json) as progress:
        try:
            result = fly(replace(simulation, observer=progress))
        except FlightInterruptedError as err:
            end_at_once_on_signals()  # its report takes a while, too
            if err.result is None:
                _say(str(err))
                raise typer.Exit(128 + err.signal) from None
            interrupted, result = err, err.result
    ended_by = "" if interrupted is None else interrupted.signal.name
    summary = write_results(simulation, result, time.monotonic() - started, ended_by=ended_by)
    report = simulation.folder / "report.html"
    write_report(simulation.flight_log, report, counted_beside(simulation.flight_log))
    if as_json:
        print(json.dumps(summary, indent=2))
    else:
        _print_summary(summary, report, simulation.speed)
    if interrupted is not None:
        _say(str(interrupted))
        raise typer.Exit(128 + interrupted.signal)
    if summary["verdict"] != "good":
        raise RunError(f"mission {_ending(summary)}; a bad flight: {faults_in_words(summary['faults'])}")


def _verdict(summary: dict[str, Any]) -> str:
    from flightd.cli.scenario_sweep import faults_in_words

    return ": ".join(filter(None, (summary["verdict"], faults_in_words(summary["faults"]))))


def _ending(summary: dict[str, Any]) -> str:
    return f"{summary['mission']}: {summary['reason']}"


def _say(line: str) -> None:
    print(f"flightd: {line}", file=sys.stderr)


def _counted(summary: dict[str, Any]) -> str:
    codes = f"{summary['codes_read']} of {summary['codes_expected']} codes, {summary['codes_wrong']} wrong"
    empty = f"{summary['empty_right']} of {summary['empty_expected']} empty places"
    rate = summary["locations_per_hour"]
    visited = f"{summary['locations_visited']} of {summary['locations_planned']}"
    return f"{visited} ({rate:.0f} an hour): {codes}; {empty}"


def _times(simulated_s: float, wall_s: float) -> str:
    return f"{wall_s:.0f} s ({simulated_s / max(wall_s, 1e-9):.1f} x)"


def _latencies(summary: dict[str, Any], speed: float | None) -> list[tuple[str, str]]:
    """What was measured, by which clock; in lockstep what the simulator takes a detection for."""
    from flightd.app.simulation.launch import DETECTION_S

    def both(ms: dict[str, float]) -> str:
        return f"{ms['p50']:.0f} ms, p99 {ms['p99']:.0f} ms"

    whole, ours = both(summary["latency_ms"]), summary["arrival_to_wire_ms"]
    if ours is not None:
        return [("exposure to setpoint", whole), ("without the camera's delay", both(ours))]
    clock = f"modelled: in lockstep a detection takes {DETECTION_S * 1e3:.0f} ms; --speed 1 measures"
    if speed is not None:
        clock = f"by a clock {speed:g} times as fast"
    return [("exposure to setpoint", f"{whole} ({clock})")]


def _print_summary(summary: dict[str, Any], report: Path, speed: float | None) -> None:
    from rich.console import Console
    from rich.table import Table

    from flightd.runtime.process_age import process_age_s

    def metres(key: str) -> str:
        value = summary[key]
        return "-" if value is None else f"{value * 100:.1f} cm"

    table = Table(title=f"Mission {_ending(summary)}", show_header=False, title_justify="left")
    simulated, wall, whole_s = summary["flight_time_s"], summary["wall_time_s"], process_age_s()
    rows = [
        (
            "nodes visited",
            f"{summary['nodes_visited']} of {summary['nodes_planned']}, {summary['nodes_miscounted']} wrong",
        ),
        ("off the line, rms", metres("cross_track_rms_m")),
        ("hover error, p95", metres("hover_error_p95_m")),
        ("nearest to rack or ceiling", metres("min_clearance_m")),
        ("landing error", metres("landed_error_m")),
        ("flight time", f"{simulated:.0f} s, flown in {_times(simulated, wall)}"),
        *(
            [("whole command", _times(simulated, whole_s) + " with its start, verdict and report")]
            if whole_s
            else []
        ),
        *([("locations", _counted(summary))] if summary.get("locations_planned") else []),
        ("frames", f"{summary['frames']}, {summary['frames_dropped']} dropped"),
        *_latencies(summary, speed),
        ("verdict", _verdict(summary)),
        ("report", str(report)),
    ]
    for name, value in rows:
        table.add_row(name, value)
    Console(file=sys.stdout).print(table)
