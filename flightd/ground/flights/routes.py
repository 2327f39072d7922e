"""What the page asks of the flights: the list, one flight, its curves, pictures and report."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import TypeAlias

from starlette.requests import Request
from starlette.responses import HTMLResponse, PlainTextResponse, Response
from starlette.routing import BaseRoute, Route

from flightd.core.errors import FlightdError, InputError
from flightd.ground.flights.flights import Flights
from flightd.ground.json_http import JSON, as_json, status_of
from flightd.ground.pages import page
from flightd.ground.shown_text import shown

_BINARY = "application/octet-stream"
_SERIES_STRETCHES = 900
_MOST_DIGITS = 16
_REPORT_HEADERS = {
    "Content-Security-Policy": (
        "sandbox allow-scripts; default-src 'none'; img-src data:; style-src 'unsafe-inline'; "
        "script-src 'unsafe-inline'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    # a sandboxed document may not share a group with the station's pages
    "Cross-Origin-Opener-Policy": "unsafe-none",
}
"""A report is one file with script and style in it, and a file in the folder may be anybody's: it runs
as nobody's page, asks nobody anything and reaches nothing of the station."""

_Answer: TypeAlias = Callable[[Flights, Request], Awaitable[Response]]


def flight_routes(flights: Flights) -> list[BaseRoute]:
    """The page at /flights and all that it asks for."""

    def at(path: str, answer: _Answer) -> Route:
        async def guarded(request: Request) -> Response:
            try:
                return await answer(flights, request)
            except FlightdError as err:
                return as_json({"refused": shown(err.what)}, status_of(err))

        return Route(path, guarded, methods=["GET"])

    return [
        at("/api/flights", _list),
        at("/api/flights/{flight}", _head),
        at("/api/flights/{flight}/series", _series),
        at("/api/flights/{flight}/pictures/{place}", _picture),
        at("/api/flights/{flight}/thumbnail", _thumbnail),
        at("/api/flights/{flight}/report", _report),
        *page("/flights"),
    ]


async def _list(flights: Flights, request: Request) -> Response:
    if flights.index is None:
        return Response(b'{"folder":false}', media_type=JSON)
    known = _whole(request.query_params.get("known", ""))
    return Response(flights.index.listing(-1 if known is None else known), media_type=JSON)


async def _head(flights: Flights, request: Request) -> Response:
    return Response(await flights.head(request.path_params["flight"]), media_type=JSON)


async def _series(flights: Flights, request: Request) -> Response:
    def number(name: str, otherwise: float) -> float:
        try:
            return float(request.query_params.get(name, otherwise))
        except ValueError:
            raise InputError(f"{name} is no number") from None

    stretches = number("stretches", _SERIES_STRETCHES)
    if not stretches.is_integer():
        raise InputError("stretches is no whole number")
    span = number("from", 0.0), number("to", float("inf"))
    return Response(
        await flights.series(request.path_params["flight"], *span, int(stretches)), media_type=JSON
    )


async def _picture(flights: Flights, request: Request) -> Response:
    place = _whole(request.path_params["place"])
    if place is None:
        raise InputError("the flight has no such picture")
    stamp, known = request.query_params.get("stamp", ""), request.headers.get("if-none-match", "")
    picture = await flights.picture(request.path_params["flight"], place, stamp, known)
    keep = "private, max-age=600, immutable" if picture.stays else "private, no-cache"
    headers = {"Cache-Control": keep, "ETag": picture.tag}
    if not picture.content:
        return Response(status_code=304, headers=headers)
    return Response(picture.content, media_type=_BINARY, headers=headers)


async def _thumbnail(flights: Flights, request: Request) -> Response:
    return Response(await flights.thumbnail(request.path_params["flight"]), media_type="image/jpeg")


async def _report(flights: Flights, request: Request) -> Response:
    try:
        page = await flights.report(request.path_params["flight"])
    except FlightdError as err:  # a person looks at it, not our page
        return PlainTextResponse(f"The report cannot be shown: {shown(err.what)}.\n", status_of(err))
    return HTMLResponse(page, headers=_REPORT_HEADERS)


def _whole(text: str) -> int | None:
    """A whole number that is none too long, else None."""
    return int(text) if len(text) < _MOST_DIGITS and text.isascii() and text.isdigit() else None
