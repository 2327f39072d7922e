"""What the page Stock asks of the station: answered from what lies under its folder alone."""

from __future__ import annotations

import asyncio
import gzip
import json
import os
import shutil
import threading
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest

from flightd.adapters.ground_link.client import Address
from flightd.adapters.ground_link.link import ZmqGround
from flightd.adapters.store.sqlite import SqliteStore
from flightd.core.errors import UnavailableError
from flightd.core.inventory import LocationState, PlannedLocation
from flightd.ground import expected_stock_book, uploaded_comparison
from flightd.ground.access.roles import Role
from flightd.ground.bounded import Shared, Threads
from flightd.ground.decision_book import Decided, Decision, DecisionBook
from flightd.ground.expected_stock_book import MOST_UPLOADS, ExpectedStock, ExpectedStockBook
from flightd.inventory.stock_columns import StockColumns
from flightd.inventory.stock_table import MOST_BYTES
from flightd.runtime.clock import LoopClock
from flightd.runtime.within import Within
from tests.rigs.event_loops import in_real_time
from tests.rigs.ground_link import SITE, address_of, local, serving
from tests.rigs.waiting import until
from tests.web.people_rig import audited, with_people
from tests.web.served import Station, served
from tests.web.stock_rig import RACKS, SSCC, counted_store, flown_log, look

NOBODY = ("demo", Address("127.0.0.1", 1, 1))
UPLOAD = {"Content-Type": "application/octet-stream"}
BOOKS = f"place,code\nAL-01-1-1,{SSCC}\n".encode()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    counted_store(tmp_path / "hall" / "monday")
    return tmp_path / "hall"


async def got(station: Station, way: str) -> tuple[int, Any]:
    code, text = await station.ask("GET", f"/api/stock{way}")
    return code, json.loads(text)


async def posted(station: Station, way: str, body: bytes, **headers: str) -> tuple[int, Any]:
    code, text = await station.ask(
        "POST", f"/api/stock{way}", {"Origin": station.origin, **UPLOAD, **headers}, body
    )
    return code, json.loads(text) if text.startswith("{") else text


@in_real_time
async def test_stores_are_found_newest_first_and_named_by_their_path(folder: Path) -> None:
    shutil.copytree(folder / "monday", folder / "week" / "tuesday")
    (folder / ".hidden").symlink_to(folder / "monday")
    (folder / "link").symlink_to(folder / "monday")
    os.utime(folder / "monday" / "inventory.db", ns=(1, 1))
    async with served(NOBODY, folder=folder) as station:
        code, told = await got(station, "")
        assert (code, told["folder"], told["drones"]) == (200, "hall", ["demo"])
        assert [store["name"] for store in told["stores"]] == ["week/tuesday", "monday"]
    async with served(NOBODY) as station:
        assert (await got(station, ""))[1] == {"folder": "", "stores": [], "drones": ["demo"]}
        assert (await got(station, "/places?store=monday"))[0] == 404


@in_real_time
async def test_places_are_told_again_only_when_something_has_changed(folder: Path) -> None:
    async with served(NOBODY, folder=folder) as station:
        head, text = await station.answer("GET", "/api/stock/places?store=monday")
        tag = next(line for line in head.splitlines() if line.lower().startswith("etag")).split(" ")[1]
        assert json.loads(text)["places"]["AL-01-1-1"]["texts"] == [f"00{SSCC}"]
        asked = {"If-None-Match": tag}
        assert (await station.ask("GET", "/api/stock/places?store=monday", asked))[0] == 304
        with SqliteStore(folder / "monday") as store:
            store.commit(look("BL-01-1-2", LocationState.EMPTY, at_s=60))
            code, text = await station.ask("GET", "/api/stock/places?store=monday", asked)
        assert (code, json.loads(text)["places"]["BL-01-1-2"]["state"]) == (200, "empty")


