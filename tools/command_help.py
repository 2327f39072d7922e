"""What `--help` says of each command, as Markdown."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import typer
import typer.main

_WIDTH = 100


def help_pages(app: typer.Typer, name: str) -> Iterator[str]:
    """The help of `name` itself, then of each of its commands, depth first."""
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
