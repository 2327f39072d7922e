"""`flightctl keygen`: the keys of a ground link."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from flightd.cli.options import AsJson
from flightd.core.errors import InputError


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("keygen")(keygen)


def keygen(
    name: Annotated[str, typer.Argument(help="Of the drone, the person or the ground station.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for the two files.")] = Path(),
    role: Annotated[str, typer.Option(help="operator or viewer.")] = "operator",
    as_json: AsJson = False,
) -> None:
    """Make a pair of keys: NAME.key may be given away, NAME.key_secret stays where it is.

    \b
    Examples:
      flightctl keygen drone-1 --out /etc/flightd/keys
      flightctl keygen ann --role viewer
    """
    from flightd.adapters.ground_link.keys import load_public, make_keys
    from flightd.adapters.ground_link.messages.base import Role

    if role not in set(Role):
        raise InputError(f"expected {' or '.join(Role)}", key=f"--role {role}")
    public, secret = make_keys(out, name)
    line = f"{role} {load_public(public)} {name}"
    if as_json:
        print(json.dumps({"public": str(public), "secret": str(secret), "client": line}))
        return
    print(f"{public}  (public)\n{secret}  (secret: keep it here, readable by you alone)\n")
    print("A drone's: name the secret file as ground.server_key, give the public one to its clients.")
    print(f"A client's: add this line to the drone's list of clients (ground.clients):\n{line}")