@in_real_time
async def test_a_flight_log_beside_a_store_says_where_its_places_are(folder: Path) -> None:
    with SqliteStore(folder / "monday") as store:
        store.plan(PlannedLocation(place.code, place.node) for place in RACKS.locations.values())
    (folder / "monday" / "flight.mcap").write_bytes(b"no log yet")
    async with served(NOBODY, folder=folder) as station:
        _, told = await got(station, "/places?store=monday")
        assert [(front["aisle"], front["side"]) for front in told["fronts"]][:2] == [("AL", ""), ("AR", "")]
        flown_log(folder / "monday" / "flight.mcap", RACKS)
        with SqliteStore(folder / "monday") as store:
            store.commit(look("BR-04-2-1", LocationState.EMPTY, at_s=60))
        _, told = await got(station, "/places?store=monday")
        fronts = {(front["aisle"], front["side"]): front for front in told["fronts"]}
        assert fronts["A", "right"]["mirrored"]
        assert [len(front["spots"]) for front in fronts.values()] == [16, 8, 8, 16, 1]


@in_real_time
async def test_what_a_drone_has_counted_is_asked_over_its_link() -> None:
    told = (
        {"location": "AL-01-1-1", "state": "read", "standing": "pending", "texts": "PAL-7", "node": "A1"},
    )
    with ZmqGround(local(), SITE, LoopClock(), inventory=lambda: told) as link:
        async with asyncio.TaskGroup() as tasks:
            running = tasks.create_task(link.run())
            async with served(("demo", address_of(link))) as station:
                await until(lambda: link.requests > 2)
                code, places = await got(station, "/places?drone=demo")
                assert (code, places["places"]["AL-01-1-1"]["state"]) == (200, "read")
                assert places["places"]["AL-01-1-1"]["pending"]
                assert (await got(station, "/find?drone=demo&text=pal-7"))[1] == {"found": ["AL-01-1-1"]}
                code, told_no = await posted(station, "/compare?drone=demo", BOOKS)
                assert (code, told_no["refused"]) == (400, "there is no inventory ''")
            running.cancel()
    async with serving(local()) as link, served(("demo", address_of(link))) as station:
        await until(lambda: link.requests > 2)
        code, places = await got(station, "/places?drone=demo")
        assert code >= 400
        assert "keeps no inventory" in places["refused"]


@pytest.mark.parametrize(
    "way",
    [
        "/places?store=", "/places?store=..", "/places?store=/etc", "/places?store=monday/../monday",
        "/places", "/places?store=monday%00", "/places?drone=other", "/place?store=monday&code=none",
        "/place?store=monday",
        "/picture?store=monday&name=../../inventory.db", f"/picture?store=monday&name={'a' * 64}",
        f"/picture?store=monday&name={'A' * 64}", "/picture?store=monday&name=", "/export?store=monday",
        "/export?store=monday&format=exe", f"/find?store=monday&text={'x' * 201}",
        f"/outlines?store=monday&name={'a' * 64}",
    ],
)  # fmt: skip
@in_real_time
async def test_what_is_not_there_is_refused_in_words(folder: Path, way: str) -> None:
    async with served(NOBODY, folder=folder) as station:
        code, told = await got(station, way)
        assert code == 404
        assert told["refused"]
        assert str(folder) not in told["refused"]


@in_real_time
async def test_a_damaged_store_is_named_and_the_others_are_shown(folder: Path) -> None:
    (folder / "broken").mkdir()
    (folder / "broken" / "inventory.db").write_bytes(b"nothing of ours" * 300)
    async with served(NOBODY, folder=folder) as station:
        code, told = await got(station, "/places?store=broken")
        assert code == 404
        assert "no inventory, or a damaged one" in told["refused"]
        assert (await got(station, "/places?store=monday"))[0] == 200


@in_real_time
async def test_a_code_is_found_in_any_notation(folder: Path) -> None:
    async with served(NOBODY, folder=folder) as station:
        for text, places in {
            f"(00){SSCC}": ["AL-01-1-1"], f"https://id.gs1.org/00/{SSCC}": ["AL-01-1-1"],
            "04006381333931": ["AL-01-2-1"], "pal-7": ["AL-03-2-1"], "bl-01-1-2": ["BL-01-1-2"],
            "BL-": ["BL-01-1-1", "BL-01-1-2"], "nothing": [], " ": [],
        }.items():  # fmt: skip
            code, told = await got(station, f"/find?store=monday&text={quote(text)}")
            assert (code, told["found"]) == (200, places), text


