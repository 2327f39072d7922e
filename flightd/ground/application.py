"""The station's HTTP and WebSocket: the page's files, one WebSocket per page, acts over it and by POST."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Sequence
from functools import partial
from itertools import count
from pathlib import Path

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp
from starlette.websockets import WebSocket, WebSocketDisconnect

from flightd.core.errors import InputError
from flightd.ground.access.access import Access
from flightd.ground.access.gate import SIGN_IN_FIRST, address_of, gated, identity_of
from flightd.ground.access.roles import Role
from flightd.ground.access.session_routes import session_routes
from flightd.ground.acts import Orders
from flightd.ground.browser import Browser
from flightd.ground.doctor.routes import doctor_routes
from flightd.ground.fleet.own_fleet import OwnFleet
from flightd.ground.fleet.routes import fleet_routes
from flightd.ground.fleet.site_facts import SiteFacts
from flightd.ground.flights.flights import Flights
from flightd.ground.flights.routes import flight_routes
from flightd.ground.ground_store.store import GroundStore
from flightd.ground.guards import Guard, Hosts
from flightd.ground.guide_pages.routes import guide_routes
from flightd.ground.hub import Hub
from flightd.ground.json_http import as_json, is_json, json_body, status_of
from flightd.ground.manager_routes import Managers, manager_routes
from flightd.ground.messages import (
    SentAct,
    SessionState,
    Want,
    answer_message,
    read_page_message,
    session_message,
)
from flightd.ground.missions.routes import mission_routes
from flightd.ground.packed_json import PackedJson
from flightd.ground.page_person import PagePeople, PagePerson, Standing
from flightd.ground.pages import STATIC, first_page
from flightd.ground.read_folders import ReadFolder
from flightd.ground.reading_process import ReadingProcess
from flightd.ground.schedules.night_shift import THIS_MACHINE, StationClock
from flightd.ground.schedules.routes import schedule_routes
from flightd.ground.site_page.routes import site_page
from flightd.ground.site_page.simulated_flight import SimulatedFlight
from flightd.ground.stock_page import stock_page
from flightd.ground.store_api.routes import store_routes
from flightd.ground.studio.routes import studio_routes
from flightd.ground.studio.studio import Studio

_NOT_OURS = 1008
"""WebSocket: a message that is against the rules."""
_FULL = 1013
"""WebSocket: try again later."""
_OTHER_ROLE = 4403
"""WebSocket: the person has another role by now; the page comes again."""
_RENEWED_S = 1.0
_TOLD_EACH = 10
"""So often a page is told, in `_RENEWED_S`, when its person's session ends: somebody may set the clock."""


def application(
    hub: Hub,
    hosts: Hosts,
    access: Access,
    people: PagePeople,
    folder: Path | None,
    flights: Flights,
    uploads: ReadingProcess,
    maps: ReadingProcess,
    facts: SiteFacts,
    studio: Studio | None = None,
    simulated: SimulatedFlight | None = None,
    others: Sequence[ReadFolder] = (),
    managers: Managers | None = None,
    store: GroundStore | None = None,
    own_fleet: OwnFleet | None = None,
    clock: StationClock = THIS_MACHINE,
) -> ASGIApp:
    """The whole station as ASGI; `hosts` are the names under which it may be asked, `access` knows who asks,
    `people` who sits at a page, inventories, site files and `flights` lie under `folder`, more inventories
    under the `others`, `uploads` reads what people send, `maps` lays out maps, `facts` say what is worth
    most, `studio` and `simulated` are None without a folder; `managers` fly drones, too; programs ask the
    `store`; `own_fleet` takes tours; schedules go by the `clock`."""
    orders = Orders(hub.drones, access)
    routes = [
        first_page(),
        WebSocketRoute("/live", partial(_live, hub, orders, people)),
        Route("/drones/{drone}/acts", partial(_act, orders), methods=["POST"]),
        *stock_page(folder, hub.drones, uploads, others),
        *site_page(folder, maps, simulated),
        *flight_routes(flights),
        *studio_routes(studio),
        *doctor_routes(hub.drones, access, None if studio is None else studio.shelf),
        *mission_routes(folder, hub.drones, hub.for_each, others),
        *schedule_routes(folder, clock.utc_ns),
        *manager_routes(managers),
        *fleet_routes(own_fleet, hub, access, facts),
        *store_routes(store),
        *guide_routes(),
        *session_routes(access),
        Mount("/static", StaticFiles(directory=STATIC)),
    ]
    return Guard(PackedJson(Starlette(routes=gated(routes, access, people.returning))), hosts)


class _GoneError(Exception):
    """The page's person is not who he was."""

    def __init__(self, code: int, why: str) -> None:
        super().__init__(why)
        self.code = code


