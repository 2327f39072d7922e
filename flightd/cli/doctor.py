"""`flightd doctor`: is this machine, link, camera and autopilot fit to fly?"""

from __future__ import annotations

import asyncio
import json
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flightd.core.errors import InputError, RunError, UnavailableError

if TYPE_CHECKING:
    from flightd.adapters.vehicle.mavlink.examination import ExaminationReport
    from flightd.adapters.vehicle.mavlink.required_parameters import ParameterFinding
    from flightd.config.schema import Config
    from flightd.doctor.check import Check
    from flightd.doctor.vehicle import Autopilot
    from flightd.ports import Clock
    from flightd.site.site import Site

_COLOURS = {"ok": typer.colors.GREEN, "warning": typer.colors.YELLOW, "error": typer.colors.RED}


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """Everything that was looked at; `report` and `fixed` are those of a MAVLink autopilot."""

    checks: list[Check]
    report: ExaminationReport | None = None
    fixed: tuple[str, ...] = ()

    @property
    def errors(self) -> int:
        return sum(check.level == "error" for check in self.checks)


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("doctor")(doctor)


def doctor(
    config: Annotated[Path, typer.Option(help="Configuration file.")],
    fix: Annotated[bool, typer.Option("--fix", help="Offer to set wrong parameters right.")] = False,
    yes: Annotated[bool, typer.Option("--yes", help="With --fix: do not ask.")] = False,
    quick: Annotated[
        bool,
        typer.Option("--quick", help="Without camera and vehicle, in a second: before a service starts."),
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON document.")] = False,
) -> None:
    """Say whether configuration, computer, camera and vehicle are fit to fly, and what to do if not.

    Nothing moves: the vehicle is neither armed nor given a setpoint.  Exit 1 when it is not fit to fly.

    \b
    flightd doctor --config /etc/flightd/flightd.toml
    flightd doctor --config configs/ardupilot.toml --fix
    flightd doctor --config configs/ardupilot.toml --json | jq .parameters
    """
    from flightd.config.schema import load_config
    from flightd.site.site_file import load_site

    if quick and fix:
        raise InputError("--quick looks at no vehicle: it does not go with --fix")
    if fix and not yes and not sys.stdin.isatty():
        raise InputError("--fix asks before it writes, and there is no terminal to ask on: add --yes")
    chosen = load_config(config)
    if fix and chosen.vehicle.kind == "ardrone":
        raise InputError("--fix is for autopilots with parameters; an AR.Drone is set up at each start")
    site = load_site(chosen.mission.site)
    examine = _examine_machine if quick else _examine
    found = asyncio.run(examine(chosen, site, config))
    if fix and found.report is not None:
        agreed = _agreed(found.report, ask=not yes)
        if agreed:
            found = _with_autopilot(found, asyncio.run(_fix(chosen, agreed)))
    print(json.dumps(_document(config, found))) if as_json else _print(
        found, "no error found" if quick else "fit to fly"
    )
    if found.errors:
        raise RunError(f"not fit to fly: {found.errors} {'error' if found.errors == 1 else 'errors'}")


async def _examine(config: Config, site: Site, path: Path) -> Diagnosis:
    from flightd.adapters.vehicle.ardrone.vehicle import ArDroneVehicle
    from flightd.adapters.vehicle.connect import connect_vehicle
    from flightd.app.build import detector_of
    from flightd.doctor import camera, machine, vehicle
    from flightd.doctor.calibration import check_calibration
    from flightd.runtime.clock import LoopClock

    clock = LoopClock()
    detector = detector_of(config, site)()
    checks = [
        _check_plan(config, site, path),
        machine.check_clock(),
        machine.check_disk(config.recorder),
        *machine.check_processor(config.vision.workers),
        *check_calibration(config.camera, site, config.mission.height_m),
    ]
    autopilot = vehicle.Autopilot(())
    if config.vehicle.kind == "ardrone":
        drone = connect_vehicle(config.vehicle, clock, config.control)
        assert isinstance(drone, ArDroneVehicle)
        flying = asyncio.ensure_future(drone.run())
        try:
            checks += await vehicle.examine_ardrone(drone, config)
            pictures = await camera.watch(config, clock, drone)
        finally:
            flying.cancel()
            await asyncio.wait([flying])
    else:
        pictures = await camera.watch(config, clock, None)
        autopilot = await vehicle.examine(config.vehicle, clock)
    checks += _check_ground(config, site, clock)
    checks += camera.judge_camera(config, pictures)
    checks += camera.check_vision(config, detector, pictures.picture)
    checks += camera.check_latency(config, detector, pictures)
    return Diagnosis([*checks, *autopilot.checks], autopilot.report)


async def _examine_machine(config: Config, site: Site, path: Path) -> Diagnosis:
    """What can be known without waiting for anything."""
    from flightd.app.build import detector_of, pilot_of
    from flightd.doctor import machine
    from flightd.runtime.clock import LoopClock

    detector_of(config, site)()
    pilot_of(config, site)
    checks = [
        _check_plan(config, site, path),
        machine.check_clock(),
        machine.check_disk(config.recorder),
        *machine.check_processor(config.vision.workers),
        *_check_ground(config, site, LoopClock()),
    ]
    return Diagnosis(checks)


def _check_plan(config: Config, site: Site, path: Path) -> Check:
    """Configuration and site are sound, or InputError would have been raised: say what they mean."""
    from flightd.app.build import plan_of
    from flightd.doctor.check import ok

    nodes = len(config.mission.nodes) or len(site.nodes)
    plan_of(config, site)
    return ok("config", f"{path}: site {site.name}, {nodes} nodes to visit at {config.mission.height_m:g} m")


def _check_ground(config: Config, site: Site, clock: Clock) -> list[Check]:
    """Keys and allow-list are read (InputError if they are wrong), the ports are listened on for a moment."""
    from flightd.app.build import ground_link
    from flightd.doctor.check import error, ok

    ground = config.ground
    link = ground_link(config, site, clock)
    if link is None:
        return []
    try:
        with link:
            text = f"{ground.listen}, ports {ground.status_port} and {ground.command_port}"
            keys = "with keys" if ground.server_key else "without keys, this machine only"
            return [ok("ground", f"can listen on {text}, {keys}")]
    except UnavailableError as err:
        return [error("ground", str(err), "stop what has the port (another flightd?), or choose another")]


async def _fix(config: Config, agreed: list[str]) -> Autopilot:
    from flightd.doctor.vehicle import examine
    from flightd.runtime.clock import LoopClock

    return await examine(config.vehicle, LoopClock(), agreed)


def _with_autopilot(found: Diagnosis, autopilot: Autopilot) -> Diagnosis:
    """The diagnosis with what is now known of the autopilot."""
    rest = [check for check in found.checks if check.name not in {"vehicle", "parameter"}]
    return Diagnosis([*rest, *autopilot.checks], autopilot.report, autopilot.fixed)


def _agreed(report: ExaminationReport, *, ask: bool) -> list[str]:
    """Names of the parameters that may be written."""
    mendable = [found for found in report.findings if found.better is not None]
    if not mendable or report.armed:
        return []
    if not ask:
        return [found.name for found in mendable]
    for found in mendable:
        print(f"  {_change(found)}   {found.reason}", file=sys.stderr)
    number = "this parameter" if len(mendable) == 1 else f"these {len(mendable)} parameters"
    print(f"Write {number} to the autopilot? [y/N] ", end="", file=sys.stderr, flush=True)
    if sys.stdin.readline().strip().lower() not in {"y", "yes"}:
        print("nothing was written", file=sys.stderr)
        return []
    return [found.name for found in mendable]


def _change(found: ParameterFinding) -> str:
    return f"{found.name:<16} {found.value:g} -> {found.better:g}"


def _print(found: Diagnosis, verdict: str) -> None:
    for check in found.checks:
        label = typer.style(
            f"{check.level.upper() if check.level != 'ok' else 'ok':<8}", _COLOURS[check.level]
        )
        typer.echo(f"{label}{check.name:<12} {check.text}")
        if check.remedy:
            typer.echo(f"{'':<16} -> {check.remedy}")
    if found.report is not None and found.report.unread:
        typer.echo(f"{'':<16} not known to this firmware: {', '.join(found.report.unread)}")
    if not found.errors:
        typer.echo(verdict)


def _document(path: Path, found: Diagnosis) -> dict[str, Any]:
    report = found.report
    return {
        "config": str(path),
        "fit": found.errors == 0,
        "checks": [asdict(check) for check in found.checks],
        "autopilot": report
        and {
            "firmware": report.firmware.name.lower(),
            "version": report.version,
            "armed": report.armed,
            "unread": report.unread,
        },
        "parameters": [asdict(finding) for finding in report.findings] if report else [],
        "fixed": found.fixed,
    }