@in_real_time
async def test_an_upload_needs_our_own_page_and_stays_within_bounds(folder: Path) -> None:
    async with served(NOBODY, folder=folder) as station:
        way = "/compare?store=monday"
        code, told = await posted(station, way, BOOKS)
        assert (code, told["outcome_counts"]["match"], told["rows"]) == (200, 1, 1)
        for headers in ({"Origin": "http://evil.example"}, {"Sec-Fetch-Site": "cross-site"}):
            assert (await posted(station, way, BOOKS, **headers))[0] == 403
        assert (await station.ask("POST", f"/api/stock{way}", UPLOAD, BOOKS))[0] == 403, "no Origin"
        assert (await posted(station, way, BOOKS, **{"Content-Type": "text/csv"}))[0] == 415
        assert (await posted(station, "/compare?store=none", BOOKS))[0] == 400
        code, told = await posted(station, way, b"x" * (MOST_BYTES + 1))
        assert (code, told["refused"]) == (400, "the file has more than 8 MB")
        for columns in (
            "place=0&code=0",
            "place=9&code=1",
            "place=-1&code=1",
            "place=x&code=1",
            "place=0&code=",
        ):
            assert (await posted(station, f"{way}&{columns}&heading=yes", BOOKS))[0] == 400, columns
        code, told = await posted(station, f"{way}&format=exe", BOOKS)
        assert (code, told["refused"]) == (400, "no format is called 'exe'; choose one of csv, json")
        head, _ = await station.answer(
            "POST", f"/api/stock{way}&format=csv", {"Origin": station.origin, **UPLOAD}, BOOKS
        )
        assert 'content-disposition: attachment; filename="comparison.csv"' in head.lower()


@in_real_time
async def test_an_upload_is_kept_for_everybody_until_it_is_removed(folder: Path, tmp_path: Path) -> None:
    keys = with_people(tmp_path)
    viewer, operator = ({"Authorization": f"Bearer {keys[role]}"} for role in (Role.VIEWER, Role.OPERATOR))
    way = "/api/stock/expected?store=monday"

    async def act(method: str, more: str, by: dict[str, str], body: bytes = b"") -> tuple[int, Any]:
        code, text = await station.ask(method, way + more, {"Origin": station.origin, **UPLOAD, **by}, body)
        return code, json.loads(text)

    async with served(NOBODY, folder=folder, state=tmp_path, login=True) as station:
        assert await act("GET", "", viewer) == (200, {"kept": None})
        assert (await act("PUT", "&name=books.csv", viewer, BOOKS))[0] == 403
        assert (await act("PUT", "&name=books.csv", operator, b"\x89PNG\x00\x00"))[0] == 400
        assert await act("GET", "", viewer) == (200, {"kept": None}), "what is refused is not kept"
        assert (await act("PUT", "&name=books.csv&who=another", operator, BOOKS))[0] == 200
        head, text = await station.answer("GET", way, viewer)
        told = json.loads(text)
        assert (told["kept"]["name"], told["kept"]["who"]) == ("books.csv", "program-operator")
        assert told["comparison"]["outcome_counts"]["match"] == 1
        tag = next(line for line in head.splitlines() if line.lower().startswith("etag")).split(" ")[1]
        assert (await station.ask("GET", way, {**viewer, "If-None-Match": tag}))[0] == 304
    async with served(NOBODY, folder=folder, state=tmp_path, login=True) as station:
        columns = "&place=1&code=0&quantity=&heading=yes"
        assert (await act("POST", "&place=0&code=0", operator))[0] == 400
        assert (await act("POST", columns, operator))[0] == 200
        _, told = await act("GET", "", viewer)
        assert (told["comparison"]["chosen"]["place"], told["kept"]["name"]) == (1, "books.csv")
        head, _ = await station.answer("GET", f"{way}&format=csv", viewer)
        assert 'filename="comparison.csv"' in head
        assert (await act("DELETE", "", operator))[0] == 200
        assert await act("GET", "", viewer) == (200, {"kept": None})
    lines = [(line["person"], line["act"], line["text"].partition(";")[0]) for line in audited(tmp_path)]
    assert ("program-operator", "PUT", "books.csv as the expected stock of monday") in lines
    assert ("program-operator", "DELETE", "the expected stock of monday") in lines


