"""The station between a real ground link and pages: what is told, what is commanded, who may do neither."""

from __future__ import annotations

import asyncio
import contextlib
import json
import socket
import time
from collections.abc import AsyncIterator, Sequence
from typing import Any

import pytest
import zmq
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidStatus

from flightd.adapters.ground_link.client import Address
from flightd.core.preview import CameraName, FoundLine, Preview
from flightd.core.types import CommandKind, Phase
from flightd.ground.drone_link import MOST_ACTS
from flightd.ground.guards import HEADERS
from flightd.ground.hub import MOST_BROWSERS
from flightd.runtime.clock import LoopClock
from flightd.runtime.free_ports import free_port
from flightd.runtime.within import Within
from tests.rigs.event_loops import in_real_time
from tests.rigs.ground_link import Keyring, address_of, event, local, serving, tell_once, telling
from tests.rigs.waiting import until
from tests.web.served import JSON, Station, pictured, served, told, until_told

NOBODY = Address("127.0.0.1", 1, 1)


def silent_s(link: object) -> float:
    return link.silent_s(LoopClock().now_ns())  # type: ignore[attr-defined, no-any-return]


@in_real_time
async def test_a_page_is_told_all_that_the_link_says_and_its_acts_reach_the_flight() -> None:
    async with serving(local()) as link, served(("demo", address_of(link))) as station:
        link.event(event("before the page came"))
        async with telling(link), station.page() as page:
            welcome = await told(page, "welcome")
            assert (welcome["floor"]["name"], welcome["role"]) == ("demo", "operator")
            assert len(welcome["floor"]["racks"]) == 4
            while not (events := await told(page, "events")):
                pass  # the station itself may hear of it after the page has come
            assert [heard["text"] for heard in events] == ["before the page came"]
            status = await told(page, "status")
            assert (status["phase"], status["goal"]) == ("follow", "A2")
            assert "pause" in status["possible"]
            assert (await station.act("demo", id="the-only-pause", command="pause"))[0] == 200
            code, text = await station.act("demo", id="the-only-pause", command="pause")
            assert (code, json.loads(text)) == (200, {"accepted": True, "repeated": True})
            code, text = await station.act("demo", id="to-nowhere", command="goto", node="Z9")
            assert code == 409
            assert "no node 'Z9'" in text
            link.event(event("look out"))
            await until(lambda: link.requests > 5)
            assert (await told(page, "events"))[-1]["text"] == "look out"
        assert [command.kind for command in link.take_commands()] == [CommandKind.PAUSE]


@pytest.mark.parametrize("live", [False, True])
@in_real_time
async def test_the_nodes_that_are_told_as_visited_are_those_of_the_newest_flight(live: bool) -> None:
    begins = event("preflight -> arming: started", name="phase")
    first = (begins, event("A2", name="visited"), event("follow -> hover: there", name="phase"))
    swapped = event("swap -> arming: a fresh battery", name="phase")
    second = (begins, event("A3", name="visited"), swapped, event("A4", name="visited"))
    async with serving(local()) as link, contextlib.AsyncExitStack() as stack:
        for one in () if live else (*first, *second):
            link.event(one)
        station = await stack.enter_async_context(served(("demo", address_of(link))))
        await stack.enter_async_context(telling(link))
        page = await stack.enter_async_context(station.page())
        if live:
            await told(page, "status")
            for one in (*first, *second):
                link.event(one)
        while (visited := await told(page, "visited")) != ["A3", "A4"]:
            assert visited in ([], ["A2"], ["A3"])


async def answered(page: ClientConnection, number: int, act: object, drone: str = "demo") -> dict[str, Any]:
    """What the station answers to an act that the page sends over its WebSocket."""
    await page.send(json.dumps({"say": "act", "number": number, "drone": drone, "act": act}))
    answer = await told(page, "answer", "")
    assert answer.pop("number") == number
    return answer  # type: ignore[no-any-return]


@in_real_time
async def test_an_act_over_the_socket_is_checked_and_answered_as_by_post_and_done_once_over_both() -> None:
    async with (
        serving(local()) as link,
        served(("demo", address_of(link))) as station,
        telling(link),
        station.page() as page,
    ):
        await told(page, "status")
        pause = {"id": "the-only-pause", "command": "pause"}
        assert await answered(page, 1, pause) == {"status": 200, "accepted": True, "repeated": False}
        code, text = await station.act("demo", None, **pause)
        assert (code, json.loads(text)) == (200, {"accepted": True, "repeated": True})
        assert (await answered(page, 2, pause))["repeated"]
        for number, act in enumerate(
            (
                {"id": "to-nowhere", "command": "goto", "node": "Z9"},
                {"id": "12345678", "command": "goto"},
                {"id": "short", "command": "land"},
                {"id": "12345678", "command": "fly"},
                ["land"],
            ),
            start=3,
        ):
            code, text = await station.ask(
                "POST", "/drones/demo/acts", {"Origin": station.origin, **JSON}, json.dumps(act).encode()
            )
            assert await answered(page, number, act) == {"status": code, **json.loads(text)}
        assert (await answered(page, 9, pause, "nobody"))["status"] == 404
        assert [command.kind for command in link.take_commands()] == [CommandKind.PAUSE]


