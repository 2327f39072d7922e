"""The page Stock: what was counted, place by place, with its pictures and its history; nothing is changed."""

from __future__ import annotations

import hashlib
import logging
from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol, TypeVar

import msgspec
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from flightd.core.errors import InputError
from flightd.core.inventory import Observation, Standing
from flightd.ground.bounded import Threads
from flightd.ground.evidence_outlines import outlines
from flightd.ground.json_http import JSON, AnswerTo, as_json, or_refused, refusal
from flightd.ground.pages import page
from flightd.ground.stores import StockView, Stores
from flightd.inventory.code_search import found_places
from flightd.inventory.elevation import fronts_of
from flightd.inventory.export.formats import FORMATS
from flightd.inventory.export.json_document import observation_json
from flightd.inventory.place_view import view_of_told

_LOG = logging.getLogger(__name__)
T = TypeVar("T")
_MOST_WORDS = 200
_AT_ONCE, _MOST_WAITING = 2, 32
"""So many questions are read from the disk at a time: the way to the drones comes first."""
_DOCUMENTS_KEPT = 4
_KINDS = {
    "csv": "text/csv; charset=utf-8",
    "xlsx": "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet",
    "json": "application/json",
    "epcis": "application/ld+json",
}


class CountingDrone(Protocol):
    """A drone that tells what it has counted."""

    async def inventory(self) -> tuple[dict[str, str], ...]:
        """Place by place.  UnavailableError where it cannot be reached, RunError where it does not count."""
        ...


def stock_routes(asked: StockAnswers) -> list[BaseRoute]:
    """The page, and what it asks."""
    ways: dict[str, AnswerTo] = {
        "": asked.stores,
        "/places": asked.places,
        "/place": asked.place,
        "/find": asked.find,
        "/picture": asked.picture,
        "/outlines": asked.outlines,
        "/export": asked.export,
    }
    reads = [Route(f"/api/stock{way}", answered(answer), methods=["GET"]) for way, answer in ways.items()]
    return [*page("/stock"), *reads]


def answered(answer: AnswerTo, unshown: str = "this inventory cannot be shown") -> AnswerTo:
    """Or refused, as is what a file that anybody wrote can lead to, which `unshown` tells of."""
    asked = or_refused(answer)

    async def guarded(request: Request) -> Response:
        try:
            return await asked(request)
        except OSError as err:
            return refusal(f"cannot be read: {err.strerror or err}", 503)
        except (ArithmeticError, LookupError, TypeError, ValueError) as err:
            _LOG.exception("%s cannot be answered", request.url.path)
            return refusal(f"{unshown}: {type(err).__name__}", 409)

    return guarded