def test_uploads_are_bounded_and_old_ones_go_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    DecisionBook(tmp_path).add("s", Decision("12345678", "A", 1, 1, Decided.FINE, "Ann"))  # a file of before
    book, columns = ExpectedStockBook(tmp_path), StockColumns(0, 1)
    assert book.kept("store-0") is None
    for n in range(MOST_UPLOADS + 2):
        book.keep(f"store-{n}", ExpectedStock("books.csv", "", n, n, columns), b"x" * 10)
    assert [n for n in range(MOST_UPLOADS + 2) if book.kept(f"store-{n}") is None] == [0, 1]
    monkeypatch.setattr(expected_stock_book, "MOST_BYTES", 95)
    book.keep("store-5", ExpectedStock("newer.csv", "Ann", 100, 100, columns), b"y" * 70)
    left = [n for n in range(MOST_UPLOADS + 2) if book.kept(f"store-{n}") is not None]
    assert left == [5, MOST_UPLOADS, MOST_UPLOADS + 1]
    assert book.data("store-5") == b"y" * 70
    assert len(DecisionBook(tmp_path).decisions("s")) == 1


@in_real_time
async def test_long_json_is_packed_for_who_takes_it_and_nothing_else_is(folder: Path) -> None:
    way = "/api/stock/places?store=monday"
    with SqliteStore(folder / "monday") as store:
        store.plan(PlannedLocation(f"CL-{bay:02}-1-1", "A1") for bay in range(90))
    async with served(NOBODY, folder=folder) as station:
        head, plain = await station.answer("GET", way)
        assert "content-encoding" not in head.lower()
        host = f"Host: {station.where.host}:{station.where.port}\r\nAccept-Encoding: br, gzip;q=0.5"
        for path, is_packed in (
            (way, True), ("/api/stock", False), ("/api/stock/export?store=monday&format=csv", False),
            ("/static/style/stock.css", False),
        ):  # fmt: skip
            said = await station.say(f"GET {path} HTTP/1.1\r\n{host}\r\nConnection: close\r\n\r\n".encode())
            raw, _, body = said.partition(b"\r\n\r\n")
            assert (b"content-encoding: gzip" in raw.lower()) == is_packed, path
            if is_packed:
                assert len(body) < len(plain) / 4
                assert gzip.decompress(body).decode() == plain
                tag = next(line for line in raw.decode().splitlines() if line.lower().startswith("etag"))
        os.utime(folder / "monday" / "inventory.db", ns=(1, 1))
        asked = {"If-None-Match": tag.split(" ")[1], "Accept-Encoding": "gzip"}
        assert (await station.ask("GET", way, asked))[0] == 304, "written to, and what is shown is the same"


@in_real_time
async def test_an_endless_upload_is_cut_off(folder: Path) -> None:
    async with served(NOBODY, folder=folder) as station:
        host = f"{station.where.host}:{station.where.port}"
        head = (
            f"POST /api/stock/compare?store=monday HTTP/1.1\r\nHost: {host}\r\nOrigin: {station.origin}\r\n"
            f"Content-Type: {UPLOAD['Content-Type']}\r\nTransfer-Encoding: chunked\r\n"
            "Connection: close\r\n\r\n"
        )
        chunk = b"%x\r\n%b\r\n" % (1_000_000, b"x" * 1_000_000)
        answer = await station.say(head.encode() + chunk * 9)
        assert answer.startswith(b"HTTP/1.1 400"), answer[:200]


