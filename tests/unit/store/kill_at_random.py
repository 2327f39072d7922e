"""Kill a writing process at random moments and see what the store still holds.

    python -m tests.unit.store.kill_at_random 200 1 FOLDER

Prints one JSON document: kills, commits that were reported before the kill, how many of those were lost,
how many stores did not open sound.  Each look is committed pending and confirmed before it is reported.
Killing uses fork, so this is a program of its own.
"""

from __future__ import annotations

import json
import os
import random
import signal
import sqlite3
import sys
from pathlib import Path

from flightd.adapters.store.sqlite import SqliteStore
from flightd.core.inventory import CountPose, LocationState, Observation
from flightd.core.types import CodeRead


def look(number: int, run: str = "kill", evidence: str = "") -> Observation:
    """The `number`-th observation of a run over 50 locations."""
    read = CodeRead("QR Code", f"PALLET-{number:06d}", (), True, 1, 1.0)
    pose = CountPose("A1", 0.1 * number, -1.0, 1.6, 0.5)
    location = f"A-{number % 50:02d}"
    return Observation(run, location, 10**18 + number, LocationState.READ, 0.9, (read,), pose, evidence)


def _die_in(seconds: float) -> None:
    """Ask the kernel to kill this process: it hears nothing of the alarm."""
    signal.setitimer(signal.ITIMER_REAL, seconds)


def _write_until_killed(folder: Path, first: int, told: int, opening_s: float, writing_s: float) -> None:
    """Write for ever; the end comes `opening_s` from now, or `writing_s` after a first commit was told."""
    _die_in(opening_s)
    store = SqliteStore(folder)
    number = first
    while True:
        evidence = store.keep_evidence(b"picture %d " % number * 500)
        seen = look(number, evidence=evidence)
        store.commit(seen, confirmed=False)
        store.settle(seen.run, [seen.location], confirmed=True)
        os.write(told, f"{seen.id} {evidence}\n".encode())
        if number == first:
            _die_in(writing_s)
        number += 1


def main() -> None:
    kills, seed, folder = int(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3])
    rng = random.Random(seed)
    told: dict[str, str] = {}
    lost = unsound = 0
    for round_number in range(kills):
        opening_s = 60.0 if round_number % 4 else rng.uniform(0.0005, 0.06)
        writing_s = rng.uniform(0.0005, 0.06)
        read_end, write_end = os.pipe()
        child = os.fork()
        if child == 0:
            os.close(read_end)
            _write_until_killed(folder, 1_000_000 * round_number, write_end, opening_s, writing_s)
        os.close(write_end)
        with os.fdopen(read_end) as pipe:
            lines = pipe.read().splitlines()
        os.waitpid(child, 0)
        told.update(line.split(" ") for line in lines)  # type: ignore[misc]
        with SqliteStore(folder) as store:
            held = {seen.id for n in range(50) for seen in store.history(f"A-{n:02d}")}
            lost += len(told.keys() - held)
            lost += sum(not store.evidence.path(name).exists() for name in told.values())
        database = sqlite3.connect(folder / "inventory.db")
        confirmed = {row[0] for row in database.execute("SELECT id FROM observation WHERE standing = 1")}
        lost += len(told.keys() - confirmed)
        unsound += database.execute("PRAGMA integrity_check").fetchone() != ("ok",)
        database.close()
    print(json.dumps({"kills": kills, "commits": len(told), "lost": lost, "unsound": unsound}))


if __name__ == "__main__":
    main()
