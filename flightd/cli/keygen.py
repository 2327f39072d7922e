"""`flightd keygen`: the secret of a signed MAVLink link."""

from __future__ import annotations

import asyncio
import json
import sys
import time
from pathlib import Path
from typing import Annotated

import typer

from flightd.cli.options import AsJson


def register(app: typer.Typer) -> None:
    """Hang the command under `app`."""
    app.command("keygen")(keygen)


def keygen(
    mavlink: Annotated[Path, typer.Option(metavar="FILE", help="Key file: written, mode 0600, if new.")],
    send: Annotated[
        str, typer.Option(metavar="URL", help="Give the autopilot the key over this cable.")
    ] = "",
    system_id: Annotated[int, typer.Option(min=1, max=255, help="MAVLink system id of the vehicle.")] = 1,
    as_json: AsJson = False,
) -> None:
    """Make the secret key of a MAVLink 2 link that is signed, and give it to the autopilot.

    The autopilot needs the same 32 bytes.  --send sends them (SETUP_SIGNING) over a cable, for they go out
    in the clear, and says whether the autopilot was then heard to sign; a file that is there already is
    sent as it is.  The keys of ground stations are made by flightctl keygen.

    \b
    Examples:
      flightd keygen --mavlink /etc/flightd/mavlink.key
      flightd keygen --mavlink /etc/flightd/mavlink.key --send serial:///dev/ttyACM0:115200
      then in the configuration: [vehicle] signing_key = "mavlink.key"
    """
    from flightd.adapters.vehicle.mavlink.key_transfer import give_key, refuse_overheard
    from flightd.adapters.vehicle.mavlink.link.signing import make_key, read_key
    from flightd.runtime.clock import LoopClock

    if send:
        refuse_overheard(send)
    if not send or not mavlink.exists():
        make_key(mavlink)
    document: dict[str, object] = {"key": str(mavlink)}
    if not send:
        print(json.dumps(document) if as_json else mavlink)
        print(f"give the autopilot the same key: --send, or the 64 hex digits in {mavlink}", file=sys.stderr)
        return

    async def give() -> bool:
        return await give_key(send, read_key(mavlink), LoopClock(), time.time(), system_id)

    signs = asyncio.run(give())
    text = f"the autopilot at {send} has the key and signs with it"
    if not signs:
        text = (
            f"sent to the autopilot at {send}, which does not sign here (over USB it need not): "
            "run flightd doctor over the link that is to be signed"
        )
    print(json.dumps(document | {"sent": send, "signs": signs}) if as_json else text)
