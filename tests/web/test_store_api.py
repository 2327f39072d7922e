"""Programs ask the ground store over HTTP: by keys, in bounded pages, as the document says."""

from __future__ import annotations

import asyncio
import json
import shutil
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import msgspec
import pytest

from flightd.adapters.ground_link.client import Address
from flightd.adapters.store.sqlite import SqliteStore
from flightd.core.inventory import LocationState, PlaceFill, Standing, UndecidedCode
from flightd.core.label_values import LabelValue, ValueKind, ValueSource
from flightd.ground.access import access
from flightd.ground.access.key_book import KeyBook, Scope
from flightd.ground.access.passwords import hashed_secret, new_key
from flightd.ground.access.roles import Role
from flightd.ground.decision_book import Decided, Decision, DecisionBook
from flightd.ground.drop import Drop
from flightd.ground.ground_store.batch import Batch, SentFlight, SentLook
from flightd.ground.ground_store.feeder import Feeder
from flightd.ground.ground_store.open_store import opened_store
from flightd.ground.ground_store.questions import Question
from tests.command import Command
from tests.rigs.event_loops import in_real_time
from tests.web.people_rig import with_people
from tests.web.served import JSON, Station, served
from tests.web.stock_rig import RACKS, SSCC, code, counted_hall, counted_store, look, picture_of

NOBODY = ("demo", Address("127.0.0.1", 1, 1))
SITE = RACKS.name
_QUERY = f"site={SITE.replace(' ', '%20')}"


@pytest.fixture
def hall(tmp_path: Path) -> Path:
    """The station's folder with an inventory, a later run in it."""
    return counted_hall(tmp_path / "hall")


def _keyed(state: Path, *scopes: Scope, name: str = "wms") -> dict[str, str]:
    secret = new_key()
    KeyBook(state).make(name, hashed_secret(secret), frozenset(scopes))
    return {"Authorization": f"Bearer {secret}"}


class Program:
    """Asks the station, and holds each answer to the document."""

    def __init__(self, station: Station, headers: dict[str, str]) -> None:
        self._station = station
        self._headers = headers
        self._document: dict[str, Any] = {}

    async def get(self, way: str) -> tuple[int, Any]:
        status, text = await self._station.ask("GET", f"/api/v1{way}", self._headers)
        return status, json.loads(text)

    async def operation(self, way: str, method: str) -> dict[str, Any]:
        if not self._document:
            self._document = (await self.get("/openapi.json"))[1]
        found: dict[str, Any] = self._document["paths"][way.partition("?")[0]][method]
        return found

    async def page(self, way: str) -> dict[str, Any]:
        status, answer = await self.get(way)
        assert status == 200, answer
        jsonschema.validate(answer, _schema((await self.operation(way, "get"))["responses"]["200"]))
        assert answer["rows"] or "empty" in way, way
        found: dict[str, Any] = answer
        return found

    async def post(self, way: str, value: object) -> tuple[int, Any]:
        body = msgspec.json.encode(value)
        status, text = await self._station.ask("POST", f"/api/v1{way}", {**self._headers, **JSON}, body)
        return status, json.loads(text)

    async def ask(self, value: object) -> tuple[int, Any]:
        """What the document refuses is refused, and each status is one of the document's."""
        operation = await self.operation("/questions", "post")
        status, answer = await self.post("/questions", value)
        assert str(status) in operation["responses"]
        if jsonschema.Draft202012Validator(_schema(operation["requestBody"])).is_valid(value):
            assert status == 200 or "there is no site" in answer["refused"], answer
        else:
            assert status == 400
        if status == 200:
            jsonschema.validate(answer, _schema(operation["responses"]["200"]))
        return status, answer


