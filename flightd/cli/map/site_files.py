"""What the commands on site files have in common."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, TypeAlias

import typer

from flightd.core.errors import InputError, cannot_write

SiteFile: TypeAlias = Annotated[Path, typer.Argument(metavar="SITE", help="Site file, TOML.")]
Force: TypeAlias = Annotated[bool, typer.Option("--force", help="Overwrite a file that is there.")]


def write_new(path: Path, text: str, force: bool) -> None:
    """Write a file that is not there yet, or with `force` over what is.  InputError when it cannot be."""
    try:
        with path.open("w" if force else "x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise InputError("there already", file=path, remedy="choose another name or add --force") from None
    except OSError as err:
        raise cannot_write(path, err) from None
