"""`flightd sim`: a whole mission in the simulator, with its report."""

from __future__ import annotations

import csv
import json
import sys
import time
from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Annotated, Any

import typer

from flightd.core.errors import InputError, RunError

EXAMPLES = """Examples:

  flightd sim                                  the demo site, one flight in lockstep
  flightd sim --seed 7 --json                  the summary as JSON
  flightd sim --speed 1                        in real time, over UDP between processes
  flightd sim --warehouse configs/site-large.toml --out /tmp/large
  flightd sim --truth-url tcp:127.0.0.1:5762 --vehicle-url tcp:127.0.0.1:5760   ArduCopter's SITL flies
  flightd sim --scenario camera_frozen --scenario wind.toml    what goes wrong, by name or file
  flightd sim --scenario all                   every hazard in turn, and one table
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
    """Fly a whole mission in the simulator and leave its log, report and summary."""
    from flightd.app.counting.flight_count import going_on
    from flightd.app.simulation.launch import Simulation, fly
    from flightd.app.simulation.ports import fitted
    from flightd.app.simulation.process_faults import check_faults
    from flightd.app.simulation.stock_summary import stock_summary
    from flightd.cli.flight_progress import FlightProgress
    from flightd.cli.scenario_sweep import SHORT_ROUTE, sweep
    from flightd.sim.plant.external_simulator import truth_address
    from flightd.sim.scenario.scenario import Scenario
    from flightd.sim.scenario.scenario_files import load_scenarios

    external = bool(truth_url or vehicle_url)
    if external and not (truth_url and vehicle_url):
        raise InputError("--truth-url and --vehicle-url belong together: give both or neither")

    def prepare(conditions: Scenario, folder: Path, route: list[str]) -> Simulation:
        keys = _camera_keys(conditions)
        chosen, site = _configured(config, warehouse, vehicle, [*route, *(settings or [])], keys)
        clock = conditions.needs_real_time
        wanted = None if route and not clock else speed  # of all, only those that need the clock
        factor = _factor(wanted, _own_clock(chosen.vehicle.kind, truth_url), clock=clock)
        if external:
            truth_address(truth_url)
            update = {"vehicle": chosen.vehicle.model_copy(update={"url": vehicle_url})}
            chosen = chosen.model_copy(update=update)
        if factor is None and chosen.ground.listen:
            print("flightd: the ground link is off in lockstep; --speed 1 turns it on", file=sys.stderr)
        chosen = fitted(chosen, site)
        check_faults(conditions.fault, chosen, site, external=external)
        _make_folder(folder, going_on=bool(chosen.inventory.run))
        chosen = going_on(chosen, site, folder)
        return Simulation(chosen, site, conditions, seed, factor, folder, truth_url=truth_url)

    if scenario == ["all"]:
        sweep(lambda conditions, name: prepare(conditions, out / name, [SHORT_ROUTE]), as_json=as_json)
        return
    conditions = load_scenarios(scenario) if scenario else Scenario()
    simulation = prepare(conditions, out, [])
    started = time.monotonic()
    with FlightProgress(shown=not as_json) as progress:
        result = fly(replace(simulation, observer=progress))
    _write_truth(simulation)
    summary = _summary(simulation, result, time.monotonic() - started)
    summary |= stock_summary(simulation, summary["flight_time_s"])
    (out / "summary.json").write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    _write_inventory(out, result.visited)
    report = _report(simulation)
    if as_json:
        print(json.dumps(summary, indent=2))
    else:
        _print_summary(summary, report)
    if summary["mission"] != "completed":
        raise RunError(f"mission aborted: {summary['reason']}")


def _own_clock(vehicle: str, truth_url: str) -> str:
    """Who keeps a clock of his own, which rules out lockstep; an empty text for nobody."""
    return "MAVSDK" if vehicle == "mavsdk" else "an external simulator" if truth_url else ""


def _factor(speed: str | None, own_clock: str, *, clock: bool = False) -> float | None:
    """Multiple of real time, None for lockstep; `clock`: the scenario makes sense by the clock only."""
    if clock and speed in {None, "max"}:
        if speed == "max":
            raise InputError(
                "--speed max: faults of processes and of the ground link need the clock: --speed 1"
            )
        print("flightd: this scenario is flown in real time (--speed 1)", file=sys.stderr)
        return 1.0
    if speed is None:
        return 1.0 if own_clock else None
    try:
        factor = float(speed)
    except ValueError:
        factor = 0.0
    if own_clock and speed == "max":
        raise InputError(
            f"--speed max: {own_clock} keeps a clock of its own; leave --speed out for real time"
        )
    if own_clock == "MAVSDK" and factor != 1.0:
        raise InputError(f"--speed {speed}: MAVSDK keeps a clock of its own; it flies with --speed 1 only")
    if speed == "max":
        return None
    if not 0.05 <= factor <= 50:
        raise InputError(f"--speed {speed}: expected max, or a factor between 0.05 and 50")
    return factor


def _configured(
    path: Path | None,
    warehouse: str | None,
    vehicle: str | None,
    settings: Sequence[str],
    cameras: dict[str, Any],
) -> tuple[Any, Any]:
    """Configuration and site, with the command's own options laid over the file; `cameras` are the
    simulated cameras' keys, which hold unless a setting says otherwise."""
    from flightd.config.paths import shipped
    from flightd.config.schema import load_table, parse_config
    from flightd.sim.random_sites import random_site
    from flightd.site.site_file import load_site

    path = path or shipped("sim.toml")
    table = load_table(path)
    for key, value in cameras.items():
        _lay(table, key, value)
    if vehicle is not None:
        _lay(table, "vehicle.kind", vehicle)
    for setting in settings:
        key, equals, value = setting.partition("=")
        if not equals:
            raise InputError(f"--set {setting}: expected KEY=VALUE, for example mission.heading=shelf")
        _lay(table, key, _value(value))
    config = parse_config(table, path)
    if warehouse and warehouse.startswith("random:"):
        number = warehouse.removeprefix("random:")
        if not number.isdigit():
            raise InputError(f"--warehouse {warehouse}: expected random:SEED, for example random:7")
        return config, random_site(int(number))
    return config, load_site(Path(warehouse) if warehouse else config.mission.site)


