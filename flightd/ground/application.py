"""The station's HTTP and WebSocket: the page's files, one WebSocket per page, acts by POST."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Iterable
from functools import partial
from pathlib import Path

import msgspec
from starlette.applications import Starlette
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp
from starlette.websockets import WebSocket, WebSocketDisconnect

from flightd.core.errors import FlightdError, InputError, TransientError, UnavailableError
from flightd.ground.browser import Browser
from flightd.ground.flights.flights import Flights
from flightd.ground.flights.routes import flight_routes
from flightd.ground.guards import Guard
from flightd.ground.guide_pages.routes import guide_routes
from flightd.ground.hub import Hub
from flightd.ground.messages import MAX_PAGE_MESSAGE_BYTES, read_act, read_page_message
from flightd.ground.pages import STATIC, first_page
from flightd.ground.reading_process import ReadingProcess
from flightd.ground.stock_page import stock_page

_NOT_OURS = 1008
"""WebSocket: a message that is against the rules."""
_FULL = 1013
"""WebSocket: try again later."""


def application(
    hub: Hub, hosts: Iterable[str], folder: Path | None, flights: Flights, uploads: ReadingProcess
) -> ASGIApp:
    """The whole station as ASGI; `hosts` are the names under which it may be asked, inventories and `flights`
    lie under `folder`, `uploads` reads what people send."""
    routes = [
        first_page(),
        WebSocketRoute("/live", partial(_live, hub)),
        Route("/drones/{drone}/acts", partial(_act, hub), methods=["POST"]),
        *stock_page(folder, hub.drones, uploads),
        *flight_routes(flights),
        *guide_routes(),
        Mount("/static", StaticFiles(directory=STATIC)),
    ]
    return Guard(Starlette(routes=routes), hosts)


async def _live(hub: Hub, socket: WebSocket) -> None:
    """One page, until it closes or says what no page of ours says."""
    await socket.accept()
    if hub.is_full:
        await socket.close(_FULL, "too many pages are open")
        return
    with hub.opened() as browser:
        try:
            async with asyncio.TaskGroup() as tasks:
                sending = tasks.create_task(_send(browser, socket), name="page out")
                await _hear(hub, browser, socket)
                sending.cancel()
        except* WebSocketDisconnect:
            pass  # it is gone: the usual end
        except* InputError as group:
            await _close(socket, str(group.exceptions[0]))


async def _send(browser: Browser, socket: WebSocket) -> None:
    """Everything that the page is to see; waits where it does not take it."""
    while True:
        message = await browser.next()
        await (socket.send_text(message) if isinstance(message, str) else socket.send_bytes(message))


async def _hear(hub: Hub, browser: Browser, socket: WebSocket) -> None:
    """Everything that the page says.  WebSocketDisconnect when it closes, InputError for nonsense."""
    while True:
        message = await socket.receive()
        if message["type"] == "websocket.disconnect":
            raise WebSocketDisconnect(message.get("code", 1000))
        hub.hear(browser, read_page_message(message.get("text") or message.get("bytes") or ""))


async def _close(socket: WebSocket, why: str) -> None:
    with contextlib.suppress(RuntimeError, WebSocketDisconnect):  # it has closed by itself meanwhile
        await socket.close(_NOT_OURS, why.encode()[:120].decode(errors="ignore"))


async def _act(hub: Hub, request: Request) -> Response:
    """Hand an act to a drone.  200: accepted; 4xx, 503: refused, with a reason for a person."""
    drone = hub.drones.get(request.path_params["drone"])
    if drone is None:
        return _answer(404, refused="there is no such drone")
    if request.headers.get("content-type", "").partition(";")[0].strip() != "application/json":
        return _answer(415, refused="an act is JSON")
    try:
        act = read_act(await _body(request))
    except InputError as err:
        return _answer(400, refused=str(err))
    try:
        accepted = await drone.act(act)
    except (UnavailableError, TransientError) as err:
        return _answer(503, refused=str(err))
    except FlightdError as err:
        return _answer(409, refused=str(err).removeprefix("refused: "))
    return _answer(200, accepted=True, repeated=accepted.repeated)


async def _body(request: Request) -> bytes:
    """The request's body.  InputError for one that is longer than any act, or breaks off."""
    body = b""
    try:
        async for part in request.stream():
            body += part
            if len(body) > MAX_PAGE_MESSAGE_BYTES:
                raise InputError("too long for an act")
    except ClientDisconnect:
        raise InputError("it breaks off") from None
    return body


def _answer(status: int, **fields: object) -> Response:
    return Response(msgspec.json.encode(fields), status, media_type="application/json")
