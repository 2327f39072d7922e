"""The writer of the inventory: order kept, disk failures told and waited out, nothing lost on the way."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest

from flightd.adapters.store.sqlite import SqliteStore
from flightd.app.counting import store_writer
from flightd.app.counting.store_writer import StoreWriter
from flightd.core.errors import UnavailableError
from flightd.core.inventory import LocationRecord, LocationState, Observation, PlannedLocation, UndecidedCode
from flightd.core.scanning import CountedPlace, Finding, Settled
from flightd.core.topics import Topic
from flightd.core.types import CodeRead
from flightd.replay.log import decoded_message
from flightd.runtime.clock import LoopClock
from tests.rigs.event_loops import real, virtual
from tests.rigs.held_time import held
from tests.rigs.waiting import until

READ = CodeRead("QR Code", "PALLET", ((0.0, 0.0),) * 4, True, 2, 1.0)


def finding(number: int) -> Finding:
    return Finding(number, f"A-{number}", LocationState.READ, 0.9, (READ,), "", "A1", 1.0, 2.0, 1.5, 0.1)


class StubbornStore:
    """A store whose disk refuses the first `refusals` writes, and writes nothing until it `runs`."""

    def __init__(self, store: SqliteStore, refusals: int = 0) -> None:
        self._store = store
        self._refusals = refusals
        self.runs = threading.Event()
        self.runs.set()

    def plan(self, locations: Iterable[PlannedLocation], site: str = "") -> None:
        self._store.plan(locations, site)

    def keep_evidence(self, jpeg: bytes) -> str:
        return self._store.keep_evidence(jpeg)

    def commit(self, observation: Observation, confirmed: bool = True) -> None:
        assert self.runs.wait(30.0), "the disk never came back"
        if self._refusals:
            self._refusals -= 1
            raise UnavailableError("disk full")
        self._store.commit(observation, confirmed)

    def settle(self, run: str, locations: Iterable[str], confirmed: bool) -> None:
        self._store.settle(run, locations, confirmed)

    def contradict(self, run: str, locations: Iterable[str]) -> None:
        self._store.contradict(run, locations)

    def withdraw_pending(self, run: str) -> None:
        self._store.withdraw_pending(run)

    def counted(self, run: str) -> tuple[CountedPlace, ...]:
        return self._store.counted(run)

    def locations(self) -> list[LocationRecord]:
        return self._store.locations()


async def write(store: StubbornStore, troubles: list[str], seconds: float) -> StoreWriter:
    """Findings 0 to 9 with pictures, 0 to 4 confirmed, 5 withdrawn; run the writer for some time."""
    with StoreWriter(store, "run", 10**18, LoopClock(), troubles.append, held) as writer:
        for number in range(10):
            writer.put(finding(number), b"picture %d" % number)
        writer.settle(Settled(tuple(f"A-{n}" for n in range(5)), confirmed=True))
        writer.settle(Settled(("A-5",), confirmed=False))
        running = asyncio.ensure_future(writer.run(troubles.append))
        await asyncio.sleep(seconds)
        running.cancel()
        await asyncio.wait([running])
    return writer


def run(folder: Path, refusals: int, seconds: float) -> tuple[list[LocationRecord], list[str], StoreWriter]:
    troubles: list[str] = []
    with SqliteStore(folder) as store:
        writer = virtual(write(StubbornStore(store, refusals), troubles, seconds))
        return store.locations(), troubles, writer


def test_what_stayed_undecided_is_written_and_older_findings_have_none(tmp_path: Path) -> None:
    undecided = (UndecidedCode("ITF", "070429", 1),)
    told = msgspec.to_builtins(replace(finding(1), undecided=undecided))
    older = {key: value for key, value in told.items() if key != "undecided"}

    async def write(store: SqliteStore) -> None:
        with StoreWriter(StubbornStore(store), "run", 10**18, LoopClock(), pytest.fail, held) as writer:
            for one in (told, older | {"location": "A-2"}):
                found = decoded_message(tmp_path, Topic.FINDING, msgspec.json.encode(one))
                assert isinstance(found, Finding)
                writer.put(found, b"")

    with SqliteStore(tmp_path) as store:
        virtual(write(store))
        assert [look.undecided for place in ("A-1", "A-2") for look in store.history(place)] == [
            undecided,
            (),
        ]


def test_findings_count_only_once_they_are_confirmed(tmp_path: Path) -> None:
    records, troubles, writer = run(tmp_path, refusals=0, seconds=5.0)
    states = {record.code: record.state for record in records}
    assert states == {f"A-{n}": LocationState.READ if n < 5 else LocationState.NOT_VISITED for n in range(10)}
    assert troubles == []
    assert (writer.written, writer.waiting) == (12, 0)
    assert all(record.observation.evidence for record in records if record.observation)


def test_a_contradicted_booking_is_withdrawn_on_the_disk(tmp_path: Path) -> None:
    async def main(store: SqliteStore) -> None:
        with StoreWriter(store, "run", 0, LoopClock(), lambda _: None) as writer:
            writer.put(finding(0), b"")
            writer.settle(Settled(("A-0",), confirmed=True))
            writer.settle(Settled(("A-0",), confirmed=False, booked=True))

    with SqliteStore(tmp_path) as store:
        virtual(main(store))
        assert store.counted("run") == ()


def test_a_disk_that_refuses_is_told_and_tried_again(tmp_path: Path) -> None:
    records, troubles, writer = run(tmp_path, refusals=3, seconds=60.0)
    assert sum(record.state is LocationState.READ for record in records) == 5
    assert troubles
    assert "disk full" in troubles[0]
    assert writer.waiting == 0


def test_what_is_left_when_the_flight_ends_is_written_on_the_way_out(tmp_path: Path) -> None:
    records, _, writer = run(tmp_path, refusals=0, seconds=0.0)
    assert len(records) == 10
    assert writer.waiting == 0


def test_the_writer_never_holds_up_the_loop(tmp_path: Path) -> None:
    async def main(store: StubbornStore) -> None:
        store.runs.clear()
        with StoreWriter(store, "run", 0, LoopClock(), lambda _: None) as writer:
            running = asyncio.ensure_future(writer.run(lambda _: None))
            for number in range(5):
                writer.put(finding(number), b"")
            for _ in range(10):
                await asyncio.sleep(0.01)
            assert writer.waiting == 5, "the disk is stuck, the loop goes on"
            store.runs.set()
            await until(lambda: not writer.waiting)
            running.cancel()
            await asyncio.wait([running])

    with SqliteStore(tmp_path) as store:
        real(main(StubbornStore(store)))


@pytest.mark.parametrize(("set_s", "dated_s"), [(3600, 3600), (-3600, 0)])
def test_findings_are_dated_by_the_clock_at_take_off_and_never_before_earlier_ones(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, set_s: int, dated_s: int
) -> None:
    """A computer without a battery for its clock is told the date by the network, or not yet."""

    async def write(store: SqliteStore) -> None:
        clock = LoopClock()
        with StoreWriter(store, "run", 10**18, clock, pytest.fail, held) as writer:
            writer.put(finding(1), b"")
            zero_ns = 10**18 + set_s * 10**9
            monkeypatch.setattr(store_writer, "utc_at_zero_ns", lambda _clock: zero_ns)
            running = asyncio.ensure_future(writer.run(pytest.fail))
            await asyncio.sleep(1.0)
            writer.take_off()
            writer.put(finding(2), b"")
            await asyncio.sleep(1.0)
            running.cancel()
            await asyncio.wait([running])

    with SqliteStore(tmp_path) as store:
        virtual(write(store))
        first, second = (store.looks(f"A-{n}")[0][0].utc_ns for n in (1, 2))
    stamps_ns = finding(2).stamp_ns - finding(1).stamp_ns
    assert second - first == stamps_ns + dated_s * 10**9