async def _live(hub: Hub, orders: Orders, people: PagePeople, socket: WebSocket) -> None:
    """One page, until it closes, says what no page of ours says, or its person is gone (`PagePerson`)."""
    who = identity_of(socket)
    person = people.at(who)
    await socket.accept()
    if person.standing() is Standing.GONE:
        await _send_away(socket, _GoneError(SIGN_IN_FIRST, "the session is over"))
        return
    if hub.is_full:
        await socket.close(_FULL, "too many pages are open")
        return
    with contextlib.suppress(WebSocketDisconnect):  # it is heard of below
        await _say(socket, session_message(person.session_state()))
    async with asyncio.TaskGroup() as acts:  # what was ordered is handed on though its page has gone
        with hub.opened(attends=who.role.covers(Role.OPERATOR)) as browser:
            try:
                async with asyncio.TaskGroup() as tasks:
                    sending = tasks.create_task(_send(browser, socket), name="page out")
                    staying = tasks.create_task(_stay(hub, browser, people, person), name="page's person")
                    try:
                        await _hear(hub, orders, browser, socket, person, acts)
                    finally:
                        sending.cancel()
                        staying.cancel()
            except* WebSocketDisconnect:
                pass  # it is gone: the usual end
            except* InputError as group:
                await _close(socket, _NOT_OURS, str(group.exceptions[0]))
            except* _GoneError as group:
                gone = group.exceptions[0]
                assert isinstance(gone, _GoneError)
                await _send_away(socket, gone)


async def _send_away(socket: WebSocket, gone: _GoneError) -> None:
    if gone.code == SIGN_IN_FIRST:
        with contextlib.suppress(WebSocketDisconnect):
            await _say(socket, session_message(SessionState(login=True)))
    await _close(socket, gone.code, str(gone))


async def _stay(hub: Hub, browser: Browser, people: PagePeople, person: PagePerson) -> None:
    """Tell the page when its person's session ends.  _GoneError once he is gone, or has another role."""
    before = Standing.SIGNED_IN
    for told in count(1):
        await asyncio.sleep(_RENEWED_S)
        now = person.standing()
        if now is Standing.GONE:
            raise _GoneError(SIGN_IN_FIRST, "the session is over")
        if now is Standing.CHANGED:
            raise _GoneError(_OTHER_ROLE, "another role")
        if now is Standing.OVER:
            people.keep(person)
        state = person.session_state()
        if now is not before or (state.ends_in_s is not None and told % _TOLD_EACH == 0):
            browser.offer(("", "session"), session_message(state))
        if now is not before:
            hub.hear(browser, Want(()))
        before = now


async def _send(browser: Browser, socket: WebSocket) -> None:
    """Everything that the page is to see; waits where it does not take it."""
    while True:
        message = await browser.next()
        await _say(socket, message)


async def _say(socket: WebSocket, message: str | bytes) -> None:
    """WebSocketDisconnect where the socket has closed meanwhile: the server does so by itself at a broken
    frame, and tells it here first."""
    try:
        await (socket.send_text(message) if isinstance(message, str) else socket.send_bytes(message))
    except RuntimeError:
        raise WebSocketDisconnect(_NOT_OURS) from None


async def _hear(
    hub: Hub,
    orders: Orders,
    browser: Browser,
    socket: WebSocket,
    person: PagePerson,
    acts: asyncio.TaskGroup,
) -> None:
    """Everything that the page says; pictures are for who is signed in.  WebSocketDisconnect when it closes,
    InputError for nonsense."""
    while True:
        received = await socket.receive()
        if received["type"] == "websocket.disconnect":
            raise WebSocketDisconnect(received.get("code", 1000))
        message = read_page_message(received.get("text") or received.get("bytes") or "")
        if isinstance(message, SentAct):
            browser.begin_act()
            sent = _sent_act(orders, browser, socket, person, message)
            acts.create_task(sent, name=f"act for {message.drone}")
        elif not isinstance(message, Want) or person.standing() is Standing.SIGNED_IN:
            hub.hear(browser, message)


async def _sent_act(
    orders: Orders, browser: Browser, socket: WebSocket, person: PagePerson, sent: SentAct
) -> None:
    who, address = identity_of(socket), address_of(socket.scope)
    over = person.standing() is Standing.OVER
    status, answer = await orders.carried_out(who, address, sent.drone, bytes(sent.act), over)
    browser.answer_act(sent.number, answer_message(sent.number, status, answer))


async def _close(socket: WebSocket, code: int, why: str) -> None:
    with contextlib.suppress(RuntimeError, WebSocketDisconnect):  # it has closed by itself meanwhile
        await socket.close(code, why.encode()[:120].decode(errors="ignore"))


async def _act(orders: Orders, request: Request) -> Response:
    """Hand an act to a drone, as `Orders.carried_out` says."""
    if not is_json(request):
        return as_json({"refused": "an act is JSON"}, 415)
    try:
        body = await json_body(request, "an act")
    except InputError as err:
        return as_json({"refused": str(err)}, status_of(err, 400))
    status, answer = await orders.carried_out(
        identity_of(request), address_of(request.scope), request.path_params["drone"], body
    )
    return as_json(answer, status)
