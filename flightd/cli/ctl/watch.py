"""`flightctl watch`: the flight on a full screen of the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from flightd.cli.ctl.connection import DaemonConnection

if TYPE_CHECKING:
    from flightd.adapters.ground_link.client import GroundClient


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("watch")(watch)


def watch(
    context: typer.Context,
    attend: Annotated[
        bool, typer.Option(help="Tell the daemon that somebody watches: it notices when the link is lost.")
    ] = True,
) -> None:
    """Watch the flight in the terminal, full screen: map, state, link, events; keys to pause, land, stop.

    \b
    Examples:
      flightctl watch
      flightctl watch --no-attend
    """
    try:
        from flightd.cli.watch.screen import WatchApp
    except ModuleNotFoundError:
        from flightd.core.extras import missing_extra

        raise missing_extra("ground", "flightctl watch") from None

    async def show(client: GroundClient) -> None:
        await WatchApp(client, await client.hello(), attend).run_async()

    link: DaemonConnection = context.obj
    link.ask(show)
