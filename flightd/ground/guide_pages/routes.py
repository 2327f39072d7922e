"""What the guide's page asks for: the list of its pages, one of them, hits of a search, pictures."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import asdict
from functools import cache

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Mount, Route
from starlette.staticfiles import StaticFiles

from flightd.core.errors import UnavailableError
from flightd.ground.bounded import Room
from flightd.ground.guide_pages.rendering import picture_folder, rendered, topics
from flightd.ground.guide_pages.search import GuideSearch
from flightd.ground.json_http import as_json
from flightd.ground.pages import page

MOST_QUERY_CHARS = 200
_MOST_WAITING = 32


def guide_routes() -> list[BaseRoute]:
    """The page at /guide and all that it asks for."""
    room = Room(_MOST_WAITING, "too many questions to the guide wait already")

    def at(path: str, answer: Callable[[Request], Awaitable[Response]]) -> Route:
        async def bounded(request: Request) -> Response:
            try:
                with room.taken():
                    return await answer(request)
            except UnavailableError as err:
                return as_json({"refused": str(err)}, 503)

        return Route(path, bounded, methods=["GET"])

    return [
        at("/api/guide", _list),
        at("/api/guide/search", _search),
        at("/api/guide/pages/{topic}", _page),
        Mount("/api/guide/pictures", StaticFiles(directory=picture_folder())),
        *page("/guide"),
    ]


async def _list(_request: Request) -> Response:
    pages = await asyncio.to_thread(lambda: [rendered(topic) for topic in topics()])
    return as_json({"pages": [{"topic": one.topic, "title": one.title} for one in pages]})


async def _page(request: Request) -> Response:
    topic = request.path_params["topic"]
    if topic not in topics():
        return as_json({"refused": "the guide has no such page"}, 404)
    one, before, after = await asyncio.to_thread(lambda: (rendered(topic), *_neighbours(topic)))
    headings = [asdict(heading) for heading in one.headings]
    return as_json(
        {
            "topic": topic, "title": one.title, "html": one.html, "headings": headings,
            "before": before, "after": after,
        }
    )  # fmt: skip


async def _search(request: Request) -> Response:
    query = request.query_params.get("q", "")[:MOST_QUERY_CHARS]
    hits = await asyncio.to_thread(lambda: _index().find(query))
    return as_json({"query": query, "hits": [asdict(hit) for hit in hits]})


@cache
def _index() -> GuideSearch:
    return GuideSearch([rendered(topic) for topic in topics()])


def _neighbours(topic: str) -> tuple[dict[str, str] | None, dict[str, str] | None]:
    """The pages before and after it, with their titles."""
    around = [None, *topics(), None]
    for before, this, after in zip(around, around[1:], around[2:], strict=False):
        if this == topic:
            return _named(before), _named(after)
    return None, None


def _named(topic: str | None) -> dict[str, str] | None:
    return None if topic is None else {"topic": topic, "title": rendered(topic).title}
