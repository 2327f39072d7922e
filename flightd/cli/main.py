"""The `flightd` command: every subcommand hangs here."""

from __future__ import annotations

from typing import Annotated

from flightd.cli import (
    bench,
    calibrate,
    codes,
    detect,
    doctor,
    evaluate,
    fleet,
    ground,
    guide,
    inventory,
    keygen,
    log,
    plan,
    replay,
    report,
    run,
    sim,
    store,
    study,
    train_colour,
)
from flightd.cli import map as site_map
from flightd.cli.application import application, keep_blocks, version_option
from flightd.cli.exits import run_app

app = application("flightd")
for command in (
    detect, evaluate, codes, bench, train_colour, sim, calibrate, plan, run, ground, fleet, doctor, report,
    replay, study, log, keygen, site_map, inventory, store, guide,
):  # fmt: skip
    command.register(app)


@app.callback()
def flightd(_version: Annotated[bool, version_option("flightd")] = False) -> None:
    """Fly a camera drone along the painted guide lines of a warehouse floor.

    \b
    Examples:
      flightd sim
      flightd doctor --config configs/ardupilot.toml
      flightd run --config configs/ardupilot.toml
    """


keep_blocks(app)


def main() -> None:
    """Entry point of the `flightd` script."""
    run_app(app, "flightd")