def _lay(table: dict[str, Any], key: str, value: object) -> None:
    *sections, name = key.split(".")
    for section in sections:
        table = table.setdefault(section, {})
        if not isinstance(table, dict):
            raise InputError(f"--set {key}: {section} is not a section")
    table[name] = value


def _value(text: str) -> object:
    """A TOML value; bare words are text."""
    import tomllib

    try:
        return tomllib.loads(f"v = {text}")["v"]
    except tomllib.TOMLDecodeError:
        return text


def _camera_keys(scenario: Any) -> dict[str, Any]:
    """The calibration of the simulated cameras, as a configuration has it."""
    down, front = scenario.camera.camera(), scenario.front_camera.camera()
    return {
        **_calibration("camera", down),
        **_calibration("front_camera", front),
        "front_camera.exposure_s": front.exposure_s,
        "front_camera.fps": front.fps,
    }


def _calibration(section: str, camera: Any) -> dict[str, Any]:
    lens = camera.lens
    keys = {
        "width_px": lens.width_px,
        "height_px": lens.height_px,
        "fx_px": lens.fx_px,
        "fy_px": lens.fy_px,
        "cx_px": lens.cx_px,
        "cy_px": lens.cy_px,
        "distortion": lens.distortion,
        "latency_s": camera.capture_delay_s,
    }
    return {f"{section}.{key}": value for key, value in keys.items()}


def _make_folder(out: Path, *, going_on: bool) -> None:
    """An empty place for the results; the inventory of a count that goes on stays."""
    old = ["summary.json"]
    if not going_on:
        old += ["inventory.db", "inventory.db-wal", "inventory.db-shm"]
    try:
        out.mkdir(parents=True, exist_ok=True)
        for name in old:
            (out / name).unlink(missing_ok=True)
    except OSError as err:
        raise InputError(f"--out {out}: {err.strerror}; give a folder that can be written") from err


