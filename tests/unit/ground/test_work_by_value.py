"""A station's drones fly what is worth most first: by the ground store, and by the books."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from flightd.adapters.ground_link.floor_status import floor_status
from flightd.adapters.ground_link.messages.floor import FloorNode
from flightd.core.errors import InputError
from flightd.core.inventory import CountPose, LocationState, Observation, PlannedLocation, Standing
from flightd.core.planned_flight import MOST_NODES
from flightd.core.types import CodeRead, Phase
from flightd.fleet.traffic.valued_work import PlaceFacts, Worth, worth_of
from flightd.fleet.traffic.work_queue import Value
from flightd.ground.drop import Drop
from flightd.ground.expected_stock_book import ExpectedStock, ExpectedStockBook
from flightd.ground.fleet.fleet_memory import FleetMemory
from flightd.ground.fleet.site_facts import SiteFacts
from flightd.ground.ground_store.batch import Batch, SentLook
from flightd.ground.ground_store.evidence import FolderEvidence
from flightd.ground.ground_store.questions import Question
from flightd.ground.ground_store.sqlite_engine import SqliteEngine
from flightd.ground.ground_store.store import GroundStore
from flightd.ground.reading_process import ReadingProcess
from flightd.ground.schedules.work import valued_work
from flightd.ground.stores import Stores
from flightd.ground.valued_nodes import ByValue, valued_nodes
from flightd.inventory.stock_columns import StockColumns
from tests.rigs.event_loops import real
from tests.rigs.paper_drones import hall
from tests.rigs.paper_fleet import PaperFleet, fly, until, until_done

_DAY_S = 86_400.0
_NOW_NS = 1_760_000_000 * 10**9
WORTH = {
    "A3": Worth(Value.OLD, 9 * _DAY_S),
    "A4": Worth(Value.OLD, _DAY_S),
    "B2": Worth(Value.OLD, 2 * _DAY_S),
    "B3": Worth(Value.NEVER_COUNTED),
    "B4": Worth(Value.CONTRADICTED, 60.0),
    "A2": Worth(Value.OLD, 60.0),
    **dict.fromkeys(("A1", "A5", "B1", "B5"), Worth(Value.OLD, 1.0)),
}


@pytest.fixture
def store(tmp_path: Path) -> Iterator[GroundStore]:
    with GroundStore(SqliteEngine(tmp_path / "store.db"), FolderEvidence(tmp_path / "evidence")) as opened:
        yield opened


def look(location: str, state: LocationState, *texts: str, days: float = 0.0) -> SentLook:
    reads = tuple(CodeRead("QR Code", text, (), True, 3, 1.0) for text in texts)
    at_ns, pose = _NOW_NS - int(days * _DAY_S * 1e9), CountPose("A1", 0.0, 0.0, 0.9, 0.0)
    return SentLook(Observation("run", location, at_ns, state, 0.9, reads, pose), Standing.CONFIRMED)


def counted(store: GroundStore) -> None:
    places = tuple(PlannedLocation(f"P{i}", f"A{i}") for i in range(2, 6))
    looks = (
        look("P2", LocationState.READ, "PAL-2", days=1.0),
        look("P3", LocationState.READ, "PAL-3", days=8.0),
        look("P4", LocationState.OCCLUDED, days=2.0),
    )
    store.take(Batch("hall", "a", places, looks))


def facts(store: GroundStore | None, folder: Path | None, reading: ReadingProcess) -> SiteFacts:
    return SiteFacts(store, folder, (), reading, lambda: _NOW_NS)


def test_ages_come_of_the_ground_store_and_contradictions_of_the_newest_books_of_the_site(
    tmp_path: Path, store: GroundStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    counted(store)
    book, columns = ExpectedStockBook(tmp_path), StockColumns(0, 1, None, heading=True)
    books = {
        "elsewhere": b"place,code\nP3,PAL-9\n",
        "here": b"place,code\nP2,PAL-1\nP3,PAL-3\nP5,PAL-5\n",
        "gone": b"place,code\nP3,PAL-9\n",
    }
    for at_ns, (inventory, data) in enumerate(reversed(books.items())):
        book.keep(inventory, ExpectedStock("books.csv", "ann", at_ns, at_ns, columns), data)

    def site_name(_: Stores, inventory: str) -> str:
        if inventory == "gone":
            raise InputError("there is no inventory")
        return "hall" if inventory == "here" else "shed"

    monkeypatch.setattr(Stores, "site_name", site_name)

    async def asked(site: str) -> tuple[PlaceFacts, ...]:
        reading = ReadingProcess()
        try:
            return await facts(store, tmp_path, reading).of(site)
        finally:
            reading.close()

    known = real(asked("hall"))
    assert set(known) == {
        PlaceFacts("A2", _DAY_S, contradicted=True),
        PlaceFacts("A3", 8 * _DAY_S),
        PlaceFacts("A4", None),
        PlaceFacts("A5", None),
    }
    assert real(asked("depot")) == ()
    assert worth_of(known)["A2"].value is Value.CONTRADICTED
    store.ask("hall", "wms", [Question("P3"), Question("P5")], Drop("in", "ask.csv", "1a2b", "2 questions"))
    worth = worth_of(real(asked("hall")))
    assert [node for node, its in worth.items() if its.value is Value.ASKED] == ["A3", "A5"]
    at_ns = time.time_ns() + 1  # later than the store heard the question
    answer = Observation("answer", "P3", at_ns, LocationState.OCCLUDED, 0.9, ())
    store.take(Batch("hall", "a", looks=(SentLook(answer, Standing.CONFIRMED),)))
    worth = worth_of(real(asked("hall")))
    assert worth["A3"].value is Value.NEVER_COUNTED, "an answer, though nobody knows what lies there"
    assert worth["A5"].value is Value.ASKED


def test_without_a_ground_store_nothing_is_said_of_value() -> None:
    with pytest.raises(InputError, match="there is none; give --store FILE"):
        real(facts(None, None, ReadingProcess()).of("hall"))


def test_the_most_valuable_nodes_are_visited_and_what_waits_is_not_asked_for_twice() -> None:
    async def go(fleet: PaperFleet) -> None:
        assert fleet.own.ask_by_value(WORTH, ByValue(nodes=2)) == ("B4", "B3")
        assert fleet.own.ask_by_value(WORTH, ByValue(nodes=1)) == ("A3",), "those wait already"
        await until_done(fleet, "B4 B3 A3")

    fly(go)


def test_one_drone_alone_flies_all_by_value_aisle_by_aisle() -> None:
    async def go(fleet: PaperFleet) -> None:
        a = fleet.drones["a"]
        asked = fleet.own.ask_by_value(WORTH, ByValue())
        assert asked[:3] == ("B4", "B3", "A3")
        assert set(asked) == set(WORTH)
        await until(lambda: a.phase is Phase.DONE, 400)
        assert fleet.state["done"][:2] == ["B4", "B3"]
        assert set(fleet.state["done"]) == set(asked)

    fly(go, "a")


def test_an_aisle_that_is_closed_is_none_of_the_most_valuable(tmp_path: Path) -> None:
    async def go(fleet: PaperFleet) -> None:
        await fleet.own.close("ann", aisle="B")
        assert set(fleet.own.ask_by_value(WORTH, ByValue(aisles=1))) == {"A1", "A2", "A3", "A4", "A5"}

    fly(go, "ab", memory=FleetMemory(tmp_path))


def test_of_more_nodes_than_a_run_has_the_oldest_are_counted_in_the_order_of_the_aisles() -> None:
    nodes = [FloorNode(f"N{i}", float(i), 0.0, "A", (1,)) for i in range(MOST_NODES + 10)]
    floor = msgspec.structs.replace(floor_status(hall("a")), nodes=nodes)
    worth = {node.id: Worth(Value.OLD, float(i)) for i, node in enumerate(nodes)}
    run = valued_work(floor, worth, valued_nodes(floor, worth, ByValue()))
    assert run.nodes == tuple(node.id for node in nodes[10:])


def test_a_node_that_a_person_asked_one_drone_for_stays_so_whatever_asks_for_it_then(tmp_path: Path) -> None:
    async def go(fleet: PaperFleet) -> None:
        for drone in fleet.drones.values():
            drone.never_starts = True
        fleet.deciding = asyncio.Event()
        await asyncio.sleep(1.0)
        fleet.own.ask(["B3"], "b")
        fleet.own.take_run("run-1", {"B3": Worth(Value.OLD, 60.0), "A3": Worth(Value.OLD, 60.0)})
        assert fleet.state["open"] == ["B3", "A3"]
        fleet.deciding.set()
        fleet.deciding = None
        await until(lambda: fleet.own.knows_run("run-1"))
        kept = FleetMemory(tmp_path).read()
        assert kept is not None
        work = {one.node: (one.value, one.drone) for one in kept[1].work.work}
        assert work == {"B3": (Value.ASKED, "b"), "A3": (Value.OLD, "")}

    fly(go, "ab", memory=FleetMemory(tmp_path))


def test_the_next_station_knows_the_value_of_what_waits(tmp_path: Path) -> None:
    async def go(fleet: PaperFleet) -> None:
        for drone in fleet.drones.values():
            drone.never_starts = True
        fleet.own.ask_by_value(WORTH, ByValue(nodes=3))
        await asyncio.sleep(5.0)
        await fleet.kill()
        kept = FleetMemory(tmp_path).read()
        assert kept is not None
        values = {one.node: one.value for one in kept[1].work.work}
        assert values == {"B4": Value.CONTRADICTED, "B3": Value.NEVER_COUNTED, "A3": Value.OLD}
        fleet.start_again()
        await until(lambda: fleet.state["flies"])

    fly(go, "ab", memory=FleetMemory(tmp_path))
