"""`flightd doctor`: is this machine, link, camera and autopilot fit to fly?"""

from __future__ import annotations

import asyncio
import json
import sys
from typing import TYPE_CHECKING, Annotated

import typer

from flightd.cli.options import AsJson, ConfigFile
from flightd.core.errors import InputError, RunError

if TYPE_CHECKING:
    from pathlib import Path

    from flightd.config.schema import Config
    from flightd.doctor.diagnosis import Diagnosis

LEAST_ROCK_S, MOST_ROCK_S = 5.0, 120.0
_COLOURS = {
    "ok": typer.colors.GREEN,
    "warning": typer.colors.YELLOW,
    "error": typer.colors.RED,
    "unseen": typer.colors.BLUE,
}


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("doctor")(doctor)


def doctor(
    config: ConfigFile,
    fix: Annotated[bool, typer.Option("--fix", help="Offer to set wrong parameters right.")] = False,
    yes: Annotated[bool, typer.Option("--yes", help="With --fix: do not ask.")] = False,
    quick: Annotated[
        bool,
        typer.Option("--quick", help="Without camera and vehicle, in a second: before a service starts."),
    ] = False,
    rock: Annotated[
        float,
        typer.Option(
            help="Measure the camera's delay: so many seconds in which you rock the drone, propellers off.",
            show_default=False,
        ),
    ] = 0.0,
    as_json: AsJson = False,
) -> None:
    """Say whether configuration, computer, camera and vehicle are fit to fly, and what to do if not.

    Nothing moves: the vehicle is neither armed nor given a setpoint.  Exit 1 when it is not fit to fly.

    \b
    Examples:
      flightd doctor --config /etc/flightd/flightd.toml
      flightd doctor --config configs/ardupilot.toml --fix
      flightd doctor --config configs/ardupilot.toml --json | jq .parameters
      flightd doctor --config configs/ardupilot.toml --rock 20
    """
    from flightd.config.schema import load_config

    if quick and rock:
        raise InputError("--quick looks at no vehicle: it does not go with --rock")
    if rock and not LEAST_ROCK_S <= rock <= MOST_ROCK_S:
        raise InputError(f"--rock {rock:g}: expected {LEAST_ROCK_S:g} to {MOST_ROCK_S:g} seconds")
    if quick and fix:
        raise InputError("--quick looks at no vehicle: it does not go with --fix")
    if fix and not yes and not sys.stdin.isatty():
        raise InputError(
            "--fix asks before it writes, and there is no terminal to ask on", remedy="add --yes"
        )
    chosen = load_config(config)
    if fix and chosen.vehicle.kind == "ardrone":
        raise InputError("--fix is for autopilots with parameters; an AR.Drone is set up at each start")
    found = asyncio.run(_examined(chosen, config, rock, quick=quick))
    if fix and (agreed := _agreed(found, ask=not yes)):
        found = asyncio.run(_fixed(found, chosen, agreed))
    if as_json:
        print(json.dumps(found.document(config)))
    else:
        _print(found, "no error found" if quick else "fit to fly")
    if found.errors:
        raise RunError(f"not fit to fly: {found.errors} {'error' if found.errors == 1 else 'errors'}")


async def _examined(config: Config, path: Path, rock_s: float, *, quick: bool) -> Diagnosis:
    """Composed as for a flight: InputError where configuration and site are not sound."""
    from flightd.adapters.vehicle.connect import connect_vehicle
    from flightd.app.build import detector_of, ground_link, interlock_of, pilot_of, plan_of
    from flightd.doctor.diagnosis import Subject, examine, examine_quickly, measure_delay
    from flightd.runtime.clock import LoopClock
    from flightd.site.site_file import load_site

    site, clock = load_site(config.mission.site), LoopClock()
    pilot_of(config, site)
    interlock_of(config, site, clock)
    connect_vehicle(config.vehicle, clock, config.control, battery=config.battery)
    detector = detector_of(config, site)()
    subject = Subject(
        config,
        site,
        path,
        plan_of(config, site).nodes,
        detector,
        ground_link(config.ground, site, clock),
        clock,
    )
    found = await (examine_quickly if quick else examine)(subject)
    return await measure_delay(found, subject, rock_s, _say) if rock_s else found


def _say(line: str) -> None:
    print(f"flightd: {line}", file=sys.stderr, flush=True)


async def _fixed(found: Diagnosis, config: Config, agreed: list[str]) -> Diagnosis:
    from flightd.doctor.diagnosis import fix_parameters
    from flightd.runtime.clock import LoopClock

    return await fix_parameters(found, config, agreed, LoopClock())


def _agreed(found: Diagnosis, *, ask: bool) -> list[str]:
    """Names of the parameters that may be written."""
    names = [parameter.name for parameter in found.mendable]
    if not names or not ask:
        return names
    for parameter in found.mendable:
        change = f"{parameter.name:<16} {parameter.value:g} -> {parameter.better:g}"
        print(f"  {change}   {parameter.reason}", file=sys.stderr)
    number = "this parameter" if len(names) == 1 else f"these {len(names)} parameters"
    print(f"Write {number} to the autopilot? [y/N] ", end="", file=sys.stderr, flush=True)
    if sys.stdin.readline().strip().lower() in {"y", "yes"}:
        return names
    print("nothing was written", file=sys.stderr)
    return []


def _print(found: Diagnosis, verdict: str) -> None:
    for check in found.checks:
        word = "ok" if check.level == "ok" else check.level.upper()
        label = typer.style(f"{word:<8}", _COLOURS[check.level])
        typer.echo(f"{label}{check.name:<12} {check.text}")
        if check.remedy:
            typer.echo(f"{'':<16} -> {check.remedy}")
    if found.report is not None and found.report.unread:
        typer.echo(f"{'':<16} not known to this firmware: {', '.join(found.report.unread)}")
    if not found.errors:
        typer.echo(verdict)