def _summary(simulation: Any, result: Any, wall_s: float) -> dict[str, Any]:
    from flightd.app.build import plan_of
    from flightd.core.topics import Topic
    from flightd.core.types import Event, Status
    from flightd.replay.log import read_log
    from flightd.sim.judge.flight_score import as_summary, score
    from flightd.sim.plant.kinematics import Kinematics

    flight = read_log(simulation.flight_log, {Topic.STATUS, Topic.EVENT})
    truth = read_log(simulation.truth_log, {Topic.TRUTH}).entries
    measured = score(
        simulation.scenario.floor.site(simulation.site),
        plan_of(simulation.config, simulation.site),
        flight.messages(Status),
        flight.messages(Event),
        # viewers' fields stand beside the truth's own
        [
            Kinematics(**{field.name: entry.message[field.name] for field in fields(Kinematics)})
            for entry in truth
            if isinstance(entry.message, dict)
        ],
    )
    return {
        **as_summary(measured),
        "frames": result.frames,
        "frames_dropped": result.frames_dropped,
        "latency_ms": result.latency_ms,
        "setpoint_interval_ms": result.setpoint_interval_ms,
        "wall_time_s": round(wall_s, 2),
        "seed": simulation.seed,
        "vehicle": simulation.config.vehicle.kind,
    }


def _write_truth(simulation: Any) -> None:
    """`truth-stock.json`, where there is stock."""
    from flightd.app.simulation.launch import truth_of
    from flightd.sim.racks.stock_truth import write_truth

    if truth := truth_of(simulation):
        write_truth(simulation.folder / "truth-stock.json", truth, simulation.seed)


def _write_inventory(out: Path, visited: Sequence[str]) -> None:
    """What was counted, or where nothing is counted, what was visited."""
    from flightd.app.simulation.stock_summary import inventory_csv

    path = out / "inventory.csv"
    if (data := inventory_csv(out)) is not None:
        path.write_bytes(data)
        return
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(["node", "visit", "code"])
        rows.writerows([node, i, ""] for i, node in enumerate(visited, start=1))


def _report(simulation: Any) -> Path:
    from flightd.cli.inventory_count import counted_beside
    from flightd.replay.report.page import write_report

    path: Path = simulation.folder / "report.html"
    write_report(simulation.flight_log, path, counted_beside(simulation.flight_log))
    return path


def _counted(summary: dict[str, Any]) -> str:
    codes = f"{summary['codes_read']} of {summary['codes_expected']} codes, {summary['codes_wrong']} wrong"
    empty = f"{summary['empty_right']} of {summary['empty_expected']} empty places"
    rate = summary["locations_per_hour"]
    visited = f"{summary['locations_visited']} of {summary['locations_planned']}"
    return f"{visited} ({rate:.0f} an hour): {codes}; {empty}"


def _print_summary(summary: dict[str, Any], report: Path) -> None:
    from rich.console import Console
    from rich.table import Table

    def metres(key: str) -> str:
        value = summary[key]
        return "-" if value is None else f"{value * 100:.1f} cm"

    table = Table(
        title=f"Mission {summary['mission']}: {summary['reason']}", show_header=False, title_justify="left"
    )
    simulated, wall = summary["flight_time_s"], summary["wall_time_s"]
    rows = [
        (
            "nodes visited",
            f"{summary['nodes_visited']} of {summary['nodes_planned']}, {summary['nodes_miscounted']} wrong",
        ),
        ("off the line, rms", metres("cross_track_rms_m")),
        ("hover error, p95", metres("hover_error_p95_m")),
        ("landing error", metres("landed_error_m")),
        ("flight time", f"{simulated:.0f} s in {wall:.0f} s ({simulated / max(wall, 1e-9):.1f} x)"),
        *([("locations", _counted(summary))] if summary.get("locations_planned") else []),
        ("frames", f"{summary['frames']}, {summary['frames_dropped']} dropped"),
        (
            "exposure to setpoint",
            f"{summary['latency_ms']['p50']:.0f} ms, p99 {summary['latency_ms']['p99']:.0f} ms",
        ),
        ("report", str(report)),
    ]
    for name, value in rows:
        table.add_row(name, value)
    Console(file=sys.stdout).print(table)
