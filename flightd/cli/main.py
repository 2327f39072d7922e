"""The `flightd` command: every subcommand hangs here."""

from __future__ import annotations

import typer

from flightd import __version__
from flightd.cli import calibrate, doctor, guide, inventory, keygen, log, replay, report, run, sim, vision
from flightd.cli import map as site_map
from flightd.cli.exits import run_app

app = typer.Typer(
    no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None
)
vision.register(app)
sim.register(app)
calibrate.register(app)
run.register(app)
doctor.register(app)
report.register(app)
replay.register(app)
log.register(app)
keygen.register(app)
site_map.register(app)
inventory.register(app)
guide.register(app)


def _version(wanted: bool) -> None:
    if wanted:
        print(f"flightd {__version__}")
        raise typer.Exit


@app.callback()
def flightd(
    version: bool = typer.Option(
        False, "--version", callback=_version, is_eager=True, help="Print the version."
    ),
) -> None:
    """Fly a camera drone along the painted guide lines of a warehouse floor."""


def main() -> None:
    """Entry point of the `flightd` script."""
    run_app(app, "flightd")
