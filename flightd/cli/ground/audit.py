"""`flightd ground audit`: who did what at the ground station."""

from __future__ import annotations

import json
from typing import Annotated, Any

import typer

from flightd.cli.ground.state import State, state_folder
from flightd.cli.options import AsJson
from flightd.core.terminal_text import visible


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("audit")(audit)


def audit(
    last: Annotated[int, typer.Option(metavar="N", min=1, max=1_000_000, help="So many lines.")] = 50,
    person: Annotated[str, typer.Option(metavar="NAME", help="Of this person alone.")] = "",
    state: State = None,
    as_json: AsJson = False,
) -> None:
    """Show the newest acts with their person, oldest first: orders, decisions, sign-ins, refusals.

    \b
    Examples:
      flightd ground audit
      flightd ground audit --person ann --last 200
    """
    from flightd.ground.access.audit import newest_entries

    entries = newest_entries(state_folder(state), last, person)
    if as_json:
        print(json.dumps({"entries": entries}))
        return
    for entry in entries:
        print(_line(entry))
    if not entries:
        print("nothing yet")


def _line(entry: dict[str, Any]) -> str:
    def field(name: str) -> str:
        return visible(str(entry.get(name, "")))

    who = field("person") or "nobody"
    what = f"{field('act')} {field('target')}".strip()
    text = field("text")
    outcome = f"{field('outcome')}: {text}" if text else field("outcome")
    return f"{field('time')}  {who} ({field('role') or '-'}, {field('address')})  {what}  {outcome}"
