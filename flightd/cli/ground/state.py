"""Where a ground station keeps its people and its audit, the same for all its commands."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, TypeAlias

import typer

State: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        metavar="DIR",
        envvar="FLIGHTD_GROUND_STATE",
        help="Where the station keeps its people and its audit.  Default: flightd-ground in the user's"
        " folder for state ($XDG_STATE_HOME, or ~/.local/state).",
        show_default=False,
    ),
]


def state_folder(given: Path | None) -> Path:
    """The folder, which need not be there yet."""
    if given is not None:
        return given.absolute()
    home = os.environ.get("XDG_STATE_HOME") or str(Path.home() / ".local" / "state")
    return Path(home) / "flightd-ground"
