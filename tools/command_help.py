"""What `--help` says of each command, as Markdown."""

from __future__ import annotations

import importlib
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import typer
import typer.main

_WIDTH = 100


def scripts(pyproject: Path) -> dict[str, tuple[str, str]]:
    """The commands that the package installs: module and function of each."""
    found = tomllib.loads(pyproject.read_text(encoding="utf-8"))["project"]["scripts"]
    return {name: (target.split(":")[0], target.split(":")[1]) for name, target in found.items()}


def help_pages(pyproject: Path) -> Iterator[str]:
    """The help of each command that is installed, then of each command in it, depth first."""
    for name, (module, _) in scripts(pyproject).items():
        app: typer.Typer = importlib.import_module(module).app
        yield from _help_of(typer.main.get_command(app), name, None, 2)


def _help_of(command: Any, name: str, parent: Any, depth: int) -> Iterator[str]:
    context = command.context_class(
        command, info_name=name, parent=parent, terminal_width=_WIDTH, max_content_width=_WIDTH
    )
    text = "\n".join(line.rstrip() for line in command.get_help(context).strip().splitlines())
    path = context.command_path
    yield f"{'#' * min(depth, 4)} `{path}`\n\n```text\n{text}\n```\n"
    for inner in getattr(command, "commands", {}).values():
        if not inner.hidden:
            yield from _help_of(inner, inner.name, context, depth + 1)
