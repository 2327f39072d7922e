"""An act of a person on its way to a drone: the same whether it came by POST or over a page's WebSocket."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from flightd.core.errors import FlightdError, InputError
from flightd.ground.access.access import Access
from flightd.ground.access.roles import QUELLING, Identity, may_order
from flightd.ground.drone_link import DroneLink
from flightd.ground.json_http import status_of
from flightd.ground.messages import Act, read_act


@dataclass(frozen=True, slots=True)
class Orders:
    """Hands people's acts to the drones, and writes each down with its person."""

    drones: Mapping[str, DroneLink]
    access: Access

    async def carried_out(
        self, who: Identity, address: str, name: str, body: bytes, over: bool = False
    ) -> tuple[int, dict[str, Any]]:
        """Hand the act in `body` to a drone: an HTTP status, and what is answered.

        200: accepted; 4xx, 503: refused, with a reason for a person.  Sent again with the same id it is done
        once, whichever way it comes.  `over`: the person's session ended while a drone flew, which leaves
        STOP and Pause."""
        drone = self.drones.get(name)
        if drone is None:
            return 404, {"refused": "there is no such drone"}
        try:
            act = read_act(body)
        except InputError as err:
            return 400, {"refused": str(err)}
        is_left = over and act.command in QUELLING
        status, answer = await _handed_on(drone, act, who if is_left else self.access.renewed(who))
        said = "repeated" if answer.get("repeated") else "after the end of the session" if is_left else ""
        self.access.write_down(
            who,
            address,
            f"{act.command} {act.node or act.plan}".rstrip(),
            name,
            outcome="accepted" if status == 200 else "refused",
            text=str(answer.get("refused", said)),
            id=act.id,
        )
        return status, answer


async def _handed_on(drone: DroneLink, act: Act, who: Identity | None) -> tuple[int, dict[str, Any]]:
    if who is None:
        return 401, {"refused": "sign in first"}
    if not may_order(who.role, act.command):
        return 403, {"refused": f"{who.name} has the role {who.role}; {act.command} needs the role operator"}
    try:
        accepted = await drone.act(act)
    except FlightdError as err:
        return status_of(err, 409), {"refused": str(err).removeprefix("refused: ")}
    return 200, {"accepted": True, "repeated": accepted.repeated}