class StockAnswers:
    """What the page may ask.  Stores are read in threads, few at a time."""

    def __init__(self, stores: Stores, drones: Mapping[str, CountingDrone]) -> None:
        self._stores = stores
        self._drones = drones
        self._documents: OrderedDict[tuple[str, str], tuple[str, bytes]] = OrderedDict()
        self._reading = Threads(_AT_ONCE, _MOST_WAITING, "too many questions about the stock wait already")

    async def off_loop(self, work: Callable[..., T], *arguments: Any) -> T:
        """The work's result, done in a thread.  UnavailableError where too much waits."""
        return await self._reading.run(work, *arguments)

    async def stores(self, _request: Request) -> Response:
        """The inventories that can be shown: stores, and what the drones tell themselves."""
        names = await self.off_loop(self._stores.names)
        return as_json(
            {
                "folder": self._stores.title,
                "stores": [{"name": name, "written_s": ns / 1e9} for name, ns in names],
                "drones": list(self._drones),
            }
        )

    async def store_folder(self, request: Request) -> Path:
        """Where the store lies that a request is about: `?store=NAME`."""
        return await self.off_loop(self._stores.folder, request.query_params.get("store", ""))

    async def store_view(self, request: Request) -> StockView:
        """The store that a request is about: `?store=NAME`."""
        return await self.off_loop(self._stores.view, request.query_params.get("store", ""))

    async def view(self, request: Request) -> StockView:
        """The inventory that a request is about: `?store=NAME` or `?drone=NAME`."""
        name = request.query_params.get("drone")
        if name is None:
            return await self.store_view(request)
        drone = self._drones.get(name)
        if drone is None:
            raise InputError(f"there is no drone {name!r}")
        told = await drone.inventory()
        places = tuple(view_of_told(place) for place in told)
        codes = [place.code for place in places]
        return StockView(f"{hash(places):x}", fronts_of(codes), places, ())

    async def places(self, request: Request) -> Response:
        """Every front with its spots, and every place with its state.  304 while nothing of it has changed,
        whatever else was written."""
        view = await self.view(request)
        key = (request.url.query, view.stamp)
        known = self._documents.get(key)
        if known is None:
            known = self._documents[key] = await self.off_loop(_tagged_document, view)
            while len(self._documents) > _DOCUMENTS_KEPT:
                self._documents.popitem(last=False)
        tag, document = known
        if request.headers.get("if-none-match") == tag:
            return Response(status_code=304, headers={"ETag": tag})
        return Response(document, headers={"ETag": tag}, media_type=JSON)

    async def place(self, request: Request) -> Response:
        """One place with all its looks, newest first."""
        asked = request.query_params
        looks = await self.off_loop(self._stores.looks, asked.get("store", ""), asked.get("code", ""))
        return as_json({"code": asked.get("code", ""), "looks": _looks(looks)})

    async def find(self, request: Request) -> Response:
        """The places that words mean: by code, in whatever notation, or by the place's own name."""
        words = request.query_params.get("text", "").strip()
        if len(words) > _MOST_WORDS:
            raise InputError(f"at most {_MOST_WORDS} characters are looked for")
        view = await self.view(request)
        return as_json({"found": await self.off_loop(found_places, words, view.places)})

    async def picture(self, request: Request) -> Response:
        """A picture that was kept as evidence; its name is its content's, it never changes."""
        asked = request.query_params
        jpeg = await self.off_loop(self._stores.picture, asked.get("store", ""), asked.get("name", ""))
        return Response(
            jpeg, headers={"Cache-Control": "private, immutable, max-age=86400"}, media_type="image/jpeg"
        )

    async def outlines(self, request: Request) -> Response:
        """Where in a picture the codes are."""
        asked = request.query_params
        jpeg = await self.off_loop(self._stores.picture, asked.get("store", ""), asked.get("name", ""))
        found = await self.off_loop(outlines, jpeg)
        return as_json({"outlines": [{"text": text, "corners": corners} for text, corners in found]})

    async def export(self, request: Request) -> Response:
        """The whole inventory in a format of `flightd inventory export`."""
        kind = request.query_params.get("format", "")
        if kind not in FORMATS:
            raise InputError(f"no format is called {kind!r}; choose one of {', '.join(FORMATS)}")
        view = await self.store_view(request)
        data = await self.off_loop(FORMATS[kind].write, view.records)
        return download(data, f"inventory{FORMATS[kind].suffix}", _KINDS[kind])


def told_seconds(utc_ns: int) -> float | None:
    """A look's time as the page is told it, None where there was none; it comes back the same."""
    return utc_ns / 1e9 if utc_ns else None


def download(data: bytes, name: str, kind: str) -> Response:
    """A file for the person to keep."""
    return Response(data, headers={"Content-Disposition": f'attachment; filename="{name}"'}, media_type=kind)


def _tagged_document(view: StockView) -> tuple[str, bytes]:
    """With the tag by which a browser knows it, packed or not."""
    document = _document(view)
    return f'W/"{hashlib.blake2b(document, digest_size=12).hexdigest()}"', document


def _document(view: StockView) -> bytes:
    fronts = [
        {
            "aisle": front.aisle,
            "side": front.side,
            "mirrored": front.mirrored,
            "placed": front.placed,
            "spots": [(spot.code, spot.bay, spot.level, spot.position) for spot in front.spots],
        }
        for front in view.fronts
    ]
    places = {
        place.code: {
            "state": place.state,
            "texts": place.texts,
            "confidence": place.confidence,
            "pending": place.pending,
            "seen_s": told_seconds(place.utc_ns),
        }
        for place in view.places
    }
    return msgspec.json.encode({"fronts": fronts, "places": places})


def _looks(looks: Sequence[tuple[Observation, Standing]]) -> list[dict[str, object]]:
    newest_first = sorted(looks, key=lambda look: look[0].utc_ns, reverse=True)
    return [{**observation_json(seen), "standing": standing.name.lower()} for seen, standing in newest_first]
