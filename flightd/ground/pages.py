"""The pages' document: one file for all of them, whatever path is asked for; its router shows the page."""

from __future__ import annotations

from pathlib import Path

from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.routing import BaseRoute, Route

STATIC = Path(__file__).with_name("static")


def page(path: str) -> list[BaseRoute]:
    """A page at `path`, such as /stock, and everything below it, as `static/app/pages.js` has it."""
    return [Route(at, _document, methods=["GET"]) for at in (path, f"{path}/{{rest:path}}")]


def first_page() -> BaseRoute:
    """The page at /, and nothing below it: what is no page is not found."""
    return Route("/", _document, methods=["GET"])


async def _document(_request: Request) -> Response:
    return FileResponse(STATIC / "index.html")
