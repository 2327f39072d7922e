"""Who may do what at a station that asks who somebody is: over HTTP and WebSocket, by cookie and by key."""

from __future__ import annotations

import json
import time
from pathlib import Path

import pytest
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route, Router
from websockets.asyncio.client import connect
from websockets.exceptions import InvalidStatus
from websockets.typing import Origin

from flightd.adapters.ground_link.client import Address
from flightd.core.types import CommandKind
from flightd.ground.access.access import Access
from flightd.ground.access.gate import gated
from flightd.ground.access.people_book import PeopleBook
from flightd.ground.access.roles import Role
from flightd.ground.access.route_roles import RULES
from flightd.ground.application import application
from flightd.ground.fleet.site_facts import SiteFacts
from flightd.ground.flights.flights import Flights
from flightd.ground.ground_store.open_store import opened_store
from flightd.ground.guards import own_hosts
from flightd.ground.hub import Hub
from flightd.ground.page_person import PagePeople
from flightd.ground.reading_process import ReadingProcess
from flightd.ground.studio.studio import Studio
from tests.rigs.event_loops import in_real_time
from tests.rigs.ground_link import address_of, local, serving, telling
from tests.rigs.waiting import until
from tests.web.people_rig import PASSWORD, audited, sign_in, signing_in, with_people
from tests.web.served import JSON, Station, ending, served, told
from tests.web.stock_rig import counted_store

NOBODY = ("demo", Address("127.0.0.1", 1, 1))
ANYBODYS = {
    "GET /", "GET /stock", "GET /stock/{rest:path}", "GET /flights", "GET /flights/{rest:path}", "GET /guide",
    "GET /fleet", "GET /fleet/{rest:path}",
    "GET /site", "GET /site/{rest:path}", "GET /missions", "GET /missions/{rest:path}",
    "GET /studio", "GET /studio/{rest:path}", "GET /doctor", "GET /doctor/{rest:path}",
    "GET /guide/{rest:path}", "MOUNT /static", "GET /api/session", "POST /api/session", "DELETE /api/session",
}  # fmt: skip
"""What nobody has to sign in for: documents and scripts that are the same for all, and the way in."""


def routes_of(tmp_path: Path) -> list[str]:
    """Every route of a station, as the rules name them."""
    access, flights = Access(tmp_path, login=False, secure=False), Flights(tmp_path)
    hub, store = Hub([]), opened_store(str(tmp_path / "store.db"))
    reading = ReadingProcess()
    guard = application(
        hub,
        own_hosts("127.0.0.1", 1),
        access,
        PagePeople(access, hub.drones),
        tmp_path,
        flights,
        reading,
        ReadingProcess(),
        SiteFacts(store, tmp_path, (), reading, time.time_ns),
        Studio(tmp_path, flights),
        store=store,
    )
    access.close()
    store.close()
    found: list[str] = []
    for route in guard._app._app.routes:  # type: ignore[attr-defined]  # noqa: SLF001
        kind = type(route).__name__
        methods = {"Mount": ["MOUNT"], "WebSocketRoute": ["WEBSOCKET"]}.get(kind) or route.methods - {"HEAD"}
        found += [f"{method} {route.path}" for method in methods]
    return found


def test_each_route_has_a_role_and_each_role_a_route(tmp_path: Path) -> None:
    assert set(routes_of(tmp_path)) == set(RULES)
    assert {of for of, rule in RULES.items() if rule.role is None} == ANYBODYS


@pytest.mark.parametrize("methods", [["GET"], ["PUT"], None])
def test_a_route_without_a_role_cannot_be_served(tmp_path: Path, methods: list[str] | None) -> None:
    async def answer(_: Request) -> Response:
        return Response()

    access = Access(tmp_path, login=False, secure=False)
    with pytest.raises(LookupError, match=r"no role is set for|it takes every method"):
        gated([Route("/api/new", answer, methods=methods) if methods else Route("/api/new", Raw())], access)
    with pytest.raises(TypeError, match="no role can be set"):
        gated([Router()], access)  # type: ignore[list-item]
    access.close()


class Raw:
    """An ASGI application, which Starlette hands every method."""

    async def __call__(self, *_: object) -> None: ...


