"""`flightd ground`: the ground station in the browser, its people and its audit."""

from __future__ import annotations

import typer

from flightd.cli.ground import audit, keys, people, serve


def register(app: typer.Typer) -> None:
    """Hang `ground` under `app`: alone it serves, and it has commands for who may come in."""
    commands = typer.Typer(
        invoke_without_command=True, no_args_is_help=False, rich_markup_mode=None, epilog=serve.EXAMPLES
    )
    commands.callback()(serve.ground)
    for command in (people, keys, audit):
        command.register(commands)
    app.add_typer(commands, name="ground")
