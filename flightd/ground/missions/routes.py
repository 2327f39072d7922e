"""The page Missions: what it asks of the station, and what it has done."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from flightd.adapters.ground_link.messages.answers import PlanAnswer, Planned
from flightd.core.errors import FlightdError, InputError
from flightd.core.planned_flight import MOST_NODES
from flightd.ground.access.gate import note_act
from flightd.ground.bounded import Threads
from flightd.ground.drone_link import DroneLink
from flightd.ground.json_http import AnswerTo, as_json, decoded, or_refused, said
from flightd.ground.missions.mission_book import Mission, MissionBook
from flightd.ground.pages import page
from flightd.ground.read_folders import ReadFolder
from flightd.ground.stores import Stores

_LOG = logging.getLogger(__name__)
_AT_ONCE, _MOST_WAITING = 1, 32
_MOST_BYTES = 64 << 10
_MOST_PLACES, _MOST_PLACES_BYTES = 20_000, 2 << 20

_Id = Annotated[str, Meta(min_length=8, max_length=64)]
_Nodes = Annotated[tuple[Annotated[str, Meta(min_length=1, max_length=64)], ...], Meta(max_length=MOST_NODES)]
_Levels = Annotated[tuple[Annotated[int, Meta(ge=1, le=99)], ...], Meta(max_length=99)]


class Kept(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A mission as the page has it kept."""

    site: Annotated[str, Meta(min_length=1, max_length=200)]
    name: Annotated[str, Meta(min_length=1, max_length=80)]
    nodes: Annotated[_Nodes, Meta(min_length=1)]
    levels: _Levels = ()


