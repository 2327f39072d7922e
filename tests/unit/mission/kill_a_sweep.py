"""Kill a count in passing at random moments, go on with it, and see what the inventory holds.

    python -m tests.unit.mission.kill_a_sweep 200 1 FOLDER

The mission, the scanner, the writer and the file are the real ones; the drone is fed by hand and the pictures
are those of an ideal reader.  Each process is killed (SIGKILL) after a random number of writes that it told,
or before the first.  A count that is complete is followed by another, under a new name.  One pallet is at
two places.

Prints one JSON document: kills, writes that were told before a kill, how many of those were lost, places with
more than one look that counts, looks at what counted already and was not contradicted, bookings that were
contradicted, those of them that count still, places of that pallet that were looked at once in a completed
count, files that did not open sound, counts that were completed.  Killing uses fork, so this is a
program of its own.
"""

from __future__ import annotations

import asyncio
import json
import os
import random
import select
import signal
import sqlite3
import sys
import time
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from flightd.adapters.store.sqlite import SqliteStore
from flightd.app.counting.store_writer import StoreWriter
from flightd.core.inventory import Observation, PlannedLocation
from flightd.core.types import Phase
from flightd.runtime.clock import LoopClock
from tests.rigs.event_loops import real
from tests.sim.ideal.ideal_front import Label, Stock
from tests.unit.mission.shelves import SITE
from tests.unit.mission.test_sweep_flight import Sweep, labels_of

_CHUNK_S = 0.2
_WRITING_S = 0.02
_MOST_WRITES = 64
_TWICE = ("AL-02-2-2", "AR-04-1-1")


class ToldStore(SqliteStore):
    """Says what is on the disk, a line for each write."""

    def __init__(self, folder: Path, told: int) -> None:
        super().__init__(folder)
        self._told = told

    def commit(self, observation: Observation, confirmed: bool = True) -> None:
        super().commit(observation, confirmed)
        os.write(self._told, f"seen {observation.id} {observation.run} {observation.location}\n".encode())

    def settle(self, run: str, locations: Iterable[str], confirmed: bool) -> None:
        codes = tuple(locations)
        super().settle(run, codes, confirmed)
        if confirmed:
            os.write(self._told, "".join(f"sure {run} {code}\n" for code in codes).encode())

    def contradict(self, run: str, locations: Iterable[str]) -> None:
        codes = tuple(locations)
        super().contradict(run, codes)
        os.write(self._told, "".join(f"taken {run} {code}\n" for code in codes).encode())


async def _count(store: SqliteStore, run: str) -> None:
    """Fly what is left of a count, as a flight that goes on with it does."""
    store.plan(PlannedLocation(place.code, place.node) for place in SITE.locations.values())
    store.withdraw_pending(run)
    # labels of the places themselves prove where it is, so that a part is booked on the way
    stock = labels_of(SITE) | {code: [Label("PALLET 9")] for code in _TWICE}
    labels = {code: [*found, Label(code, -0.15)] for code, found in stock.items()}
    flight = Sweep(stock=Stock(labels))
    flight.scanner.go_on_with(store.counted(run))
    clock = LoopClock()
    with StoreWriter(store, run, time.time_ns(), clock, print) as writer:
        writing = asyncio.create_task(writer.run(print))
        while flight.phase is not Phase.LAND:
            flight.fly(_CHUNK_S)
            for finding in flight.findings:
                writer.put(finding, finding.location.encode() * 50)
            for settled in flight.settled:
                writer.settle(settled)
            # in the air there are seconds for what is a moment here
            await asyncio.sleep(_WRITING_S if flight.findings or flight.settled else 0.0)
            flight.findings, flight.settled = [], []
        writing.cancel()
        await asyncio.gather(writing, return_exceptions=True)


def _killed(folder: Path, run: str, rng: random.Random) -> tuple[list[str], bool]:
    """What a process told of its writes, and whether it was killed before its end."""
    read_end, write_end = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(read_end)
        with ToldStore(folder, write_end) as store:
            real(_count(store, run))
        os._exit(0)
    os.close(write_end)
    lines: list[str] = []
    wait_s, writes = rng.uniform(0.0, 0.02), rng.randrange(_MOST_WRITES)
    with os.fdopen(read_end, "rb", buffering=0) as pipe:
        if writes == 0:
            select.select((), (), (), rng.uniform(0.0, 1.0))
        for line in pipe:
            lines.append(line.decode().strip())
            if len(lines) == writes:
                break
        select.select((), (), (), wait_s)
        os.kill(child, signal.SIGKILL)
        lines += pipe.read().decode().splitlines()
    _, status = os.waitpid(child, 0)
    return lines, os.WIFSIGNALED(status)


def main() -> None:
    kills, seed, folder = int(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3])
    rng = random.Random(seed)
    SqliteStore(folder).close()
    seen: dict[str, tuple[str, str]] = {}
    sure: set[tuple[str, str]] = set()
    taken: set[str] = set()
    killed = lost = double = again = contradicted = stood = once = unsound = 0
    run = 1
    while killed < kills:
        name = f"count-{run}"
        with SqliteStore(folder) as store:
            counted = {place.location for place in store.counted(name)}
            before = {look.id for code in counted for look in store.history(code) if look.run == name}
        lines, was_killed = _killed(folder, name, rng)
        killed += was_killed
        for line in lines:
            kind, *what = line.split(" ")
            of, code = what[-2:]
            if kind == "seen":
                seen[what[0]] = of, code
            elif kind == "sure":
                sure.add((of, code))
            else:
                contradicted += (of, code) in sure
                sure.discard((of, code))
                taken |= {id_ for id_, at in seen.items() if at == (of, code)}
        database = sqlite3.connect(folder / "inventory.db")
        held = list(database.execute("SELECT id, run, location, standing FROM observation"))
        unsound += database.execute("PRAGMA integrity_check").fetchone() != ("ok",)
        database.close()
        booked = Counter((of, code) for _, of, code, standing in held if standing == 1)
        # killed between taking a booking back and telling so
        sure -= {
            (of, code) for _, of, code, standing in held if standing == 2 and code in _TWICE
        } - booked.keys()
        lost += len(seen.keys() - {row[0] for row in held}) + len(sure - booked.keys())
        stood = len(taken & {id_ for id_, *_, standing in held if standing == 1})
        double += sum(count > 1 for count in booked.values())
        again += sum(
            of == name and code in counted and id_ not in before and code not in _TWICE
            for id_, of, code, _ in held
        )
        if all((name, code) in booked for code in SITE.locations):
            looks = Counter(code for _, of, code, _ in held if of == name)
            once += sum(looks[code] == 1 for code in _TWICE)
            run += 1
    print(
        json.dumps(
            {
                "kills": killed, "writes": len(seen) + len(sure), "lost": lost, "double": double,
                "again": again, "contradicted": contradicted, "stood": stood, "once": once,
                "unsound": unsound, "completed": run - 1,
            }
        )
    )  # fmt: skip


if __name__ == "__main__":
    main()
