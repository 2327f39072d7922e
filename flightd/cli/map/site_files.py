"""What the commands on site files have in common."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, TypeAlias

import typer

from flightd.core.errors import InputError, cannot_write

SiteFile: TypeAlias = Annotated[Path, typer.Argument(metavar="SITE", help="Site file, TOML.")]
Force: TypeAlias = Annotated[bool, typer.Option("--force", help="Overwrite a file that is there.")]


def demand_new(paths: Sequence[Path], force: bool) -> None:
    """InputError where one of several files, none of them written yet, is there already, or two are the same:
    a command that writes the first one and then fails leaves half a result."""
    for number, path in enumerate(paths):
        if path.resolve() in {before.resolve() for before in paths[:number]}:
            raise InputError("would be written twice", file=path, remedy="choose a name that ends otherwise")
        if path.is_dir():
            raise InputError("cannot write: it is a folder", file=path)
        if os.path.lexists(path) and not force:
            raise _there_already(path)


def write_new(path: Path, text: str, force: bool) -> None:
    """Write a file that is not there yet, or with `force` over what is.  InputError when it cannot be."""
    try:
        with path.open("w" if force else "x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise _there_already(path) from None
    except OSError as err:
        raise cannot_write(path, err) from None


def _there_already(path: Path) -> InputError:
    return InputError("there already", file=path, remedy="choose another name or add --force")