@in_real_time
async def test_more_comparisons_than_may_wait_are_refused_in_one_line(folder: Path) -> None:
    async with served(NOBODY, folder=folder) as station:
        host = f"{station.where.host}:{station.where.port}"
        head = (
            f"POST /api/stock/compare?store=monday HTTP/1.1\r\nHost: {host}\r\nOrigin: {station.origin}\r\n"
            f"Content-Type: {UPLOAD['Content-Type']}\r\nContent-Length: 9\r\nConnection: close\r\n\r\n"
        )
        slow = [asyncio.ensure_future(station.say(head.encode() + b"pla", 4.0)) for _ in range(4)]
        await asyncio.sleep(1.0)
        code, told = await posted(station, "/compare?store=monday", BOOKS)
        assert (code, told["refused"]) == (503, "too many comparisons wait already; try again in a moment")
        await asyncio.gather(*slow)
        async with Within(20):
            while (await posted(station, "/compare?store=monday", BOOKS))[0] != 200:  # noqa: ASYNC110
                await asyncio.sleep(0.1)


@in_real_time
async def test_an_upload_is_read_in_another_process_than_the_station(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def here(*_: object) -> None:
        raise AssertionError("an upload is read in the station's own process")

    monkeypatch.setattr(uploaded_comparison, "read_table", here)
    async with served(NOBODY, folder=folder) as station:
        many = b"place,code\n" + b"".join(b"AL-%06d,%030d\n" % (n, n) for n in range(5_000))
        code, told = await posted(station, "/compare?store=monday", many)
        assert (code, told["rows"]) == (200, 5_000)


@in_real_time
async def test_a_drone_is_asked_once_for_all_that_want_its_inventory_now() -> None:
    asked: list[int] = []

    def told() -> tuple[dict[str, str], ...]:
        asked.append(1)
        return ({"location": "AL-01-1-1", "state": "empty"},)

    with ZmqGround(local(), SITE, LoopClock(), inventory=told) as link:
        async with asyncio.TaskGroup() as tasks:
            running = tasks.create_task(link.run())
            async with served(("demo", address_of(link))) as station:
                await until(lambda: link.requests > 2)
                drone = [asyncio.ensure_future(got(station, "/places?drone=demo")) for _ in range(12)]
                assert {(await answer)[0] for answer in drone} == {200}
                assert 1 <= len(asked) < 12
            running.cancel()


@in_real_time
async def test_an_answer_is_shared_and_so_is_an_error() -> None:
    calls, gate = 0, asyncio.Event()

    async def ask() -> int:
        nonlocal calls
        calls += 1
        call = calls
        await gate.wait()
        if call == 2:
            raise UnavailableError("silent")
        return call

    shared = Shared(ask)
    asking = [asyncio.ensure_future(shared.answer()) for _ in range(5)]
    await asyncio.sleep(0)
    asking[0].cancel()
    await asyncio.sleep(0)
    gate.set()
    told = await asyncio.gather(*asking, return_exceptions=True)
    assert isinstance(told[0], asyncio.CancelledError)
    assert {str(error) for error in told[1:]} == {"silent"}
    assert (await shared.answer(), calls) == (3, 3)


@in_real_time
async def test_more_work_than_may_wait_is_refused() -> None:
    threads, gate = Threads(1, 2, "too much waits"), threading.Event()
    held = [asyncio.ensure_future(threads.run(gate.wait, 20.0)) for _ in range(2)]
    await asyncio.sleep(0)
    with pytest.raises(UnavailableError, match="too much waits"):
        await threads.run(abs, -1)
    gate.set()
    await asyncio.gather(*held)
    assert await threads.run(abs, -1) == 1


@in_real_time
async def test_many_questions_at_once_leave_the_way_to_the_drones_free(folder: Path) -> None:
    async with served(NOBODY, folder=folder) as station:
        many = [asyncio.ensure_future(got(station, "/export?store=monday&format=json")) for _ in range(20)]
        code, _ = await asyncio.wait_for(station.act("demo", id="12345678", command="stop"), 5)
        assert code == 503, "nobody flies there, and that is known at once"
        assert {(await answer)[0] for answer in many} == {200}


JSON_DECISION = {
    "id": "12345678", "place": "AL-02-2-1", "what": "looking", "who": " Ann ", "note": "=1+2",
    "seen_s": 1_700_000_000.0,
}  # fmt: skip


@in_real_time
async def test_a_decision_is_noted_once_for_the_look_that_is_shown(folder: Path) -> None:
    async with served(NOBODY, folder=folder) as station:
        headers = {"Content-Type": "application/json"}
        way, body = "/decisions?store=monday", json.dumps(JSON_DECISION).encode()
        for _ in range(2):
            code, noted = await posted(station, way, body, **headers)
            assert (code, noted["who"], noted["note"]) == (200, "Ann", "=1+2")
        _, told = await got(station, way)
        _, places = await got(station, "/places?store=monday")
        assert [one["seen_s"] for one in told["decisions"]] == [places["places"]["AL-02-2-1"]["seen_s"]]
        assert (await got(station, "/decisions?store=none"))[1] == {"decisions": []}


@in_real_time
async def test_no_decision_closes_a_look_that_nobody_saw(folder: Path) -> None:
    headers, way = {"Content-Type": "application/json"}, "/decisions?store=monday"

    async def decided(station: Station, number: int, **said: object) -> tuple[int, Any]:
        body = JSON_DECISION | {"id": f"decision-{number}", "what": "fine"} | said
        return await posted(station, way, json.dumps(body).encode(), **headers)

    async with served(NOBODY, folder=folder) as station:
        shown = (await got(station, "/places?store=monday"))[1]["places"]["AL-02-2-1"]["seen_s"]
        with SqliteStore(folder / "monday") as store:
            store.commit(look("AL-02-2-1", LocationState.OCCLUDED, at_s=60))
        for number, seen_s in enumerate((shown, None)):
            code, told = await decided(station, number, seen_s=seen_s)
            assert (code, told["refused"]) == (
                409, "the place was looked at again meanwhile; decide about what is shown of it now"
            )  # fmt: skip
        assert not (folder / "ground.db").exists()
        shown = (await got(station, "/places?store=monday"))[1]["places"]["AL-02-2-1"]["seen_s"]
        code, noted = await decided(station, 2, seen_s=shown)
        assert (code, noted["seen_s"]) == (200, shown)
        assert (await decided(station, 3, place="BL-01-1-2", seen_s=None))[0] == 200, "nobody looked there"


@pytest.mark.parametrize(
    "changed",
    [
        {"what": "burn"}, {"who": ""}, {"who": "  "}, {"who": "x" * 61}, {"note": "x" * 501}, {"id": "short"},
        {"place": "nowhere"}, {"place": ""}, {"more": 1}, {"note": "x" * 5000}, {"seen_s": "now"},
    ],
)  # fmt: skip
@in_real_time
async def test_what_is_no_decision_is_refused_and_not_noted(folder: Path, changed: dict[str, object]) -> None:
    async with served(NOBODY, folder=folder) as station:
        headers = {"Content-Type": "application/json"}
        code, told = await posted(
            station, "/decisions?store=monday", json.dumps(JSON_DECISION | changed).encode(), **headers
        )
        assert (code, bool(told["refused"])) == (400, True)
        assert not (folder / "ground.db").exists()


@in_real_time
async def test_a_decision_needs_our_own_page(folder: Path) -> None:
    async with served(NOBODY, folder=folder) as station:
        body = json.dumps(JSON_DECISION).encode()
        evil = {"Content-Type": "application/json", "Origin": "http://evil.example"}
        assert (await posted(station, "/decisions?store=monday", body, **evil))[0] == 403
        assert (await posted(station, "/decisions?store=monday", body))[0] == 415
    async with served(NOBODY) as station:
        assert (await station.ask("GET", "/api/stock/decisions?store=monday"))[0] == 404
