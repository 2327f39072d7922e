"""Who flies a drone: a person of the station, or the manager of a fleet."""

from __future__ import annotations

from typing import Protocol

import msgspec
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from flightd.core.errors import InputError
from flightd.ground.access.gate import note_act
from flightd.ground.json_http import as_json, or_refused, said

_MOST_BYTES = 256


class Managers(Protocol):
    """They fly drones for which no person of the station does."""

    def hand_over(self, name: str, *, to_manager: bool) -> bool:
        """A person takes a drone, or gives it (back); False where no manager flies it."""
        ...

    def flies(self, name: str) -> bool:
        """A manager flies the drone, and no person."""
        ...


class HandOver(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Whether the manager flies from now on."""

    flies: bool


def manager_routes(managers: Managers | None) -> list[BaseRoute]:
    """The one route; without `managers` it refuses."""

    async def hand_over(request: Request) -> Response:
        asked = await said(request, HandOver, "an act", _MOST_BYTES)
        drone = request.path_params["drone"]
        note_act(request, "the fleet's manager flies" if asked.flies else "a person flies")
        if managers is None or not managers.hand_over(drone, to_manager=asked.flies):
            raise InputError(f"no fleet's manager flies {drone}")
        return as_json({})

    return [Route("/drones/{drone}/manager", or_refused(hand_over), methods=["POST"])]
