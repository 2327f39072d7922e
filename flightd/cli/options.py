"""Options and arguments that many commands share."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Final, TypeAlias

import typer

from flightd.core.errors import InputError

AsJson: TypeAlias = Annotated[
    bool, typer.Option("--json", help="Print one JSON document on stdout and nothing else.")
]
Log: TypeAlias = Annotated[Path, typer.Argument(metavar="LOG", help="A flight log (flight.mcap).")]
Pictures: TypeAlias = Annotated[
    list[Path], typer.Argument(metavar="PATH…", help="Images, folders of them, and videos.")
]
ConfigFile: TypeAlias = Annotated[Path, typer.Option("--config", help="Configuration file.")]

METHODS: Final = ("naive", "centroid", "skeleton", "combined")
PROFILE_HELP: Final = (
    "Colour profile: yellow, white, red, blue, green, black, orange, or a file of `flightd train-colour`."
)


def check_methods(methods: Sequence[str]) -> None:
    """InputError for a method that there is not."""
    for method in methods:
        if method not in METHODS:
            raise InputError(
                "unknown", key=f"--method {method}", remedy=f"choose one of {', '.join(METHODS)}"
            )