def _schema(of: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = of["content"]["application/json"]["schema"]
    return found


@asynccontextmanager
async def asked(hall: Path, state: Path, *scopes: Scope) -> AsyncIterator[Program]:
    headers = _keyed(state, *scopes)
    with opened_store(str(hall.parent / "store.db")) as store:
        Feeder(store, hall, (), state).feed()
        async with served(NOBODY, folder=hall, state=state, store=store) as station:
            yield Program(station, headers)


@in_real_time
async def test_a_program_asks_what_lies_at_places_and_is_told_which_there_are_not(
    hall: Path, tmp_path: Path
) -> None:
    one = {"location": "AL-01-1-1", "reason": "pick was short", "reference": "B-1"}
    async with asked(hall, tmp_path / "state", Scope.STOCK, Scope.ASK) as program:
        for _ in range(2):  # an answer may be lost on its way
            sent = {"site": SITE, "questions": [one, {"location": "AL-09"}]}
            assert await program.ask(sent) == (200, {"asked": 1, "unknown": ["AL-09"]})
        (question,) = (await program.page(f"/questions?{_QUERY}"))["rows"]
        assert {name: question[name] for name in one} == one
        assert (question["who"], question["answered"]) == ("wms", None)
        with opened_store(str(tmp_path / "store.db")) as store:
            assert store.open_places(SITE) == {"AL-01-1-1"}
        for wrong, why in (
            ({"site": "hall 9", "questions": [one]}, "hall 9"),
            ({"site": SITE, "questions": []}, "questions"),
            ({"site": SITE, "questions": [{"place": "AL-01-1-1"}]}, "place"),
            ({"site": SITE, "questions": [one | {"reason": "a\nb"}]}, "reason"),
        ):
            status, answer = await program.ask(wrong)
            assert status == 400
            assert why in answer["refused"]
        assert "404" not in (await program.operation("/questions", "post"))["responses"]
        long = "\N{CJK UNIFIED IDEOGRAPH-67F1}" * 190
        most = [{"location": f"{long}{n}", "reason": long + "x" * 10, "reference": long} for n in range(1000)]
        status, answer = await program.ask({"site": SITE, "questions": most})
        assert (status, answer["asked"], len(answer["unknown"])) == (200, 0, 1000)


@in_real_time
async def test_every_endpoint_answers_as_its_document_says(hall: Path, tmp_path: Path) -> None:
    DecisionBook(hall).add("monday", Decision("decision-1", "AL-02-1-1", 5, 4, Decided.FINE, "ann"))
    shutil.copytree(hall / "monday", hall / "tuesday")
    with SqliteStore(hall / "tuesday") as later:
        later.commit(look("AL-01-2-1", LocationState.EMPTY, run="2026-W48", at_s=604_800))
    async with asked(hall, tmp_path / "state", Scope.STOCK, Scope.PICTURES) as program:
        with opened_store(str(tmp_path / "store.db")) as store:  # as `flightd store exchange` does beside it
            for number, place in enumerate(("AL-01-1-1", "AL-01-2-1")):
                one = Question(place, "pick was short", f"B-{number}")
                store.ask(SITE, "wms", [one], Drop("in", "ask.csv", str(number), "1 questions"))
        assert (await program.page("/sites"))["rows"] == [{"site": SITE}]
        newest = await program.page(f"/questions?{_QUERY}&limit=1")
        (question,) = (await program.page(f"/questions?{_QUERY}&limit=1&after={newest['next']}"))["rows"]
        assert (question["location"], question["reference"]) == ("AL-01-1-1", "B-0")
        assert (question["answered"], question["file"]) == (None, None)
        first = await program.page(f"/stock?{_QUERY}&limit=3")
        assert [row["location"] for row in first["rows"]] == ["A-GATE", "AL-01-1-1", "AL-01-2-1"]
        rest = await program.page(f"/stock?{_QUERY}&after={first['next']}")
        assert (len(rest["rows"]), rest["next"]) == (8, None)
        row = first["rows"][1]
        assert (row["state"], row["texts"], row["utc"]) == ("read", [f"00{SSCC}"], "2023-11-14T22:13:20.000Z")
        assert (await program.page(f"/runs?{_QUERY}"))["rows"][0]["run"] == "2026-W48"
        changed = (await program.page(f"/differences?{_QUERY}&run=2026-W48"))["rows"]
        assert [(one["location"], one["change"]) for one in changed] == [("AL-01-2-1", "gone")]
        newest = await program.page(f"/history?{_QUERY}&location=AL-01-1-1&limit=1")
        older = await program.page(f"/history?{_QUERY}&location=AL-01-1-1&limit=1&after={newest['next']}")
        assert [newest["rows"][0]["run"], older["rows"][0]["run"]] == ["2026-W47", "2026-W46"]
        assert len((await program.page(f"/observations?{_QUERY}&run=2026-W47"))["rows"]) == 9
        decided = (await program.page(f"/decisions?{_QUERY}&location=AL-02-1-1"))["rows"]
        assert [(one["who"], one["what"]) for one in decided] == [("ann", "fine")]
        status, answer = await program.get(f"/flights?{_QUERY}")
        assert (status, answer) == (200, {"rows": [], "next": None})  # a log without a flight is none
        way = f"/api/v1/pictures/{row['evidence']}"
        said = await program._station.say(  # noqa: SLF001
            f"GET {way} HTTP/1.1\r\nHost: {program._station.where.host}:{program._station.where.port}\r\n"  # noqa: SLF001
            f"Authorization: {program._headers['Authorization']}\r\nConnection: close\r\n\r\n".encode()  # noqa: SLF001
        )
        assert said.partition(b"\r\n\r\n")[2] == picture_of(f"00{SSCC}")


@in_real_time
async def test_what_is_asked_wrongly_is_refused_in_a_line(hall: Path, tmp_path: Path) -> None:
    refusals = {
        "/stock": (400, "site: is missing"),
        f"/stock?{_QUERY}&limit=1001": (400, "limit: expected 1 to 1000"),
        f"/stock?{_QUERY}&limit=x": (400, "limit: expected 1 to 1000"),
        f"/stock?{_QUERY}&{_QUERY}": (400, "site: given twice"),
        f"/stock?{_QUERY}&state=full": (400, "state: expected read, several, empty"),
        f"/stock?{_QUERY}&colour=red": (400, "there is no parameter 'colour'; known: site, state"),
        f"/history?{_QUERY}&location=A-GATE&after=yes": (400, "after='yes': no mark of a page"),
        f"/stock?site={'x' * 201}": (400, "site: expected up to 200 characters"),
        "/stock?site=elsewhere": (404, "there is no site 'elsewhere'"),
        f"/history?{_QUERY}&location=Z": (404, "there is no place 'Z'"),
        f"/differences?{_QUERY}&run=never": (404, "there is no run 'never'"),
        f"/pictures/{'0' * 64}": (404, "this picture was not kept"),
        "/pictures/..": (404, "not the name of a picture"),
    }
    async with asked(hall, tmp_path / "state", Scope.STOCK, Scope.PICTURES) as program:
        for way, (status, why) in refusals.items():
            told = await program.get(way)
            assert (told[0], list(told[1])) == (status, ["refused"]), (way, told)
            assert why in told[1]["refused"], way


@in_real_time
async def test_a_key_opens_its_scopes_and_nothing_else(
    hall: Path, tmp_path: Path, flightd: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(access, "_READ_AGAIN_S", 0.01)
    state = tmp_path / "state"
    async with asked(hall, state, Scope.STOCK) as program:
        assert (await program.get("/sites"))[0] == 200
        status, told = await program.get(f"/pictures/{'0' * 64}")
        assert (status, told["refused"]) == (403, "this needs the scope pictures; wms has stock")
        station = program._station  # noqa: SLF001
        headers = program._headers  # noqa: SLF001
        for way in ("/api/stock", "/api/flights", "/api/missions", "/api/audit", "/api/doctor"):
            status, text = await station.ask("GET", way, headers)
            assert (status, "is not for keys with scopes" in text) == (403, True), way
        status, text = await station.act("demo", {**headers, **JSON}, command="stop")
        assert (status, "is not for keys with scopes" in text) == (403, True)
        assert (await program.post("/deliveries/standings", {"names": []}))[0] == 403
        assert flightd("ground", "keys", "revoke", "wms", "--state", state).returncode == 0
        for _ in range(200):
            if (await program.get("/sites"))[0] == 401:
                break
        else:
            pytest.fail("a revoked key still opens the store")


@in_real_time
async def test_people_read_the_store_by_their_roles(hall: Path, tmp_path: Path) -> None:
    keys = with_people(tmp_path / "state")
    with opened_store(str(tmp_path / "store.db")) as store:
        async with served(NOBODY, folder=hall, state=tmp_path / "state", login=True, store=store) as station:
            assert (await station.ask("GET", "/api/v1/sites"))[0] == 401
            for role, reads, delivers in ((Role.VIEWER, 200, 403), (Role.OPERATOR, 200, 200)):
                program = Program(station, {"Authorization": f"Bearer {keys[role]}"})
                assert (await program.get("/sites"))[0] == reads
                assert (await program.post("/deliveries/standings", {"names": []}))[0] == delivers


@in_real_time
async def test_a_drone_delivers_over_http_once(hall: Path, tmp_path: Path) -> None:
    seen = look("B-1", LocationState.READ, code("PAL-1"))
    batch = Batch("hall 3", "north", looks=(SentLook(seen, Standing.CONFIRMED),))
    async with asked(hall, tmp_path / "state", Scope.DELIVER) as program:
        for new in (1, 0):
            status, receipt = await program.post("/deliveries", batch)
            assert (status, receipt["new"], receipt["already"]) == (200, new, 1 - new)
        assert (await program.post("/deliveries/standings", {"names": [seen.id, "0" * 64]}))[1] == {
            seen.id: 1
        }
        status, told = await program.post("/deliveries", {"site": "hall 3", "source": "north", "looks": [{}]})
        assert (status, "not a batch" in told["refused"]) == (400, True)
        flight = SentFlight("x", "north", 5, None, "", "", "", "", None, None)
        for wrong in (replace(flight, id="x"), replace(flight, id="0" * 64, began_ns=1 << 63)):
            status, told = await program.post("/deliveries", Batch("hall 3", "north", flights=(wrong,)))
            assert (status, told["refused"][:7]) == (400, "north: "), told
        assert (await program.post("/deliveries/missing-pictures", {"names": ["../etc"]}))[0] == 400
        assert (await program.get("/sites"))[0] == 403


@in_real_time
async def test_a_drone_that_does_not_tell_how_full_places_are_delivers_as_before(
    hall: Path, tmp_path: Path
) -> None:
    fill, undecided = PlaceFill(0.5, 0.04), (UndecidedCode("ITF", "070429", 2),)
    seen = [look(place, LocationState.READ, code("PAL-1"), fill=fill) for place in ("B-1", "B-2")]
    seen = [replace(one, undecided=undecided) for one in seen]
    sent = Batch(SITE, "north", looks=tuple(SentLook(one, Standing.CONFIRMED) for one in seen))
    older = msgspec.to_builtins(sent)
    del older["looks"][0]["observation"]["fill"]
    del older["looks"][0]["observation"]["undecided"]
    async with asked(hall, tmp_path / "state", Scope.DELIVER, Scope.STOCK) as program:
        assert (await program.post("/deliveries", older))[1]["new"] == 2
        stock = (await program.page(f"/stock?{_QUERY}"))["rows"]
        doubts = {row["location"]: [code["text"] for code in row["undecided"]] for row in stock}
        assert (doubts["B-1"], doubts["B-2"]) == ([], ["070429"])
        fills = {row["location"]: row["fill"] for row in stock}
        assert (fills["B-1"], fills["B-2"]) == (
            None,
            {"share": 0.5, "overhang_m": 0.04, "lean_m": None, "cases": None},
        )
        (row,) = (await program.page(f"/history?{_QUERY}&location=B-2"))["rows"]
        assert row["fill"] == fills["B-2"]
        older["looks"][0]["observation"]["fill"] = {"share": 1.5, "overhang_m": None}
        status, told = await program.post("/deliveries", older)
        assert (status, "a share of 1.5 outside 0..1" in told["refused"]) == (400, True)


@in_real_time
async def test_a_folder_is_delivered_to_a_station_and_pruned_there(
    tmp_path: Path, flightd: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    inventory = tmp_path / "drone"
    counted_store(inventory)
    with SqliteStore(inventory) as counted:
        (empty,) = counted.history("AL-02-1-1")
        lot = LabelValue(ValueKind.LOT, "B-4711", "", ValueSource.TEXT, 0.95)
        counted.keep_texts(empty.id, [lot], "lots")
    headers = _keyed(tmp_path / "state", Scope.DELIVER, name="drone-1")
    with opened_store(str(tmp_path / "store.db")) as store:
        async with served(NOBODY, state=tmp_path / "state", store=store) as station:
            to = ("--store", station.origin)
            refused = await asyncio.to_thread(flightd, "store", "deliver", inventory, *to)
            assert (refused.returncode, "FLIGHTD_STORE_KEY: a station asks for a key" in refused.stderr) == (
                2,
                True,
            )
            monkeypatch.setenv("FLIGHTD_STORE_KEY", headers["Authorization"].removeprefix("Bearer "))
            sent = ("store", "deliver", inventory, "--site", "hall 3", "--json", *to)
            for new, pictures in ((10, 1), (0, 0)):
                ended = await asyncio.to_thread(flightd, *sent)
                told = json.loads(ended.stdout)
                assert (told["looks"], told["already"], told["pictures"]) == (new, 10 - new, pictures)
            ended = await asyncio.to_thread(flightd, "store", "prune", inventory, "--json", *to)
            assert json.loads(ended.stdout) == {"looks": 1, "pictures": 0, "stay": 0}
            monkeypatch.setenv("FLIGHTD_STORE_KEY", "none")
            ended = await asyncio.to_thread(flightd, *sent)
            assert (ended.returncode, "the station answers: this key is nobody's here" in ended.stderr) == (
                2,
                True,
            )
        ended = await asyncio.to_thread(flightd, *sent)
        assert (ended.returncode, "the station cannot be had" in ended.stderr) == (2, True)
        stock = {row["location"]: row for row in store.stock("hall 3")}
        assert stock["AL-01-1-1"]["texts"] == [f"00{SSCC}"]
        assert [value["value"] for value in stock["AL-02-1-1"]["printed"]] == ["B-4711"]