@in_real_time
async def test_a_stop_is_handed_on_though_its_page_goes_at_once() -> None:
    async with serving(local()) as link, served(("demo", address_of(link))) as station, telling(link):
        await until(lambda: link.requests > 2)
        async with station.page() as page:
            act = {"id": "the-only-stop", "command": "stop"}
            await page.send(json.dumps({"say": "act", "number": 1, "drone": "demo", "act": act}))
        ordered: list[CommandKind] = []

        def came() -> bool:
            ordered.extend(command.kind for command in link.take_commands())
            return bool(ordered)

        await until(came)
        assert ordered == [CommandKind.STOP]


@in_real_time
async def test_a_page_that_orders_more_than_a_person_can_is_closed() -> None:
    async with served(("demo", NOBODY)) as station, station.page() as page:
        act = {"id": "12345678", "command": "land"}
        sent = json.dumps({"say": "act", "number": 1, "drone": "demo", "act": act})
        with pytest.raises(ConnectionClosed, match="wait for their answer"):
            await flood(page, sent)


async def flood(page: ClientConnection, message: str) -> None:
    """Send it again and again, and read nothing."""
    async with Within(20):
        while True:
            await page.send(message)


@in_real_time
async def test_only_an_open_page_attends_and_closing_it_is_losing_the_ground() -> None:
    async with serving(local()) as link, served(("demo", address_of(link))) as station, telling(link):
        await until(lambda: link.requests > 4)
        assert silent_s(link) == 0.0, "it measures the way, and attends nothing"
        async with station.page() as page:
            await until(lambda: silent_s(link) > 0.0)
            async with Within(20):
                while not (await told(page, "link"))["attends"]:
                    pass
            async with station.page():
                pass
            await asyncio.sleep(1.2)
            assert silent_s(link) < 1.1, "one page is open still"
        await until(lambda: silent_s(link) > 2.0)


@contextlib.asynccontextmanager
async def stalled_page(station: Station) -> AsyncIterator[None]:
    """A page that opens its WebSocket and never reads from it."""
    host, port = station.where.host, station.where.port
    lines = (
        "GET /live HTTP/1.1", f"Host: {host}:{port}", f"Origin: {station.origin}", "Connection: Upgrade",
        "Upgrade: websocket", "Sec-WebSocket-Version: 13",
        "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==", "", "",
    )  # fmt: skip
    hung = socket.socket()
    with hung:
        hung.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        hung.setblocking(False)
        loop = asyncio.get_running_loop()
        await loop.sock_connect(hung, (host, port))
        await loop.sock_sendall(hung, "\r\n".join(lines).encode())
        assert (await loop.sock_recv(hung, 32)).startswith(b"HTTP/1.1 101")
        yield