@in_real_time
async def test_nobody_who_has_not_signed_in_is_told_anything(tmp_path: Path) -> None:
    with_people(tmp_path)
    store = opened_store(str(tmp_path / "store.db"))
    async with served(NOBODY, folder=tmp_path, state=tmp_path, login=True, store=store) as station:
        own = {"Origin": station.origin, **JSON}
        for of, rule in RULES.items():
            method, path = of.split(" ")
            if method == "WEBSOCKET":
                continue
            path = path.replace("{", "").replace("}", "").replace(":path", "")
            kind = "GET" if method == "MOUNT" else method
            path += "/x" if method == "MOUNT" else ""
            code, text = await station.ask(kind, path, own, b"{}")
            if rule.role is None:
                assert code not in {401, 403} or of == "POST /api/session", of
            else:
                assert (code, json.loads(text)) == (401, {"refused": "sign in first"}), of
        async with station.page() as page:
            nobody = {"login": True, "name": "", "role": "", "ends_in_s": None, "over": False}
            assert await told(page, "session", "") == nobody
            assert await ending(page) == 4401
        forged = {"Cookie": "flightd-session=x", **own}
        assert (await station.ask("GET", "/api/stock", forged))[0] == 401


@in_real_time
async def test_signing_in_makes_a_cookie_that_no_script_and_no_other_site_has(tmp_path: Path) -> None:
    with_people(tmp_path)
    async with served(NOBODY, folder=tmp_path, state=tmp_path, login=True) as station:
        head, text = await signing_in(station, "Otto")
        session = json.loads(text)
        assert session.pop("ends_in_s") == pytest.approx(43200, abs=30)
        assert session == {"login": True, "name": "otto", "role": "operator", "over": False}
        cookie = next(line for line in head.splitlines() if line.lower().startswith("set-cookie"))
        for word in ("HttpOnly", "SameSite=strict", "Path=/", "Max-Age=46800"):
            assert word.lower() in cookie.lower()
        assert "Domain" not in cookie
        has = {"Cookie": cookie.split(": ")[1].split(";")[0], "Origin": station.origin}
        assert (await station.ask("GET", "/api/stock", has))[0] == 200
        assert json.loads((await station.ask("GET", "/api/session", has))[1])["name"] == "otto"
        async with station.page(additional_headers={"Cookie": has["Cookie"]}) as page:
            assert (await told(page, "session", ""))["name"] == "otto"
            head, _ = await station.answer("DELETE", "/api/session", has)
            assert "max-age=0" in head.lower()
            assert "clear-site-data" in head.lower()
            assert await ending(page) == 4401, "its open pages end with the session"
        assert (await station.ask("GET", "/api/stock", has))[0] == 401
        for name, password in (("otto", "another horse"), ("none", PASSWORD), ("program-viewer", PASSWORD)):
            head, text = await signing_in(station, name, password)
            assert (" 401 " in head, json.loads(text)) == (True, {"refused": "name or password is wrong"})
        for _ in range(4):
            head, text = await signing_in(station, "vera", "wrong")
        assert " 401 " in head
        head, text = await signing_in(station, "vera")
        assert " 429 " in head, "not even the right one"
        assert "retry-after: " in head.lower()
        assert "try again in" in json.loads(text)["refused"]
        foreign = {"Origin": "http://evil.example", **JSON}
        said = json.dumps({"name": "ada", "password": PASSWORD}).encode()
        assert (await station.ask("POST", "/api/session", foreign, said))[0] == 403
        plain = {"Origin": station.origin, "Content-Type": "text/plain"}
        assert (await station.ask("POST", "/api/session", plain, said))[0] == 415
    acts = [(line["act"], line["target"], line["outcome"]) for line in audited(tmp_path)]
    assert acts[:3] == [
        ("sign in", "otto", "accepted"),
        ("sign out", "otto", "accepted"),
        ("sign in", "otto", "refused"),
    ]
    assert ("sign in", "(unknown)", "refused") in acts
    assert "another horse" not in (tmp_path / "audit.jsonl").read_text()


