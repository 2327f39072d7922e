"""`flightd run`: the daemon."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import sys
from pathlib import Path
from typing import Annotated

import typer

from flightd.core.errors import InputError, RunError, UnavailableError

EXAMPLES = """Examples:

  flightd run --config /etc/flightd/flightd.toml
  flightd run --config configs/ardupilot.toml
  flightd run --config configs/ardupilot.toml --resume     after a battery swap that cut its power
"""


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("run", epilog=EXAMPLES)(run)


def run(
    config: Annotated[Path, typer.Option(help="Configuration file.")],
    resume: Annotated[
        bool,
        typer.Option("--resume", help="Fly the stops that the last flight left over (mission.progress)."),
    ] = False,
) -> None:
    """Fly the configured mission on a real vehicle, or on any peer that speaks like one.

    SIGINT and SIGTERM hand the vehicle back at once (exit 130 and 143).  Started while its vehicle flies,
    it keeps it level, reports, and lands.  Started anew by systemd it never starts a flight by itself.
    """
    from flightd.adapters.store.settings_file import SettingsFile
    from flightd.app.run import RestartAsked, prepare, run_until_signal
    from flightd.cli.flight_progress import FlightProgress
    from flightd.config.schema import load_config
    from flightd.core.types import Phase

    taken_back = ""
    with contextlib.suppress(InputError, UnavailableError):  # whatever stands there is flown by, or refused
        taken_back = SettingsFile(config).begin()
    if taken_back:
        print(f"flightd: {taken_back}", file=sys.stderr)
    flight = prepare(load_config(config), config, resume=resume, taken_back=taken_back)
    with FlightProgress(shown=not flight.journal) as progress:
        result = asyncio.run(run_until_signal(flight, progress))
    if isinstance(result, signal.Signals):
        print(f"flightd: stopped by {result.name}; the vehicle was handed back", file=sys.stderr)
        raise typer.Exit(128 + result)
    if isinstance(result, RestartAsked):
        print("flightd: ends, to be started anew as the ground asked", file=sys.stderr)
        return
    print(f"{result.reason}; {result.nodes_done} of {result.nodes_planned} nodes visited", file=sys.stderr)
    if result.phase is not Phase.DONE:
        raise RunError(f"mission {result.phase}: {result.reason}")
