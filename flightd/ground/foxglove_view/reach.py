"""Where Foxglove finds the station: on this machine alone, for its protocol has no sign-in."""

from __future__ import annotations

from flightd.core.errors import InputError
from flightd.ground.server import Listening

PORT = 8765
"""Where Foxglove looks unless it is told otherwise."""
OPTION = "--foxglove"


def foxglove_address(text: str, login: bool) -> Listening:
    """HOST, HOST:PORT or [HOST]:PORT.  InputError for anything else, for an address that other machines
    reach, and where people have to sign in at the station (`login`), be it for its own address alone."""
    where = Listening.read(text, OPTION, PORT)
    if where.is_beyond:
        tunnel = f"ssh -L {where.port}:127.0.0.1:{where.port} HOST"
        raise InputError(
            "reaches beyond this machine, and Foxglove's protocol has no sign-in",
            key=f"{OPTION} {where.host}",
            remedy=f"give 127.0.0.1, and come from elsewhere by {tunnel}",
        )
    if login:
        raise InputError(
            "everybody shall sign in, and Foxglove's protocol has no sign-in",
            key=OPTION,
            remedy=f"leave out {OPTION}, or listen on this machine alone without --login",
        )
    return where
