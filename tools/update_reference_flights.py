"""The reference flights in tests/replay/flights: what today's code makes of them, and how to make them anew.

Each is the beginning of a simulated flight: all that the pilot was given and all that it decided, tick by
tick, and a picture.  A test replays them: a change of behaviour shows there as drift.

python -m tools.update_reference_flights                  says what drifts, exit 1 if anything does
python -m tools.update_reference_flights --i-mean-it      says so and records them anew: commit them with
                                                          the reason for the change
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from flightd.adapters.recorder.recorder import McapRecorder, wait_for_disk
from flightd.core.topics import Document, RecordedFrame, Topic
from flightd.replay.log import Entry, read_log

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "tests" / "replay" / "flights"
LARGEST_BYTES = 300_000


@dataclass(frozen=True)
class Reference:
    """How a reference flight is flown, and for how long it is kept."""

    name: str
    options: tuple[str, ...]
    seconds: float = 10.0


REFERENCES = (
    Reference("along", ("--seed", "14", "--set", 'mission.nodes=["A1", "A2"]')),
    Reference("shelf", ("--seed", "12", "--set", 'mission.nodes=["A2"]', "--set", "mission.heading=shelf")),
    Reference(
        "first-order",
        ("--seed", "13", "--set", 'mission.nodes=["A2"]', "--set", "control.tilt_compensation=first_order"),
    ),
)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--i-mean-it", action="store_true", help="record the flights anew")
    parser.add_argument("--folder", type=Path, default=FOLDER)
    parser.add_argument("names", nargs="*", help="which flights; none: all")
    options = parser.parse_args()
    chosen = [reference for reference in REFERENCES if reference.name in (options.names or names())]
    drifted = False
    for reference in chosen:
        log = options.folder / f"{reference.name}.mcap"
        if log.exists():
            print(f"{log.name}:", flush=True)
            drifted |= replayed(log) != 0
        else:
            print(f"{log.name}: not there yet")
            drifted = True
        if options.i_mean_it:
            with tempfile.TemporaryDirectory() as folder:
                keep(reference, flown(reference, Path(folder)), log)
            print(f"{log.name}: recorded anew, {log.stat().st_size} bytes")
    return int(drifted and not options.i_mean_it)


def names() -> list[str]:
    return [reference.name for reference in REFERENCES]


def replayed(log: Path) -> int:
    """What `flightd replay` says of it goes to the terminal."""
    command = [sys.executable, "-m", "flightd", "replay", str(log), "--tolerance", "1e-6"]
    return subprocess.run(command, cwd=ROOT, check=False).returncode  # noqa: S603


def flown(reference: Reference, folder: Path) -> Path:
    """A new flight's log.  The mission may fail: that, too, is behaviour."""
    options = [*reference.options, "--out", str(folder), "--json"]
    command = [sys.executable, "-m", "flightd", "sim", *options]
    subprocess.run(command, cwd=ROOT, check=False, stdout=subprocess.DEVNULL)  # noqa: S603
    return folder / "flight.mcap"


def keep(reference: Reference, log: Path, to: Path) -> None:
    """The part of a log that a replay needs, in as little room as possible."""
    to.parent.mkdir(parents=True, exist_ok=True)
    with McapRecorder(to, when_full=wait_for_disk) as recorder:
        for entry in _beginning(log, reference.seconds):
            if isinstance(entry.message, RecordedFrame):
                recorder.image(entry.topic, entry.stamp_ns, entry.message.seq, entry.message.jpeg)
            else:
                recorder.record(entry.topic, entry.stamp_ns, entry.message)
    if to.stat().st_size > LARGEST_BYTES:
        raise SystemExit(f"{to}: {to.stat().st_size} bytes are too many: keep fewer seconds of it")


def _beginning(log: Path, seconds: float) -> Iterator[Entry]:
    """Configuration, map, the ticks and decisions of so many seconds, the last picture and its lines."""
    wanted = {Topic.CONFIG, Topic.MAP, Topic.ORDER, Topic.TICK, Topic.DECISION, Topic.LINES, Topic.FRAME}
    entries = read_log(log, wanted).entries
    end_ns = min(entry.stamp_ns for entry in entries if entry.topic == Topic.TICK) + round(seconds * 1e9)
    seen = {entry.stamp_ns for entry in entries if entry.topic == Topic.LINES}
    pictures = [e.stamp_ns for e in entries if e.topic == Topic.FRAME and e.stamp_ns in seen]
    picture_ns = max(stamp_ns for stamp_ns in pictures if stamp_ns < end_ns)
    for entry in entries:
        if entry.topic == Topic.CONFIG and isinstance(entry.message, Document):
            yield Entry(entry.topic, entry.stamp_ns, Document(_portable(entry.message.text)))
        elif entry.topic == Topic.MAP:
            yield entry
        elif entry.topic in {Topic.LINES, Topic.FRAME}:
            if entry.stamp_ns == picture_ns:
                yield entry
        elif entry.stamp_ns < end_ns:
            yield entry


def _portable(config: str) -> str:
    """The configuration without the paths of the machine that flew it."""
    table = json.loads(config)
    table["mission"]["site"] = Path(table["mission"]["site"]).name
    return json.dumps(table)


if __name__ == "__main__":
    raise SystemExit(main())
