"""An act of a person on its way to a drone: the same whether it came by POST or over a page's WebSocket."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flightd.core.errors import FlightdError, InputError, TransientError, UnavailableError
from flightd.ground.drone_link import DroneLink
from flightd.ground.messages import read_act


async def carried_out(drones: Mapping[str, DroneLink], name: str, body: bytes) -> tuple[int, dict[str, Any]]:
    """Hand the act in `body` to a drone: an HTTP status, and what is answered.

    200: accepted; 4xx, 503: refused, with a reason for a person.  Sent again with the same id it is done
    once, whichever way it comes."""
    drone = drones.get(name)
    if drone is None:
        return 404, {"refused": "there is no such drone"}
    try:
        act = read_act(body)
    except InputError as err:
        return 400, {"refused": str(err)}
    try:
        accepted = await drone.act(act)
    except (UnavailableError, TransientError) as err:
        return 503, {"refused": str(err)}
    except FlightdError as err:
        return 409, {"refused": str(err).removeprefix("refused: ")}
    return 200, {"accepted": True, "repeated": accepted.repeated}
