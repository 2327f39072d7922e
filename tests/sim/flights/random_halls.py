"""Random halls, drawn over every option of `flightd map new` and flown in lockstep to their first scan.

python -m tests.sim.flights.random_halls 50 flies the first fifty and prints a table; exit 1 where one did
not get there.  `--from 7` begins with another one.
"""

from __future__ import annotations

import argparse
import contextlib
import inspect
import io
import json
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from flightd.app.simulation.launch import fly
from flightd.app.simulation.simulation import Simulation
from flightd.cli.map.new import new
from flightd.config.paths import shipped
from flightd.config.schema import Config, load_config
from flightd.core.errors import InputError, RunError
from flightd.core.geometry import Lens
from flightd.core.snapshot import Snapshot
from flightd.core.types import Phase
from flightd.sim.scenario.scenario import Scenario
from flightd.site.site import Site
from flightd.site.site_file import load_site

LIMIT_S = 900.0
_SITE_OPTIONS = set(inspect.signature(new).parameters) - {"out", "name", "force", "as_json"}
_PATTERNS = (
    None,
    None,
    "{aisle}{side}-{bay:02}-{level}-{position}",
    "{aisle}{side}{bay:03}/{level}.{position}",
)


@dataclass(frozen=True, slots=True)
class FirstScan:
    """How far a flight got: `scanned` the first view of a shelf, or how it ended before that."""

    seed: int
    options: str
    locations: int
    scanned: bool
    ended: str
    flight_s: float


def draw_hall(seed: int) -> dict[str, Any]:
    """Arguments of `map new`, the same for the same seed.  Some of them do not fit together."""
    rng = random.Random(f"hall {seed}")
    levels = _levels(rng)
    shelf_height_m = round(levels[-1] + rng.uniform(0.3, 1.5), 2)
    shelf_distance_m = round(rng.uniform(1.0, 1.8), 2)
    options = {
        "aisles": rng.choice((1, 2, 2, 3, 4, 6)),
        "nodes": rng.randint(2, 8),
        "spacing_m": ",".join(str(round(rng.uniform(1.1, 2.4), 2)) for _ in range(rng.randint(1, 4))),
        "pitch_m": round(2 * shelf_distance_m + rng.choice((0.0, rng.uniform(0.0, 2.0))), 2),
        "line_width_m": round(rng.uniform(0.05, 0.1), 3),
        "line_colour": rng.choice(("yellow", "yellow", "white", "red", "blue")),
        "cross_half_m": round(rng.uniform(0.3, 0.8), 2),
        "overrun_m": round(rng.uniform(0.2, 0.8), 2),
        "shelves": rng.choice(("both", "both", "left", "right")),
        "shelf_distance_m": shelf_distance_m,
        "shelf_height_m": shelf_height_m,
        "ceiling_m": round(max(shelf_height_m + rng.uniform(1.2, 5.0), 3.2), 2),  # room to fly
        "levels_m": ",".join(map(str, levels)),
        "bay_width_m": round(
            rng.choice((rng.uniform(0.3, 1.0), rng.uniform(0.8, 2.0), rng.uniform(1.5, 4.0))), 2
        ),
        "positions": rng.choice((1, 1, 1, 2, 3, 5)),
        "deck_below_label_m": rng.choice((None, None, 0.0, round(rng.uniform(0.05, 0.8), 2))),
        "pattern": rng.choice(_PATTERNS),
    }
    assert options.keys() == _SITE_OPTIONS, f"draw {options.keys() ^ _SITE_OPTIONS} too"
    return options


def _levels(rng: random.Random) -> list[float]:
    """One to five heights of labels, now and then very near each other."""
    heights = [rng.choice((0.0, 0.05, 0.3, rng.uniform(0.1, 1.2)))]
    gap_m = rng.choice((0.06, 0.15, 0.4, 0.9, 1.4))
    for _ in range(rng.randint(0, 4)):
        heights.append(heights[-1] + gap_m * rng.uniform(0.8, 1.3))
    return [round(height, 2) for height in heights]


def command_line(options: dict[str, Any]) -> str:
    """As a person would type it."""
    words = (f"--{key.replace('_', '-')} {value}" for key, value in options.items() if value is not None)
    return " ".join(words)


def make_hall(seed: int, folder: Path) -> tuple[dict[str, Any], Site]:
    """The first hall of that seed whose options fit together, made as the command makes it."""
    for attempt in range(100):
        options = draw_hall(seed + 1000 * attempt)
        path = folder / f"hall-{seed}.toml"
        with contextlib.suppress(InputError), contextlib.redirect_stdout(io.StringIO()):
            new(path, **options)
            return options, load_site(path)
    raise AssertionError("no hall fits together")


