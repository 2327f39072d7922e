"""An Odoo and a ground station are connected: stock in, count, bookings out, once and by a person."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from flightd.adapters.ground_link.client import Address
from flightd.adapters.store.sqlite import SqliteStore
from flightd.core.inventory import LocationState
from flightd.ground.access.key_book import KeyBook, Scope
from flightd.ground.access.passwords import hashed_secret, new_key
from flightd.ground.decision_book import Decided, Decision, DecisionBook
from flightd.ground.ground_store.feeder import Feeder
from flightd.ground.ground_store.open_store import opened_store
from flightd.ground.server import Listening
from flightd.ground.wms_exchange.exchange import Exchange
from flightd.ground.wms_exchange.exchange_file import load_exchange
from tests.rigs.event_loops import in_real_time
from tests.rigs.recorded_odoo import KEY, Answer, RecordedOdoo, recorded_odoo
from tests.web.served import Station, served
from tests.web.stock_rig import RACKS, code, counted_store, flown_log, look
from tools.odoo.commands import main

_COUNTED_NS = 1_700_000_000 * 10**9
_HOUR_NS = 3_600 * 10**9
_DRILL = "(01)04011200296908(21)SN-77"
_EXCHANGE = """name = "odoo"
[expected]
inbox = "in"
folder = "hall"
inventory = "monday"
settle_s = 0
columns = { place = "place", code = "code", quantity = "quantity" }
"""
_CONNECTOR = """[odoo]
url = "{odoo}"
database = "mycompany"
location = "WH/Stock"
timeout_s = {timeout_s}
[expected]
inbox = "in"
[counts]
station = "{station}"
site = "{site}"
"""


@pytest.fixture
def odoo() -> Any:
    with recorded_odoo() as found:
        yield found


@dataclass
class Connector:
    """`python -m tools.odoo`, an hour after the count; `said` is what it printed last."""

    here: Path
    odoo: RecordedOdoo
    station: Station
    capsys: pytest.CaptureFixture[str]
    feeder: Feeder | None = None
    said: str = ""
    timeout_s: float = 20.0

    async def __call__(self, step: str, *more: str, counts: str = "", after_h: float = 1.0) -> int:
        text = _CONNECTOR.format(
            odoo=self.odoo.url, station=self.station.origin, site=RACKS.name, timeout_s=self.timeout_s
        )
        config = self.here / "odoo.toml"
        config.write_text(text + counts)
        plan = () if step == "expected" else (str(self.here / "plan.json"),)
        ended = await asyncio.to_thread(
            main, [step, str(config), *plan, *more], _COUNTED_NS + int(after_h * _HOUR_NS)
        )
        printed = self.capsys.readouterr()
        self.said = printed.out + printed.err
        assert self.odoo.unrecorded == []
        return ended

    @property
    def lines(self) -> list[str]:
        return self.said.splitlines()


@contextlib.asynccontextmanager
async def connected(
    here: Path, odoo: RecordedOdoo, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> AsyncIterator[Connector]:
    """A station with a count of the hall in its store."""
    hall, state = here / "hall", here / "state"
    counted_store(hall / "monday")
    with SqliteStore(hall / "monday") as inventory:
        gs1 = (("01", "04011200296908"), ("21", "SN-77"))
        inventory.commit(look("BL-01-1-2", LocationState.READ, code("010401120029690821SN-77", *gs1)))
    flown_log(hall / "monday" / "flight.mcap", RACKS)
    (here / "in").mkdir()
    secret = new_key()
    KeyBook(state).make("odoo", hashed_secret(secret), frozenset({Scope.STOCK}))
    monkeypatch.setenv("ODOO_API_KEY", KEY)
    monkeypatch.setenv("FLIGHTD_STORE_KEY", secret)
    with opened_store(str(here / "store.db")) as store:
        feeder = Feeder(store, hall, (), state)
        feeder.feed()
        nobody = ("demo", Address("127.0.0.1", 1, 1))
        async with served(nobody, folder=hall, state=state, store=store) as station:
            yield Connector(here, odoo, station, capsys, feeder)


async def compared(connector: Connector) -> dict[tuple[str, str], str]:
    """What the page Stock tells of the expected stock, by place and code."""
    exchange = connector.here / "wms.toml"
    exchange.write_text(_EXCHANGE)
    done = Exchange(exchange, load_exchange(exchange), None, sleep=lambda _: None).once()
    assert ([file.taken for file in done.files], done.failures) == ([True], [])
    status, text = await connector.station.ask("GET", "/api/stock/expected?store=monday&format=json")
    assert status == 200
    lines = json.loads(text)["lines"]
    return {(line["location"], line["text"]): line["outcome"] for line in lines}


@in_real_time
async def test_stock_comes_in_and_what_a_person_approves_is_booked_once(
    tmp_path: Path, odoo: RecordedOdoo, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    async with connected(tmp_path, odoo, monkeypatch, capsys) as connector:
        assert await connector("expected") == 0, connector.said
        assert connector.lines == [
            "odoo-stock.csv: 6 labels at 10 places",
            "left out: locations with others below them: 1",
            "left out: Wire at AL-04-1-1: no label names it; give the product a barcode",
        ]
        shown = await compared(connector)
        assert shown["AL-01-1-1", "340123450002439853"] == "match"
        assert shown["AL-02-1-1", "PAL-3"] == "empty_but_expected"
        assert shown["AL-02-2-1", "PAL-8/L1"] == "moved"
        assert shown["AL-03-1-1", "(01)04011200296908(21)SN-76"] == "uncounted"

        assert await connector("plan") == 0, connector.said
        assert connector.lines == [
            "AL-02-1-1 PAL-3: 5 -> 0 (empty_but_expected)",
            "BL-01-1-2 010401120029690821SN-77: 0 -> 1 (unexpected)",
            "AL-02-2-1 PAL-8/L1: not booked: lies at AL-03-2-1: move it in Odoo",
            "AL-04-2-1 <b>PAL-10</b>: not booked: Odoo has the package at WH/Output: move it in Odoo",
            "BL-01-1-1 =1+2: not booked: Odoo knows no lot or serial number =1+2: make it in Odoo, or "
            "correct the label",
            "3 labels agree, 2 may be booked, 3 need a look, not counted: 1",
        ]
        assert odoo.changes == []

        assert await connector("apply", "--by", "ann", "--place", "AL-02-1-1") == 0, connector.said
        assert connector.lines == ["AL-02-1-1 PAL-3 5 -> 0: applied"]
        assert [asked for asked, _ in odoo.changes] == [
            "stock.quant/write", "stock.quant/action_apply_inventory",
        ]  # fmt: skip
        assert await connector("apply", "--by", "ann") == 1, "one of both was booked already"
        assert connector.lines[0].endswith("Odoo and the count say otherwise than this plan now")
        assert connector.lines[1] == "BL-01-1-2 010401120029690821SN-77 0 -> 1: applied"
        assert [asked for asked, _ in odoo.changes[2:]] == [
            "stock.quant/create", "stock.quant/action_apply_inventory",
        ]  # fmt: skip

        for step in ("apply", "plan", "apply"):
            await connector(step, *(("--by", "ann") if step == "apply" else ()))
        assert connector.lines == ["nothing to book"]
        assert len(odoo.changes) == 4
        booked = [json.loads(line) for line in (tmp_path / "odoo-booked.jsonl").read_text().splitlines()]
        assert [(one["by"], one["place"], one["counted"], one["quants"]) for one in booked] == [
            ("ann", "AL-02-1-1", 0.0, [103]), ("ann", "BL-01-1-2", 1.0, [131]),
        ]  # fmt: skip
        assert await connector("expected") == 0
        assert ("AL-02-1-1", "PAL-3") not in await compared(connector)


def _of(odoo: RecordedOdoo, **changed: Any) -> Answer:
    """The quants, PAL-3 with other values."""
    quants = odoo.recorded("stock.quant/search_read")
    return Answer(200, [{**quant, **(changed if quant["id"] == 103 else {})} for quant in quants])


@in_real_time
async def test_a_count_that_is_not_trusted_is_told_and_not_booked(
    tmp_path: Path, odoo: RecordedOdoo, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    moved = Answer(200, [{"id": 7, "date": "2023-11-14 22:40:00"}])
    async with connected(tmp_path, odoo, monkeypatch, capsys) as connector:

        async def why(method: str = "", answer: Answer | None = None, **given: Any) -> str:
            odoo.instead = {} if answer is None else {method: answer}
            assert await connector("plan", **given) == 0, connector.said
            return next(line for line in connector.lines if line.startswith("AL-02-1-1 PAL-3: "))

        assert "-> 0" in await why()
        assert "Odoo moved something there since (2023-11-14 22:40:00 UTC)" in await why(
            "stock.move.line/search_read", moved
        )
        stock = "stock.quant/search_read"
        assert "a transfer in Odoo has reserved it" in await why(stock, _of(odoo, reserved_quantity=2.0))
        waiting = {"inventory_quantity": 4.0, "inventory_quantity_set": True}
        assert "a count of 4 waits in Odoo already" in await why(stock, _of(odoo, **waiting))
        assert "the place is empty" in await why(counts='zeroed = ["wrong"]\n')
        assert "confidence 0.98, less than 0.99" in await why(counts="least_confidence = 0.99\n")
        assert "more than 24 h ago" in await why(after_h=25)
        assert "in the future" in await why(after_h=-1)
        decision = Decision("decision-1", "AL-02-1-1", 6, _COUNTED_NS, Decided.LOOKING, "ann")
        DecisionBook(tmp_path / "hall").add("monday", decision)
        assert connector.feeder is not None
        connector.feeder.feed()
        assert "ann has decided about it: looking" in await why()
        assert odoo.changes == []


@in_real_time
async def test_nothing_is_booked_of_stock_that_changed_and_what_was_cut_is_finished(
    tmp_path: Path, odoo: RecordedOdoo, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    apply, approve = "stock.quant/action_apply_inventory", ("--by", "ann", "--place", "AL-02-1-1")
    async with connected(tmp_path, odoo, monkeypatch, capsys) as connector:
        await connector("plan")
        odoo.instead = {"stock.quant/search_read": _of(odoo, quantity=6.0)}
        assert await connector("apply", *approve) == 1
        assert odoo.changes == []
        odoo.instead = {
            "stock.quant/action_clear_inventory_quantity": Answer(200, None),
            "stock.quant/write": Answer(200, True),
            "stock.quant/search_read:inventory_diff_quantity": Answer(
                200, [{"id": 103, "inventory_diff_quantity": -6.0}]
            ),
        }
        assert await connector("apply", *approve) == 1
        assert "Odoo's stock has changed meanwhile, nothing was booked" in connector.said
        assert [asked for asked, _ in odoo.changes] == list(odoo.instead)[1::-1]
        odoo.asked.clear()

        odoo.instead = {apply: odoo.refusal("a proxy without its server")}
        assert await connector("apply", *approve) == 2
        assert "Odoo cannot answer now (HTTP 502)" in connector.lines[-1]
        odoo.instead = {apply: odoo.refusal("a count that is outdated")}
        assert await connector("apply", *approve) == 1
        assert "but asks: Conflict in Inventory Adjustment" in connector.said
        odoo.instead = {apply: odoo.refusal("a record that is gone")}
        assert await connector("apply", *approve) == 1
        assert "Odoo has it no more: Record does not exist or has been deleted." in connector.lines[0]
        odoo.instead = {}
        assert await connector("apply", "--set-only", *approve) == 0
        assert connector.lines == ["AL-02-1-1 PAL-3 5 -> 0: set: apply it in Odoo under Physical Inventory"]
        assert await connector("apply", *approve) == 0
        assert connector.lines == ["AL-02-1-1 PAL-3 5 -> 0: applied"]


@in_real_time
async def test_a_bad_answer_is_one_line_with_what_to_do(
    tmp_path: Path, odoo: RecordedOdoo, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = "stock.location/search_read"
    half = Answer(200, [{"id": 8, "name": "Stock"}])
    refusals = {
        "a user who may not": "Odoo forbids /json/2/stock.location/search_read: You are not allowed to "
        "access 'Inventory Locations' (stock.location) records.",
        "a model that Odoo does not know": "the model 'stock.location' does not exist; is the app Inventory",
        "a rule against it": "(HTTP 422): Quant's editing is restricted",
        "a fault of its own": "could not serialize access due to concurrent update; try again later",
        "no JSON-2 API": "there is no JSON-2 API; it needs Odoo 19 or later",
        "no such database": "there is no JSON-2 API; it needs Odoo 19 or later; correct odoo.url",
        "an Odoo 18": "the address leads elsewhere; give the address that it leads to, with https:// if that "
        "is it; Odoo 18 leads to its login",
        "a page of the proxy": "with a web page that is no JSON; is that its own address",
        "a proxy without its server": "Odoo cannot answer now (HTTP 502); try again later",
        "another address": "the address leads elsewhere; give the address",
    }
    answers = {name: (odoo.refusal(name), said) for name, said in refusals.items()} | {
        "half a record": (half, "otherwise than it is documented: Object missing required field"),
        "half an answer": (Answer(200, [{"id": 8}] * 50, cut=True), "the answer of Odoo broke off; try"),
        "no location": (Answer(200, []), "odoo.location: Odoo has no location 'WH/Stock'"),
        "no barcodes": (
            Answer(200, [{"id": 8, "name": "Stock", "complete_name": "WH/Stock", "barcode": False}]),
            "odoo.place: no internal location below WH/Stock has a barcode",
        ),
        "no answer": (Answer(silent=True), "Odoo did not answer within 0.3 s; try again later"),
    }  # fmt: skip
    connector = Connector(tmp_path, odoo, Station(Listening("127.0.0.1", 1)), capsys)
    monkeypatch.setenv("FLIGHTD_STORE_KEY", "flightd_any")

    async def refused(*step: str) -> str:
        assert await connector(*step) in {1, 2}
        (line,) = connector.lines
        assert line.startswith("odoo: "), line
        return line

    monkeypatch.delenv("ODOO_API_KEY", raising=False)
    assert "ODOO_API_KEY: Odoo asks for a key; make one in Odoo" in await refused("plan")
    monkeypatch.setenv("ODOO_API_KEY", "wrong")
    assert "ODOO_API_KEY: Odoo does not take the key: Invalid apikey; make one" in await refused("plan")
    monkeypatch.setenv("ODOO_API_KEY", KEY)
    for name, (answer, said) in answers.items():
        odoo.instead = {asked: answer}
        connector.timeout_s = 0.3 if answer.silent else 20.0
        assert said in await refused("expected"), (name, connector.said)
    odoo.instead = {}
    assert "the station cannot be had: Connection refused; try again later" in await refused("plan")
    odoo.url = "http://127.0.0.1:1"
    assert "Odoo cannot be had: Connection refused; try again later" in await refused("expected")
    odoo.url = "http://odoo.example"
    assert "odoo.url: the key would be read on the way; give https://" in await refused("expected")


@in_real_time
async def test_what_the_station_refuses_and_a_plan_of_another_kind_are_one_line(
    tmp_path: Path, odoo: RecordedOdoo, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    async with connected(tmp_path, odoo, monkeypatch, capsys) as connector:
        assert await connector("apply", "--by", "ann") == 2
        assert "plan.json: No such file or directory; make one: python -m tools.odoo plan" in connector.said
        (tmp_path / "plan.json").write_text('{"site": "hall"}')
        assert await connector("apply", "--by", "ann") == 2
        assert "plan.json: not a plan: Object missing required field `bookings`" in connector.said
        await connector("plan")
        assert await connector("apply", "--by", " ") == 2
        assert "--by: a person approves what is booked" in connector.said
        assert await connector("apply", "--by", "ann", "--place", "AL-09-9-9") == 2
        assert "--place: the plan books nothing at AL-09-9-9" in connector.said
        assert await connector("plan", counts="colour = 1\n") == 2
        assert "counts.colour: " in connector.said
        monkeypatch.setenv("FLIGHTD_STORE_KEY", "flightd_of_nobody")
        assert await connector("plan") == 2
        assert (
            "FLIGHTD_STORE_KEY: the station answers: this key is nobody's here; set it to one of"
            in connector.said
        )
        assert odoo.changes == []
