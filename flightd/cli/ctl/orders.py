"""`flightctl start`, `pause`, `resume`, `goto`, `home`, `land`, `stop`: the orders to a flight."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from flightd.cli.ctl.connection import DaemonConnection
from flightd.cli.options import AsJson

if TYPE_CHECKING:
    from flightd.adapters.ground_link.client import GroundClient

_ORDERS: Final = {
    "start": "Start the mission that waits in preflight, after a count-down; refused unless it is ready.",
    "pause": "Hold the position until `resume`; before a flight, take a start back that counts down.",
    "resume": "Go on after `pause`.",
    "home": "Fly home along the lines and land on the pad.",
    "land": "Land here and now.",
    "stop": "End the mission: down at once, wherever it is.",
}


def register(app: typer.Typer) -> None:
    """Hang the orders under `app`."""
    for kind, text in _ORDERS.items():
        _add(app, kind, text)
    app.command("goto")(goto)


def _add(app: typer.Typer, kind: str, text: str) -> None:
    def order(context: typer.Context, as_json: AsJson = False) -> None:
        _give(context.obj, kind, "", as_json)

    app.command(kind, help=f"{text}\n\n\b\nExamples:\n  flightctl {kind}\n  flightctl {kind} --json")(order)


def goto(
    context: typer.Context,
    node: Annotated[str, typer.Argument(help="A node of the map, like A4.")],
    as_json: AsJson = False,
) -> None:
    """Fly to a node along the lines, then home.

    \b
    Examples:
      flightctl goto B3
    """
    _give(context.obj, "goto", node, as_json)


def _give(link: DaemonConnection, kind: str, node: str, as_json: bool) -> None:
    from flightd.adapters.ground_link.protocol import encode
    from flightd.core.types import CommandKind

    async def order(client: GroundClient) -> Any:
        await client.hello()
        return await client.order(CommandKind(kind), node)

    accepted = link.ask(order)
    print(encode(accepted).decode() if as_json else f"{kind} {node}".strip() + ": accepted")