@in_real_time
async def test_stalled_pages_delay_no_other() -> None:
    async with (
        serving(local()) as link,
        served(("demo", address_of(link))) as station,
        telling(link),
        station.page() as quick,
        stalled_page(station),
        stalled_page(station),
    ):
        await until_told(quick, "station", "browsers", 3)
        gaps, last_s = [], time.monotonic()
        for _ in range(150):
            await told(quick, "status")
            gaps.append(time.monotonic() - last_s)
            last_s = time.monotonic()
        assert sorted(gaps)[len(gaps) // 2] < 0.2, "fifty a second are told"


@in_real_time
async def test_a_page_that_hangs_does_not_count_as_one_that_attends() -> None:
    """Whoever closes his laptop is lost like whoever closes the page, though much waits for him still."""
    async with (
        serving(local()) as link,
        served(("demo", address_of(link)), send_buffer=16_384) as station,
        telling(link),
        stalled_page(station),
    ):
        await until(lambda: silent_s(link) > 0.0)
        await until(lambda: silent_s(link) > 2.0, 60.0)
        async with station.page() as page:
            await until_told(page, "station", "browsers", 1)


@in_real_time
async def test_pictures_are_fetched_as_long_as_a_page_draws_them() -> None:
    async with serving(local(picture_fps=10)) as link, served(("demo", address_of(link))) as station:
        await until(lambda: link.requests > 2)
        async with telling(link), station.page() as page:
            await told(page, "status")
            assert link.pictures_wanted == 0, "nobody shows any"
            await page.send('{"say":"want","pictures":[{"drone":"demo","camera":"down"}]}')
            await until(lambda: link.pictures_wanted == 1)
            seen = FoundLine(((0.1, 0.2), (0.3, 0.4)), 0.01)
            now_ns = LoopClock().now_ns()
            assert link.picture_due(now_ns)
            link.picture(Preview(CameraName.DOWN, 7, now_ns, b"jpeg", (seen,)))
            head, jpeg = await pictured(page)
            assert (head["drone"], head["camera"], head["seq"], jpeg) == ("demo", "down", 7, b"jpeg")
            assert head["lines"] == [{"points": [[0.1, 0.2], [0.3, 0.4]], "width": 0.01}]
            assert 0.0 <= head["age_ms"] < 5000.0
            await asyncio.sleep(0.3)
            assert link.pictures_wanted == 0, "the last one is not drawn yet"
            await page.send('{"say":"drawn"}')
            await until(lambda: link.pictures_wanted == 1)


@in_real_time
async def test_a_drone_that_nobody_flies_is_said_to_be_unheard_and_heard_when_it_comes() -> None:
    async with serving(local()) as first:
        address = address_of(first)
    nowhere = Address("no.such.host.invalid")
    async with served(("demo", address), ("away", nowhere)) as station, station.page() as page:
        async with Within(20):
            while "nobody listens" not in (await told(page, "link"))["trouble"]:
                pass
            while "this name is not known here" not in (await told(page, "link", "away"))["trouble"]:
                pass
        code, text = await station.act("demo", id="12345678", command="stop")
        assert code == 503
        assert "cannot be reached" in text
        ports = {"status_port": address.status_port, "command_port": address.command_port}
        async with serving(local().model_copy(update=ports)) as link, telling(link):
            assert (await told(page, "welcome"))["floor"]["name"] == "demo"
            session = (await told(page, "status"))["session"]
        async with serving(local().model_copy(update=ports)) as link, telling(link, Phase.LAND):
            async with Within(20):
                while (status := await told(page, "status"))["session"] == session:
                    pass
            assert status["phase"] == "land"


@in_real_time
async def test_no_page_of_another_site_makes_the_station_work() -> None:
    """A picture or a link in it sends no Origin."""
    async with served(("demo", NOBODY)) as station:
        for site, code in {"cross-site": 403, "same-site": 403, "same-origin": 200, "none": 200}.items():
            for path in ("/api/flights", "/api/stock", "/api/guide"):
                assert (await station.ask("GET", path, {"Sec-Fetch-Site": site}))[0] == code, (site, path)
        assert (await station.ask("GET", "/", {"Sec-Fetch-Site": "cross-site"}))[0] == 200, "a link to it"


@in_real_time
async def test_two_drones_are_told_and_commanded_apart() -> None:
    async with (
        serving(local()) as a,
        serving(local()) as b,
        served(("a", address_of(a)), ("b", address_of(b))) as station,
        station.page() as page,
        telling(a, Phase.FOLLOW),
        telling(b, Phase.HOVER),
    ):
        assert (await told(page, "status", "a"))["phase"] == "follow"
        assert (await told(page, "status", "b"))["phase"] == "hover"
        assert (await station.act("b", id="12345678", command="land"))[0] == 200
        assert [command.kind for command in b.take_commands()] == [CommandKind.LAND]
        assert a.take_commands() == []
        assert (await station.act("c", id="12345678", command="land"))[0] == 404


@in_real_time
async def test_a_viewers_station_shows_and_neither_attends_nor_commands(
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    keyring = Keyring.make(tmp_path_factory.mktemp("keys"))
    async with (
        serving(keyring.config()) as link,
        served(("demo", keyring.address(link, "viewer"))) as station,
        telling(link),
        station.page() as page,
    ):
        assert (await told(page, "welcome"))["role"] == "viewer"
        await told(page, "status")
        code, text = await station.act("demo", id="12345678", command="land")
        assert code == 409
        assert "viewer" in text
        await asyncio.sleep(1.0)
        assert silent_s(link) == 0.0


@in_real_time
async def test_a_stop_passes_acts_that_wait_for_an_answer() -> None:
    async with serving(local()) as link:
        address = address_of(link)
        tell_once(link)
        async with served(("demo", address)) as station:
            await until(lambda: link.requests > 2)
            asked: list[Sequence[zmq.Frame]] = []
            running = link._take  # noqa: SLF001 - a daemon that hangs: it takes requests and answers none
            link._take = asked.append  # type: ignore[method-assign, assignment]  # noqa: SLF001
            acts = [
                asyncio.ensure_future(station.act("demo", id=f"pause-{i:04}", command="pause"))
                for i in range(MOST_ACTS + 4)
            ]
            done, _ = await asyncio.wait(acts, return_when=asyncio.FIRST_COMPLETED)
            code, text = done.pop().result()
            assert code == 409
            assert f"{MOST_ACTS} acts wait" in text
            stop = asyncio.ensure_future(station.act("demo", id="the-only-stop", command="stop"))
            await until(lambda: any(b"the-only-stop" in frames[-1].bytes for frames in asked))
            link._take = running  # type: ignore[method-assign]  # noqa: SLF001
            assert (await stop)[0] == 200
            await asyncio.wait(acts)
        assert CommandKind.STOP in {command.kind for command in link.take_commands()}


@in_real_time
async def test_another_origin_can_neither_read_nor_command() -> None:
    async with serving(local()) as link, served(("demo", address_of(link))) as station, telling(link):
        await until(lambda: link.requests > 2)
        act = {"id": "12345678", "command": "land"}
        own, port = station.origin, station.where.port
        strange = [
            {"Origin": "http://evil.example", **JSON},
            {"Origin": "null", **JSON},
            {"Origin": own.replace(str(port), "1"), **JSON},
            {"Origin": own.replace("http:", "https:"), **JSON},
            {"Origin": own, "Sec-Fetch-Site": "cross-site", **JSON},
            {"Origin": own, "Sec-Fetch-Site": "same-site", **JSON},
            JSON,
            {"Origin": "http://evil.example", "Host": "evil.example", **JSON},
            {"Origin": f"http://evil.example:{port}", "Host": f"evil.example:{port}", **JSON},
        ]
        for headers in strange:
            assert (await station.act("demo", headers, **act))[0] == 403, headers
        assert (await station.act("demo", {"Origin": own, "Content-Type": "text/plain"}, **act))[0] == 415
        assert (await station.act("demo", {"Origin": own}, **act))[0] == 415
        assert (await station.ask("OPTIONS", "/drones/demo/acts", {"Origin": "http://evil.example"}))[
            0
        ] == 403
        assert (await station.ask("GET", "/", {"Origin": "http://evil.example"}))[0] == 403
        assert (await station.ask("GET", "/", {"Host": f"evil.example:{port}"}))[0] == 403
        assert (await station.ask("GET", "/drones/demo/acts"))[0] == 405
        for origin in ("http://evil.example", None):
            with pytest.raises(InvalidStatus, match="403"):
                await connect(own.replace("http", "ws") + "/live", origin=origin, proxy=None)  # type: ignore[arg-type]
        assert link.take_commands() == []
        head, _ = await station.answer("GET", "/")
        assert "access-control" not in head.lower()


@in_real_time
async def test_every_answer_forbids_what_is_not_our_own_and_the_page_holds_nothing_inline() -> None:
    async with served(("demo", NOBODY)) as station:
        for path in (
            "/",
            "/stock",
            "/stock/below",
            "/api/stock",
            "/static/app/main.js",
            "/static/none.js",
            "/nowhere",
            "/static/../server.py",
        ):
            head, _ = await station.answer("GET", path)
            for name, value in HEADERS.items():
                assert f"{name}: {value}".lower() in head.lower(), (path, name)
        policy = HEADERS["Content-Security-Policy"]
        assert "unsafe" not in policy
        assert "default-src 'none'" in policy
        _, page = await station.answer("GET", "/")
        assert (await station.answer("GET", "/stock"))[1] == page, "one document for every page"
        assert "style=" not in page
        assert page.count("<script") == page.count('<script type="module" src="/static/')


@in_real_time
async def test_more_pages_than_it_can_serve_are_turned_away() -> None:
    async with served(("demo", NOBODY)) as station, contextlib.AsyncExitStack() as pages:
        for _ in range(MOST_BROWSERS):
            await pages.enter_async_context(stalled_page(station))
        async with station.page() as late:
            with pytest.raises(ConnectionClosed, match="too many pages"):
                await late.recv()


@in_real_time
async def test_a_taken_port_is_named() -> None:
    from flightd.core.errors import UnavailableError
    from flightd.ground.server import Listening, opened

    async with served(("demo", NOBODY)) as station:
        with pytest.raises(
            UnavailableError, match=rf"{station.where.port}: Address already in use; give --listen"
        ):
            opened(Listening("127.0.0.1", station.where.port))
    assert free_port(socket.SOCK_STREAM)