async def orders(station: Station, role: Role, keys: dict[Role, str], command: str) -> int:
    """The status of an order that a program of this role gives by its key."""
    headers = {"Authorization": f"Bearer {keys[role]}", **JSON}
    act = {"id": f"{command}-by-{role}", "command": command}
    if command == "goto":
        act["node"] = "A2"
    return (await station.act("demo", headers, **act))[0]


@in_real_time
async def test_a_viewer_may_stop_and_pause_and_nothing_else_that_moves(tmp_path: Path) -> None:
    keys = with_people(tmp_path)
    async with (
        serving(local()) as link,
        served(("demo", address_of(link)), state=tmp_path, login=True) as station,
        telling(link),
    ):
        await until(lambda: link.requests > 2)
        for command in CommandKind:
            code = await orders(station, Role.VIEWER, keys, command)
            assert (code == 403) == (command not in {CommandKind.STOP, CommandKind.PAUSE}), command
        assert {one.kind for one in link.take_commands()} <= {CommandKind.STOP, CommandKind.PAUSE}
        assert await orders(station, Role.OPERATOR, keys, "land") == 200
        assert [one.kind for one in link.take_commands()] == [CommandKind.LAND]
        cookie = await sign_in(station, "vera")
        async with station.page(additional_headers={"Cookie": cookie}) as page:
            for ordered, status in (("home", 403), ("stop", 200)):
                act = {"id": f"{ordered}-by-vera", "command": ordered}
                await page.send(json.dumps({"say": "act", "number": 1, "drone": "demo", "act": act}))
                assert (await told(page, "answer", ""))["status"] == status
        assert [one.kind for one in link.take_commands()] == [CommandKind.STOP]
    lines = audited(tmp_path)
    last = lines[-1]
    assert (last["person"], last["role"], last["by"]) == ("vera", "viewer", "password")
    assert (last["act"], last["target"], last["outcome"]) == ("stop", "demo", "accepted")
    assert last["id"] == "stop-by-vera"
    refused = next(line for line in lines if line["act"] == "home" and line["person"] == "vera")
    assert (refused["outcome"], "needs the role operator" in refused["text"]) == ("refused", True)


@in_real_time
async def test_a_viewers_page_is_no_ground_for_the_flight_and_an_operators_is(tmp_path: Path) -> None:
    with_people(tmp_path)
    async with (
        serving(local()) as link,
        served(("demo", address_of(link)), state=tmp_path, login=True) as station,
        telling(link),
    ):
        for name, attends in (("vera", False), ("otto", True)):
            cookie = await sign_in(station, name)
            async with station.page(additional_headers={"Cookie": cookie}) as page:
                state = await told(page, "link")
                for _ in range(3):
                    state = await told(page, "link")
                assert state["attends"] is attends, name


@in_real_time
async def test_another_role_holds_on_open_pages_within_seconds(tmp_path: Path) -> None:
    with_people(tmp_path)
    async with (
        serving(local()) as link,
        served(("demo", address_of(link)), state=tmp_path, login=True) as station,
        telling(link),
    ):
        await until(lambda: link.requests > 2)
        cookie = await sign_in(station, "otto")
        async with station.page(additional_headers={"Cookie": cookie}) as page:
            PeopleBook(tmp_path).set_role("otto", Role.VIEWER)
            assert await ending(page) == 4403
        own = {"Cookie": cookie, "Origin": station.origin, **JSON}
        assert (await station.act("demo", own, id="land-by-otto", command="land"))[0] == 403
        assert link.take_commands() == []


@in_real_time
async def test_only_an_admin_reads_the_audit_and_each_change_is_a_line(tmp_path: Path) -> None:
    keys = with_people(tmp_path)
    async with served(NOBODY, folder=tmp_path, state=tmp_path, login=True) as station:
        for role in Role:
            bears = {"Authorization": f"Bearer {keys[role]}"}
            code, text = await station.ask("GET", "/api/audit", bears)
            assert code == (200 if role is Role.ADMIN else 403)
        for role, status in ((Role.VIEWER, 403), (Role.OPERATOR, 400)):
            bears = {"Authorization": f"Bearer {keys[role]}", **JSON}
            assert (await station.ask("POST", "/api/stock/decisions?store=x", bears, b"{}"))[0] == status
        bears = {"Authorization": f"Bearer {keys[Role.ADMIN]}"}
        await until(lambda: len(audited(tmp_path)) == 2)
        _, text = await station.ask("GET", "/api/audit", bears)
        seen = [
            (one["person"], one["act"], one["target"], one["outcome"]) for one in json.loads(text)["entries"]
        ]
        assert seen == [
            ("program-viewer", "POST", "/api/stock/decisions", "refused"),
            ("program-operator", "POST", "/api/stock/decisions", "refused"),
        ]
        assert (await station.ask("GET", "/api/stock", {"Authorization": "Bearer none"}))[0] == 401


