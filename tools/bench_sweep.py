"""What counting in passing gains over stopping: both flown over one aisle, judged by the simulator's truth.

A generated aisle with racks on both sides, four levels and two places to a bay and level, in lockstep
simulation.  `--site` flies another site instead.

python -m tools.bench_sweep [--nodes N] [--seed N] [--site FILE] [--mode stop|sweep]… [--out DIR]
    [--world usual|rough|ideal] [--set KEY=VALUE]…
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from flightd.app.build import scanner_of
from flightd.config.schema import load_config
from flightd.core.topics import Topic
from flightd.core.types import Event
from flightd.replay.log import read_log
from flightd.site.site_file import load_site
from tools.sweep_time import spent, table

ROOT = Path(__file__).parents[1]
CONFIG = ROOT / "configs" / "sim.toml"
SPACING_M = 1.3
ROWS = (
    ("places an hour in the air", lambda s: f"{s['locations_per_hour']:.0f}"),
    ("time in the air, s", lambda s: f"{s['flight_time_s']:.0f}"),
    ("places counted", lambda s: f"{s['locations_visited']} of {s['locations_planned']}"),
    ("places with the right state", lambda s: f"{s['locations_right']} of {s['locations_planned']}"),
    ("codes read", lambda s: f"{s['codes_read']} of {s['codes_expected']}"),
    ("codes wrong, or at a wrong place", lambda s: str(s["codes_wrong"])),
    ("empty places told as such", lambda s: f"{s['empty_right']} of {s['empty_expected']}"),
    ("places told empty that are not", lambda s: str(s["empty_wrong"])),
    ("unreadable places told as such", lambda s: f"{s['unreadable_told']} of {s['unreadable_expected']}"),
    ("verdict", lambda s: s["verdict"]),
)


def aisle(nodes: int) -> str:
    """A site file of one aisle with that many nodes: 16 places to a node."""
    spacing = ", ".join([f"{SPACING_M}"] * (nodes - 1))
    return f"""
[site]
name = "aisle-{16 * nodes}"
ceiling_m = 6.0

[[aisle]]
id = "A"
x_m = 0.0
y_m = 0.0
spacing_m = [{spacing}]
shelf_distance_m = 1.2
shelf_height_m = 3.3

[[rack]]
bay_width_m = {SPACING_M}
levels_m = [0.7, 1.4, 2.1, 2.8]
positions = 2

[[pad]]
id = "home"
node = "A1"
size_m = 0.5
"""


def flown(mode: str, site: Path, out: Path, seed: int, world: str, settings: list[str]) -> dict[str, Any]:
    """The summary of one flight, with what it left for a stop."""
    values = [f'scan.mode="{mode}"', *settings]
    options = [word for value in values for word in ("--set", value)]
    where = ("--warehouse", str(site), "--seed", str(seed), "--world", world, "--out", str(out), "--json")
    command = [sys.executable, "-m", "flightd", "sim", *where, *options]
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=False)  # noqa: S603 - our own
    if not done.stdout:
        raise SystemExit(f"bench_sweep: the flight by {mode} failed: exit {done.returncode}")
    summary: dict[str, Any] = json.loads(done.stdout)
    events = read_log(out / "flight.mcap", {Topic.EVENT}).messages(Event)
    said = list(events)
    return summary | {
        "left": [event.text for event in said if event.name == "swept"],
        "time": table(spent(said)),
    }


def told(site: Path) -> list[str]:
    """What limits the speed, as the plan says it."""
    front = {"url": "udp://127.0.0.1:0"}
    config = load_config(CONFIG).with_values(front_camera=front, scan={"mode": "sweep"})
    where = load_site(site)
    runs = [[node.id for node in where.aisle_nodes(aisle.id)] for aisle in where.aisles]
    return [sweep.text for sweep in scanner_of(config, where).told_sweeps(runs)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--nodes", type=int, default=8)
    parser.add_argument("--seed", type=int, default=3)
    parser.add_argument("--site", type=Path)
    parser.add_argument("--mode", action="append", choices=("stop", "sweep"))
    parser.add_argument("--world", default="usual", choices=("usual", "rough", "ideal"))
    parser.add_argument("--out", type=Path)
    parser.add_argument("--set", action="append", default=[], dest="settings")
    asked = parser.parse_args()
    out = asked.out or Path(tempfile.mkdtemp(prefix="bench-sweep-"))
    out.mkdir(parents=True, exist_ok=True)
    site = asked.site
    if site is None:
        site = out / "aisle.toml"
        site.write_text(aisle(asked.nodes), encoding="utf-8")
    for text in told(site):
        print(f"in passing, {text}")
    modes = asked.mode or ["stop", "sweep"]
    by_mode = {
        mode: flown(mode, site.resolve(), out.resolve() / mode, asked.seed, asked.world, asked.settings)
        for mode in modes
    }
    print("| | " + " | ".join(modes) + " |\n|---|" + "---|" * len(modes))
    for name, of in ROWS:
        print(f"| {name} | " + " | ".join(of(by_mode[mode]) for mode in modes) + " |")
    for mode in modes:
        for text in by_mode[mode]["left"]:
            print(f"{mode}: {text}")
        print(f"{mode}: {by_mode[mode]['time']}")


if __name__ == "__main__":
    main()
