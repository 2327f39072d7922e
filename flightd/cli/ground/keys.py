"""`flightd ground keys`: keys with scopes, for programs that ask the ground store."""

from __future__ import annotations

import json
import sys
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Annotated

import typer

from flightd.cli.application import group
from flightd.cli.ground.state import State, state_folder
from flightd.cli.options import AsJson

if TYPE_CHECKING:
    from pathlib import Path

    from flightd.ground.access.key_book import KeyBook

Name = Annotated[str, typer.Argument(metavar="NAME", help="Of the program.")]


def register(app: typer.Typer) -> None:
    """Hang `keys` with its commands under `app`."""
    commands = group(
        "flightd ground keys make wms --scope stock --scope pictures\n"
        "flightd ground keys make drone-1 --scope deliver\n"
        "flightd ground keys revoke wms"
    )
    for name, command in (("make", make), ("list", listed), ("revoke", revoke)):
        commands.command(name)(command)
    app.add_typer(commands, name="keys", help="Programs that ask the ground store: make, list, revoke.")


def make(
    name: Name,
    scope: Annotated[
        list[str] | None,
        typer.Option(
            metavar="SCOPE",
            help="What it opens, several by several options: stock, pictures, deliver, ask.",
            show_default=False,
        ),
    ] = None,
    state: State = None,
    as_json: AsJson = False,
) -> None:
    """Make a key, which is printed once; of it only a hash is kept.  It opens its scopes and nothing else.

    \b
    Examples:
      flightd ground keys make wms --scope stock --scope pictures
    """
    from flightd.ground.access.key_book import read_scopes

    book, scopes = _book(state), read_scopes(scope or [])
    from flightd.ground.access.passwords import hashed_secret, new_key

    secret = new_key()
    book.make(name, hashed_secret(secret), scopes)
    if as_json:
        print(json.dumps({"name": name, "scopes": sorted(scopes), "key": secret}))
        return
    print(secret)
    print(f"the key of {name}, shown this once; send it as  Authorization: Bearer KEY", file=sys.stderr)


def listed(state: State = None, as_json: AsJson = False) -> None:
    """List the keys, with what each opens and since when it is there.

    \b
    Examples:
      flightd ground keys list
    """
    keys = [
        {
            "name": key.name,
            "scopes": sorted(key.scopes),
            "made": f"{datetime.fromtimestamp(key.made_s, UTC):%Y-%m-%d %H:%M:%S} UTC",
        }
        for key in _book(state).all()
    ]
    if as_json:
        print(json.dumps({"keys": keys}))
        return
    if not keys:
        print("none yet: flightd ground keys make NAME --scope stock")
    for one in keys:
        print(f"{one['name']:<24} {one['made']}  {' '.join(one['scopes'])}")


def revoke(name: Name, state: State = None, as_json: AsJson = False) -> None:
    """Let a key open nothing any more; it holds within a second.

    \b
    Examples:
      flightd ground keys revoke wms
    """
    _book(state).revoke(name)
    print(json.dumps({"name": name}) if as_json else f"the key of {name} opens nothing any more")


def _book(state: Path | None) -> KeyBook:
    try:
        import argon2  # noqa: F401 - of the same extra as the station
    except ModuleNotFoundError:
        from flightd.core.extras import missing_extra

        raise missing_extra("ground", "flightd ground keys") from None
    from flightd.ground.access.key_book import KeyBook

    return KeyBook(state_folder(state))
