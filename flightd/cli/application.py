"""The frame of both command lines, flightd's and flightctl's: help, version, completion, Ctrl-C."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import typer
from typer.core import TyperGroup

from flightd import __version__

COMPLETION = """Tab completes commands and options after:

  {name} --install-completion     once, for the shell that you use (bash, zsh, fish)
  {name} --show-completion        to look at what it would add
"""


class InterruptedByUserError(Exception):
    """Ctrl-C: says so even where the command line would take it for an ordinary exit."""


class CommandGroup(TyperGroup):
    """Commands of which each may be interrupted."""

    def make_context(self, *arguments: Any, **options: Any) -> Any:
        with _interruptible():
            return super().make_context(*arguments, **options)

    def invoke(self, ctx: Any) -> Any:
        with _interruptible():
            return super().invoke(ctx)


@contextmanager
def _interruptible() -> Iterator[None]:
    try:
        yield
    except KeyboardInterrupt:
        raise InterruptedByUserError from None


def application(name: str) -> typer.Typer:
    """An empty command line: -h and --help everywhere, --install-completion, plain text."""
    return typer.Typer(
        cls=CommandGroup,
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
        context_settings={"help_option_names": ["-h", "--help"]},
        epilog=COMPLETION.format(name=name),
    )


def group(examples: str) -> typer.Typer:
    """Commands that belong together, as `flightd log`; `examples` has one on each line."""
    lines = "\n".join(f"  {line}" for line in examples.splitlines())
    return typer.Typer(no_args_is_help=True, rich_markup_mode=None, epilog=f"Examples:\n{lines}")


def keep_blocks(app: typer.Typer) -> None:
    """Let the paragraphs of every epilog below `app` stand as they were written, line by line."""
    if isinstance(app.info.epilog, str):
        app.info.epilog = _as_written(app.info.epilog)
    for command in app.registered_commands:
        if command.epilog:
            command.epilog = _as_written(command.epilog)
    for sub in app.registered_groups:
        if sub.typer_instance is not None:
            keep_blocks(sub.typer_instance)


def _as_written(text: str) -> str:
    blocks = text.strip("\n").split("\n\n")
    return "\n\n".join(block if block.startswith("\b") else f"\b\n{block}" for block in blocks)


def version_option(name: str) -> Any:
    """The `--version` option of the command line `name`."""

    def tell(wanted: bool) -> None:
        if wanted:
            print(f"{name} {__version__}")
            raise typer.Exit

    return typer.Option("--version", callback=tell, is_eager=True, help="Print the version.")
