"""`flightd ground`: the ground station in the browser."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flightd.core.errors import InputError

if TYPE_CHECKING:
    from flightd.ground.server import Listening

EXAMPLES = """Examples:

  flightd ground                               the flightd on this machine; open http://127.0.0.1:8080
  flightd ground --drone north=drone-1 --key ann.key_secret --server-key drone-1.key
  flightd ground --drone a=127.0.0.1 --drone b=127.0.0.1:6571/6572    two simulators, by their ports
  flightd ground --folder out                  with the flights and inventories under out
  flightd ground --listen 127.0.0.1:9000
"""


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("ground", epilog=EXAMPLES)(ground)


def ground(
    drone: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=HOST",
            help="A drone to watch, several by several options; HOST:STATUS/COMMAND where its ports are not"
            " 5571/5572.  Default: the flightd on this machine.",
            show_default=False,
        ),
    ] = None,
    listen: Annotated[
        str, typer.Option(metavar="ADDRESS", help="Where browsers find the page: of this machine only.")
    ] = "127.0.0.1:8080",
    folder: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Where flights, inventories and site files lie; only site files are changed.",
        ),
    ] = None,
    key: Annotated[
        Path | None, typer.Option(envvar="FLIGHTCTL_KEY", help="Your secret key: NAME.key_secret.")
    ] = None,
    server_key: Annotated[
        list[str] | None,
        typer.Option(
            metavar="[NAME=]FILE",
            envvar="FLIGHTCTL_SERVER_KEY",
            help="A drone's public key: NAME.key; without NAME= that of all.",
        ),
    ] = None,
) -> None:
    """Watch and command drones in the browser: map, cameras, hazards, events; start, pause, go to, STOP.

    It is a client of the ground link, as flightctl is: the drone flies on without it.  While a page is open,
    it attends the flight; closing the last one is losing the ground (ground.lost_action).  Ctrl-C ends it.
    """
    try:
        from flightd.ground.server import Listening, run
    except ModuleNotFoundError:
        from flightd.core.extras import missing_extra

        raise missing_extra("ground", "flightd ground") from None
    from flightd.ground.drone_names import drone_addresses

    if folder is not None and not folder.is_dir():
        raise InputError("there is no such folder", key=f"--folder {folder}")
    drones = drone_addresses(drone or (), key, server_key or ())
    ended_by = run(drones, Listening.read(listen), _say_where, folder)
    if ended_by is not None:
        print(f"flightd: the ground station was ended by {ended_by.name}", file=sys.stderr)


def _say_where(where: Listening) -> None:
    print(f"flightd: the ground station is at {where.url} (Ctrl-C ends it)", file=sys.stderr, flush=True)
