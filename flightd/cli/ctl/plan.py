"""`flightctl plan`: the nodes and shelf levels of the next flight."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated, Any

import msgspec
import typer

from flightd.cli.ctl.connection import DaemonConnection
from flightd.cli.options import AsJson
from flightd.cli.planned_flight import planned_in_words
from flightd.core.errors import InputError

if TYPE_CHECKING:
    from flightd.adapters.ground_link.client import GroundClient
    from flightd.adapters.ground_link.messages.answers import PlanAnswer, Planned


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("plan")(plan)


def plan(
    context: typer.Context,
    nodes: Annotated[
        list[str] | None, typer.Argument(help="Nodes of the map, as A4 A5; none: show it.")
    ] = None,
    level: Annotated[
        list[int] | None, typer.Option(min=1, max=99, help="Count this shelf level; again for more.")
    ] = None,
    best: Annotated[bool, typer.Option("--best", help="In the quickest order, not as listed.")] = False,
    dry: Annotated[bool, typer.Option("--dry", help="Only say what the flight would be.")] = False,
    configured: Annotated[
        bool, typer.Option("--configured", help="Fly again what the drone's configuration says.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Show what the drone flies and what is left of it, or hand it the nodes that its next start flies.

    It must stand disarmed and be given no start yet; it checks the nodes by its own map and battery, and does
    not start by that.

    \b
    Examples:
      flightctl plan
      flightctl plan A4 A5 --level 1 --dry
      flightctl plan A4 A5 B2 --best
      flightctl plan --configured
    """
    if configured and nodes:
        raise InputError("nodes, or what the configuration says", key="--configured")
    changes = bool(nodes) or configured
    if not changes and (level or best or dry):
        raise InputError("name the nodes", key="plan")

    async def ask(client: GroundClient) -> Any:
        await client.hello()
        if not changes:
            return await client.plan()
        return await client.plan_flight(nodes or (), level or (), best_order=best, dry=dry)

    link: DaemonConnection = context.obj
    answer = link.ask(ask)
    if as_json:
        print(json.dumps(msgspec.to_builtins(answer)))
        return
    print("\n".join(_planned(answer) if changes else _standing(answer)))


def _planned(plan: Planned) -> list[str]:
    taken = "only asked for" if plan.dry else "taken; start it with: flightctl start"
    return [*planned_in_words(plan), taken]


def _standing(plan: PlanAnswer) -> list[str]:
    left = f"left: {' '.join(plan.remaining)}" if plan.remaining else "nothing left"
    levels = f"level {', '.join(map(str, plan.levels))}" if plan.levels else "all levels"
    levels = levels if plan.counts is None else "at each node what was told for it"
    return [" ".join(plan.nodes), levels, f"{len(plan.visited)} visited, {left}"]