@in_real_time
async def test_a_decision_bears_the_name_of_whoever_is_signed_in_whatever_was_typed(tmp_path: Path) -> None:
    keys = with_people(tmp_path)
    counted_store(tmp_path / "monday")
    async with served(NOBODY, folder=tmp_path, state=tmp_path, login=True) as station:
        said = {"place": "AL-02-2-1", "what": "looking", "who": "ada", "seen_s": 2e9}
        senders: tuple[tuple[dict[str, str], int], ...] = (
            ({"Cookie": await sign_in(station, "otto"), "Origin": station.origin}, 200),
            ({"Cookie": await sign_in(station, "vera"), "Origin": station.origin}, 403),
            ({"Authorization": f"Bearer {keys[Role.OPERATOR]}"}, 200),
        )
        for number, (headers, status) in enumerate(senders):
            body = json.dumps({"id": f"decision-{number}", **said}).encode()
            way = "/api/stock/decisions?store=monday"
            code, text = await station.ask("POST", way, {**headers, **JSON}, body)
            assert code == status, text
            if code == 200:
                assert json.loads(text)["who"] in {"otto", "program-operator"}
        bears = {"Authorization": f"Bearer {keys[Role.VIEWER]}"}
        _, text = await station.ask("GET", "/api/stock/decisions?store=monday", bears)
        assert {one["who"] for one in json.loads(text)["decisions"]} == {"otto", "program-operator"}
    lines = [line for line in audited(tmp_path) if line["target"] == "/api/stock/decisions"]
    assert [(line["person"], line["outcome"]) for line in lines] == [
        ("otto", "accepted"),
        ("vera", "refused"),
        ("program-operator", "accepted"),
    ]
    assert lines[0]["text"] == "looking at AL-02-2-1; HTTP 200"


@in_real_time
async def test_a_program_needs_no_origin_and_a_foreign_one_is_always_refused(
    tmp_path: Path,
) -> None:
    keys = with_people(tmp_path)
    async with served(NOBODY, state=tmp_path, login=True) as station:
        url = station.origin.replace("http", "ws") + "/live"
        bears = {"Authorization": f"Bearer {keys[Role.VIEWER]}"}
        async with connect(url, additional_headers=bears, proxy=None) as page:
            assert (await told(page, "session", ""))["name"] == "program-viewer"
        for headers, origin in (
            (bears, Origin("http://evil.example")),
            ({"Authorization": "Bearer none"}, None),
            ({}, None),
        ):
            with pytest.raises(InvalidStatus, match="403"):
                await connect(url, additional_headers=headers, origin=origin, proxy=None)
        cookie = await sign_in(station, "ada")
        with pytest.raises(InvalidStatus, match="403"):
            await connect(
                url, additional_headers={"Cookie": cookie}, origin=Origin("http://evil.example"), proxy=None
            )


@in_real_time
async def test_on_this_machine_nobody_is_asked_and_acts_are_written_down_all_the_same(tmp_path: Path) -> None:
    async with serving(local()) as link, served(("demo", address_of(link)), state=tmp_path) as station:
        await until(lambda: link.requests > 2)
        async with telling(link), station.page() as page:
            local_one = {
                "login": False,
                "name": "local",
                "role": "admin",
                "ends_in_s": None,
                "over": False,
            }
            assert await told(page, "session", "") == local_one
            await told(page, "status")
            assert (await station.act("demo", id="the-only-pause", command="pause"))[0] == 200
        head, _ = await signing_in(station, "otto")
        assert " 409 " in head
    (line,) = audited(tmp_path)
    assert (line["person"], line["act"], line["address"]) == ("local", "pause", "127.0.0.1")
