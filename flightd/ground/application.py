"""The station's HTTP and WebSocket: the page's files, one WebSocket per page, acts over it and by POST."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Iterable
from functools import partial
from pathlib import Path

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp
from starlette.websockets import WebSocket, WebSocketDisconnect

from flightd.core.errors import InputError
from flightd.ground.acts import carried_out
from flightd.ground.browser import Browser
from flightd.ground.flights.flights import Flights
from flightd.ground.flights.routes import flight_routes
from flightd.ground.guards import Guard
from flightd.ground.guide_pages.routes import guide_routes
from flightd.ground.hub import Hub
from flightd.ground.json_http import as_json, is_json, json_body, status_of
from flightd.ground.messages import SentAct, answer_message, read_page_message
from flightd.ground.missions.routes import mission_routes
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
        *mission_routes(folder, hub.drones),
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
    async with asyncio.TaskGroup() as acts:  # what was ordered is handed on though its page has gone
        with hub.opened() as browser:
            try:
                async with asyncio.TaskGroup() as tasks:
                    sending = tasks.create_task(_send(browser, socket), name="page out")
                    await _hear(hub, browser, socket, acts)
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


async def _hear(hub: Hub, browser: Browser, socket: WebSocket, acts: asyncio.TaskGroup) -> None:
    """Everything that the page says.  WebSocketDisconnect when it closes, InputError for nonsense."""
    while True:
        received = await socket.receive()
        if received["type"] == "websocket.disconnect":
            raise WebSocketDisconnect(received.get("code", 1000))
        message = read_page_message(received.get("text") or received.get("bytes") or "")
        if isinstance(message, SentAct):
            browser.begin_act()
            acts.create_task(_sent_act(hub, browser, message), name=f"act for {message.drone}")
        else:
            hub.hear(browser, message)


async def _sent_act(hub: Hub, browser: Browser, sent: SentAct) -> None:
    status, answer = await carried_out(hub.drones, sent.drone, bytes(sent.act))
    browser.answer_act(sent.number, answer_message(sent.number, status, answer))


async def _close(socket: WebSocket, why: str) -> None:
    with contextlib.suppress(RuntimeError, WebSocketDisconnect):  # it has closed by itself meanwhile
        await socket.close(_NOT_OURS, why.encode()[:120].decode(errors="ignore"))


async def _act(hub: Hub, request: Request) -> Response:
    """Hand an act to a drone, as `carried_out` says."""
    if not is_json(request):
        return as_json({"refused": "an act is JSON"}, 415)
    try:
        body = await json_body(request, "an act")
    except InputError as err:
        return as_json({"refused": str(err)}, status_of(err, 400))
    status, answer = await carried_out(hub.drones, request.path_params["drone"], body)
    return as_json(answer, status)
