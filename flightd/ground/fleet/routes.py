"""The station's fleet over HTTP: how it is, what it is to visit, what is closed to it, and STOP for every
drone."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from flightd.core.errors import InputError, TransientError, UnavailableError
from flightd.core.planned_flight import MOST_NODES
from flightd.fleet.traffic.valued_work import worth_of
from flightd.ground.access.access import Access
from flightd.ground.access.gate import address_of, identity_of, note_act
from flightd.ground.fleet.own_fleet import OwnFleet, stop_all
from flightd.ground.fleet.site_facts import SiteFacts
from flightd.ground.hub import Hub
from flightd.ground.json_http import as_json, or_refused, said
from flightd.ground.pages import page
from flightd.ground.shown_text import shown
from flightd.ground.valued_nodes import ByValue

_Name = Annotated[str, Meta(max_length=128)]


class AskedTour(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Nodes to be visited: by `drone`, empty: by whichever has the time."""

    nodes: Annotated[list[_Name], Meta(min_length=1, max_length=MOST_NODES)]
    drone: _Name = ""


class AskedClosure(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What nobody is to fly: an `aisle`, or the ways between some `nodes`."""

    aisle: _Name = ""
    nodes: Annotated[list[_Name], Meta(max_length=MOST_NODES)] = []


class AskedOpening(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What is to be flown again, by the name that it was closed by."""

    name: Annotated[str, Meta(min_length=1, max_length=4096)]


def fleet_routes(fleet: OwnFleet | None, hub: Hub, access: Access, facts: SiteFacts) -> list[BaseRoute]:
    """Without a `fleet` there is STOP alone; `facts` say what is most valuable."""

    def own() -> OwnFleet:
        if fleet is None:
            raise InputError("the station flies no fleet; start it with --fleet")
        return fleet

    async def show(_: Request) -> Response:
        return as_json(own().document())

    async def ask(request: Request) -> Response:
        asked = await said(request, AskedTour, "a tour")
        note_act(request, f"visit {' '.join(asked.nodes)} {asked.drone}".rstrip())
        own().ask(asked.nodes, asked.drone)
        return as_json({})

    async def ask_by_value(request: Request) -> Response:
        asked = await said(request, ByValue, "work by value")
        asked.check()
        what = "nodes" if asked.aisles is None else "aisles"
        note_act(request, f"visit the most valuable: {asked.nodes or asked.aisles or 'all'} {what}")
        worth = worth_of(await facts.of(own().site))
        return as_json({"asked": own().ask_by_value(worth, asked)})

    async def close(request: Request) -> Response:
        asked = await said(request, AskedClosure, "what is to be closed")
        if bool(asked.aisle) is bool(asked.nodes):
            raise InputError("an aisle is closed, or what is between nodes")
        note_act(request, f"close {asked.aisle or ' '.join(asked.nodes)}")
        by = identity_of(request).name
        return as_json({"name": await own().close(by, aisle=asked.aisle, nodes=asked.nodes)})

    async def open_again(request: Request) -> Response:
        asked = await said(request, AskedOpening, "what is to be opened")
        note_act(request, f"open {asked.name}")
        await own().open(asked.name)
        return as_json({})

    async def stop(request: Request) -> Response:
        refused: dict[str, str] = {}
        again: list[str] = []
        for drone, err in (await stop_all(hub)).items():
            text = "" if err is None else str(err).removeprefix("refused: ")
            access.write_down(
                identity_of(request),
                address_of(request.scope),
                "stop",
                drone,
                outcome="accepted" if err is None else "refused",
                text=text,
            )
            if err is not None:
                refused[drone] = shown(text)
            if isinstance(err, UnavailableError | TransientError):
                again.append(drone)
        return as_json({"refused": refused, "again": again})

    return [
        *page("/fleet"),
        Route("/api/fleet", or_refused(show), methods=["GET"]),
        Route("/api/fleet/tour", or_refused(ask), methods=["POST"]),
        Route("/api/fleet/value", or_refused(ask_by_value), methods=["POST"]),
        Route("/api/fleet/close", or_refused(close), methods=["POST"]),
        Route("/api/fleet/open", or_refused(open_again), methods=["POST"]),
        Route("/api/fleet/stop", or_refused(stop), methods=["POST"]),
    ]
