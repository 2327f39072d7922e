"""The `flightctl` command: every subcommand hangs here."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from flightd.cli.application import application, keep_blocks, version_option
from flightd.cli.ctl import inventory, keygen, maintenance, orders, picture, plan, protocol, status, watch
from flightd.cli.ctl.connection import DaemonConnection
from flightd.cli.exits import run_app

app = application("flightctl")
for command in (status, orders, plan, inventory, maintenance, picture, keygen, protocol, watch):
    command.register(app)


@app.callback()
def flightctl(
    context: typer.Context,
    host: Annotated[
        str, typer.Option(envvar="FLIGHTCTL_HOST", help="Where flightd listens: a name or an address.")
    ] = "127.0.0.1",
    status_port: Annotated[int, typer.Option(envvar="FLIGHTCTL_STATUS_PORT", help="Its status port.")] = 5571,
    command_port: Annotated[
        int, typer.Option(envvar="FLIGHTCTL_COMMAND_PORT", help="Its command port.")
    ] = 5572,
    key: Annotated[
        Path | None, typer.Option(envvar="FLIGHTCTL_KEY", help="Your secret key: NAME.key_secret.")
    ] = None,
    server_key: Annotated[
        Path | None, typer.Option(envvar="FLIGHTCTL_SERVER_KEY", help="The daemon's public key: NAME.key.")
    ] = None,
    timeout: Annotated[float, typer.Option(help="Seconds to wait for an answer.", min=0.1, max=60)] = 3.0,
    _version: Annotated[bool, version_option("flightctl")] = False,
) -> None:
    """Watch and command a running flightd.

    Each option before the command may also come from the environment: FLIGHTCTL_HOST, FLIGHTCTL_KEY ...

    \b
    Examples:
      flightctl status
      flightctl --host drone-1 --key ann.key_secret --server-key drone-1.key watch
    """
    context.obj = DaemonConnection(host, status_port, command_port, key, server_key, timeout)


keep_blocks(app)


def main() -> None:
    """Entry point of the `flightctl` script."""
    run_app(app, "flightctl")