def fly_to_first_scan(seed: int, folder: Path, scenario: Scenario) -> FirstScan:
    """Fly to the first node with locations and end when a view of them is scanned.  What the simulation
    raises is not caught, but for a flight that ended by itself."""
    options, site = make_hall(seed, folder)
    counted = {location.node for location in site.locations.values()}
    node = next(node for node in site.serpentine_route() if node in counted)
    watch = _Watch()
    try:
        fly(Simulation(_config(node, scenario), site, scenario, seed, None, folder, watch))
    except RunError:
        if not watch.scanned:
            raise
    return FirstScan(
        seed, command_line(options), len(site.locations), watch.scanned, watch.ended, watch.flight_s
    )


class _Watch:
    """Sees a flight's status, and ends it as an operator's SIGTERM does when a view is scanned."""

    def __init__(self) -> None:
        self.scanned = False
        self.ended = "not begun"
        self.flight_s = 0.0
        self._began_ns: int | None = None
        self._phase = Phase.PREFLIGHT

    def __call__(self, status: Snapshot) -> None:
        if self._began_ns is None:
            self._began_ns = status.stamp_ns
        if self.scanned:
            return
        self.flight_s = round((status.stamp_ns - self._began_ns) * 1e-9, 1)
        self.ended = f"{status.phase}: {status.reason}"
        if self._phase is Phase.SCAN and status.phase in {Phase.CLIMB, Phase.TURN, Phase.FOLLOW}:
            self.scanned = True
            signal.raise_signal(signal.SIGTERM)
        self._phase = status.phase


def _config(node: str, scenario: Scenario) -> Config:
    """What `flightd sim` flies with where there are racks, to one node."""
    config = load_config(shipped("sim.toml"))
    down, front = _lens_keys(scenario.camera.camera().lens), _lens_keys(scenario.front_camera.camera().lens)
    return config.model_copy(
        update={
            "mission": config.with_values(mission={"nodes": (node,), "autostart_countdown_s": 0.0}).mission,
            "camera": config.camera.model_copy(update=down),
            "front_camera": config.front_camera.model_copy(update={"url": "udp://127.0.0.1:5601", **front}),
        }
    )


def _lens_keys(lens: Lens) -> dict[str, Any]:
    keys = "width_px", "height_px", "fx_px", "fy_px", "cx_px", "cy_px", "distortion"
    return {key: getattr(lens, key) for key in keys}


def _fly_each(seeds: Sequence[int]) -> int:
    """Fly them one after the other, each in a process of its own; how many did not get to a scan."""
    failed = 0
    print(f"{'hall':>4} {'places':>6} {'flight':>7} {'wall':>6}  outcome")
    for seed in seeds:
        started = time.monotonic()
        with tempfile.TemporaryDirectory() as folder:
            command = [
                sys.executable,
                "-m",
                "tests.sim.flights.random_halls",
                "--one",
                str(seed),
                "--folder",
                folder,
            ]
            try:
                done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S, check=False)
            except subprocess.TimeoutExpired:
                failed += 1
                print(f"{seed:>4} {'':>6} {'':>7} {LIMIT_S:>6.0f}  EXCEPTION: no end", flush=True)
                continue
        wall_s = time.monotonic() - started
        if done.returncode or "Traceback" in done.stderr:
            failed += 1
            last = (done.stderr.strip().splitlines() or ["no word"])[-1]
            print(f"{seed:>4} {'':>6} {'':>7} {wall_s:>6.0f}  EXCEPTION: {last}", flush=True)
            print(f"     map new {command_line(draw_hall(seed))}")
            continue
        found = FirstScan(**json.loads(done.stdout.splitlines()[-1]))
        outcome = "scanned" if found.scanned else f"NO SCAN: {found.ended}"
        print(f"{seed:>4} {found.locations:>6} {found.flight_s:>7.1f} {wall_s:>6.0f}  {outcome}", flush=True)
        if not found.scanned:
            failed += 1
            print(f"     map new {found.options}", flush=True)
    print(f"{len(seeds) - failed} of {len(seeds)} flew to their first scan")
    return failed


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", type=int, nargs="?", default=50)
    parser.add_argument("--from", dest="first", type=int, default=1)
    parser.add_argument("--one", type=int)
    parser.add_argument("--folder", type=Path)
    given = parser.parse_args()
    if given.one is None:
        return 1 if _fly_each(range(given.first, given.first + given.count)) else 0
    print(json.dumps(asdict(fly_to_first_scan(given.one, given.folder, Scenario()))))
    return 0


if __name__ == "__main__":
    sys.exit(main())
