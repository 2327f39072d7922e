"""What the page asks of the flights: the list, one flight, its curves, pictures and report."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import TypeAlias

import msgspec
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.routing import BaseRoute, Route

from flightd.core.errors import FlightdError, InputError, TransientError, UnavailableError
from flightd.ground.flights.flights import Flights
from flightd.ground.pages import page

_JSON = "application/json"
_BINARY = "application/octet-stream"
_SERIES_STRETCHES = 900
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
            except InputError as err:
                return _refused(404, err)
            except (UnavailableError, TransientError) as err:
                return _refused(503, err)
            except FlightdError as err:
                return _refused(409, err)

        return Route(path, guarded, methods=["GET"])

    return [
        at("/api/flights", _list),
        at("/api/flights/{flight}", _head),
        at("/api/flights/{flight}/series", _series),
        at("/api/flights/{flight}/pictures/{place:int}", _picture),
        at("/api/flights/{flight}/report", _report),
        *page("/flights"),
    ]


async def _list(flights: Flights, request: Request) -> Response:
    if flights.index is None:
        return Response(b'{"folder":false}', media_type=_JSON)
    known = request.query_params.get("known", "")
    listing = flights.index.listing(int(known) if known.isascii() and known.isdigit() else -1)
    return Response(listing, media_type=_JSON)


async def _head(flights: Flights, request: Request) -> Response:
    return Response(await flights.head(request.path_params["flight"]), media_type=_JSON)


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
        await flights.series(request.path_params["flight"], *span, int(stretches)), media_type=_JSON
    )


async def _picture(flights: Flights, request: Request) -> Response:
    content = await flights.picture(request.path_params["flight"], request.path_params["place"])
    return Response(content, media_type=_BINARY, headers={"Cache-Control": "private, max-age=600"})


async def _report(flights: Flights, request: Request) -> Response:
    return HTMLResponse(await flights.report(request.path_params["flight"]), headers=_REPORT_HEADERS)


def _refused(status: int, err: FlightdError) -> Response:
    return Response(msgspec.json.encode({"refused": err.what}), status, media_type=_JSON)
