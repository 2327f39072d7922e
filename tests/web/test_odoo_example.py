"""An Odoo and a ground station are connected: stock in, count, bookings out, each of them once and by a person."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass, replace
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
        Feeder(store, hall, (), state).feed()
        nobody = ("demo", Address("127.0.0.1", 1, 1))
        async with served(nobody, folder=hall, state=state, store=store) as station:
            yield Connector(here, odoo, station, capsys)


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
            "left out: 1 locations without a barcode",
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
            "BL-01-1-1 =1+2: not booked: Odoo knows no lot or serial number =1+2: make it in Odoo, or correct "
            "the label",
            "3 labels agree, 2 may be booked, 3 need a look, 1 were not counted",
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