class Flown(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Nodes for a drone's next flight; sent again with the same `id` they are handed over once.  `mission` is
    the id of the mission that they are of, empty for one that is not kept."""

    id: _Id
    drone: Annotated[str, Meta(max_length=64)]
    nodes: _Nodes
    levels: _Levels = ()
    best_order: bool = False
    mission: Annotated[str, Meta(max_length=64)] = ""
    session: Annotated[str, Meta(max_length=64)] = ""
    seen_ns: Annotated[int, Meta(ge=0)] = 0


class Recounted(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Places of an inventory that are to be counted again."""

    store: Annotated[str, Meta(max_length=1000)]
    places: Annotated[
        tuple[Annotated[str, Meta(min_length=1, max_length=200)], ...],
        Meta(min_length=1, max_length=_MOST_PLACES),
    ]


def mission_routes(
    folder: Path | None,
    drones: Mapping[str, DroneLink],
    for_each: Callable[[Callable[[DroneLink], None]], None],
    others: Sequence[ReadFolder] = (),
) -> list[BaseRoute]:
    """The page and its answers; `for_each` prepares each of the drones, those that join, too.  Without a
    `folder` missions are planned and flown, but not kept."""
    missions = _Missions(None if folder is None else MissionBook(folder), Stores(folder, others), drones)

    def follow(drone: DroneLink) -> None:
        drone.on_plan = missions.heard

    for_each(follow)
    ways: list[tuple[str, str, AnswerTo]] = [
        ("", "GET", missions.listed),
        ("/estimate", "GET", missions.estimate),
        ("/recount", "POST", missions.recount),
        ("/fly", "POST", missions.fly),
        ("/{mission}", "PUT", missions.keep),
        ("/{mission}", "DELETE", missions.delete),
    ]
    answers = [Route(f"/api/missions{way}", or_refused(answer), methods=[verb]) for way, verb, answer in ways]
    return [*page("/missions"), *answers]


class _Missions:
    """Keeps missions in a `book`, if there is one; asks the drones all that only they know."""

    def __init__(self, book: MissionBook | None, stores: Stores, drones: Mapping[str, DroneLink]) -> None:
        self._book = book
        self._stores = stores
        self._drones = drones
        self._threads = Threads(_AT_ONCE, _MOST_WAITING, "too many changes to missions wait already")

    async def listed(self, request: Request) -> Response:
        """The missions of `?site=NAME`, and whether they are kept here."""
        if self._book is None:
            return as_json({"kept": False, "missions": []})
        found = await self._threads.run(self._book.missions, request.query_params.get("site", ""))
        return as_json({"kept": True, "missions": found})

    async def estimate(self, request: Request) -> Response:
        """What a flight of `?drone=NAME` over `&node=…` that counts `&level=…` would be, by the drone itself;
        `&best=1`: in the quickest order."""
        query = request.query_params
        levels = tuple(
            int(text) if text.isascii() and text.isdigit() and len(text) < 3 else -1
            for text in query.getlist("level")
        )
        asked = decoded(
            msgspec.json.encode({"id": "estimate", "drone": query.get("drone", ""), "levels": levels,
                                 "nodes": query.getlist("node"), "best_order": query.get("best") == "1"}),
            Flown,
            "a mission",
        )  # fmt: skip
        return as_json(_told(await self._drone(asked.drone).plan_flight(
            asked.nodes, asked.levels, best_order=asked.best_order, dry=True
        )))  # fmt: skip

    async def recount(self, request: Request) -> Response:
        """The nodes and levels that see places of an inventory, the places that are seen from none, and the
        site that the inventory is of (empty: nobody knows)."""
        asked = await said(request, Recounted, "places to count again", _MOST_PLACES_BYTES)
        view = await self._threads.run(self._stores.view, asked.store)
        site = await self._threads.run(self._stores.site_name, asked.store)
        node_of = {record.code: record.node for record in view.records}
        levels = {spot.code: spot.level for front in view.fronts for spot in front.spots}
        places = list(dict.fromkeys(asked.places))
        seen = [code for code in places if node_of.get(code)]
        nodes = list(dict.fromkeys(node_of[code] for code in seen))
        if len(nodes) > MOST_NODES:
            raise InputError(
                f"these places are seen from {len(nodes)} nodes, and a flight has at most {MOST_NODES}",
                remedy="pick out fewer places",
            )
        known = all(levels.get(code) for code in seen)
        return as_json(
            {
                "site": site,
                "nodes": nodes,
                "levels": sorted({levels[code] for code in seen}) if known else [],
                "without": [code for code in places if code not in seen],
            }
        )

    async def fly(self, request: Request) -> Response:
        """Hand nodes to a drone for its next flight (none: what its configuration says), which starts by a
        command of its own."""
        asked = await said(request, Flown, "a mission", _MOST_BYTES)
        over = ", ".join(asked.nodes) or "what is configured"
        note_act(request, f"plan {asked.id} for {asked.drone}: {over}")
        planned = await self._drone(asked.drone).plan_flight(
            asked.nodes,
            asked.levels,
            asked.id,
            best_order=asked.best_order,
            session=asked.session,
            seen_ns=asked.seen_ns,
        )
        if self._book is not None and asked.mission:
            await self._threads.run(
                self._book.handed_over, asked.mission, asked.id, planned.nodes, time.time_ns()
            )
        return as_json({"plan": asked.id, **_told(planned)})

    async def keep(self, request: Request) -> Response:
        """Keep a mission, new or in place of the one with its id."""
        kept, identity = await said(request, Kept, "a mission", _MOST_BYTES), request.path_params["mission"]
        if not 8 <= len(identity) <= 64:
            raise InputError("an id has 8 to 64 characters")
        name = " ".join(kept.name.split())
        if not name:
            raise InputError("a mission needs a name")
        note_act(request, f"{name} of {kept.site}")
        mission = Mission(
            identity, kept.site, name, tuple(dict.fromkeys(kept.nodes)), kept.levels, time.time_ns()
        )
        return as_json(await self._threads.run(self._kept_in().keep, mission))

    async def delete(self, request: Request) -> Response:
        """Forget a mission."""
        await self._threads.run(self._kept_in().delete, request.path_params["mission"])
        return as_json({})

    async def heard(self, plan: PlanAnswer) -> None:
        """A drone has told what is left of its plan."""
        if self._book is None or not plan.id:
            return
        try:
            await self._threads.run(self._book.left, plan.id, plan.remaining)
        except FlightdError as err:
            _LOG.warning("what is left of a mission is not kept: %s", err)

    def _kept_in(self) -> MissionBook:
        if self._book is None:
            raise InputError(
                "this station has no folder to keep missions in", remedy="start it with --folder"
            )
        return self._book

    def _drone(self, name: str) -> DroneLink:
        if name not in self._drones:
            raise InputError(f"there is no drone {name!r}")
        return self._drones[name]


def _told(planned: Planned) -> dict[str, object]:
    return {
        "nodes": planned.nodes,
        "levels": planned.levels,
        "way": planned.way,
        "places": planned.places,
        "way_m": planned.way_m,
        "seconds": planned.seconds,
        "batteries": planned.batteries,
        "charge": planned.charge,
        "battery_s": planned.battery_s,
        "sweeps": [each.text for each in planned.sweeps],
    }
