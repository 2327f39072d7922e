"""Fly three drones with pixels in one hall by the ground station's own fleet, judged by the truth.

Each drone is a whole `flightd sim`: a daemon, a world behind sockets, a camera.  The station is `flightd
ground --fleet`; it gives them the same eight nodes again and again, and is killed at a third and at two
thirds of the time.  A drone whose flight is over starts anew on its pad.

Printed, as JSON: nodes visited, flights and how they ended, the least distance between two drones at all and
while both are in the air.  Exit 1 where two in the air came nearer than their bodies and clearances, or
nothing was visited.  A drone takes a core whole, and one that gets less loses its lines and lands: by
`--pace` the time of all drones, and the minutes with it, run so much faster than the station's.  Unless
given it is what this machine's cores bear.

python -m tools.fly_fleet [--minutes 10] [--pace 0.4] [--seed 1] [--out DIR]
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import itertools
import json
import math
import os
import signal
import socket
import sys
import tempfile
import time
import urllib.request
from asyncio.subprocess import Process
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
from mcap.reader import make_reader

from flightd.core.errors import FlightdError
from flightd.fleet.traffic.cells import CellSize
from flightd.runtime.free_ports import free_ports

Way: TypeAlias = npt.NDArray[np.float64]
"""Where a drone truly was: rows (N, 4) of seconds, x, y and height in metres."""

PADS = {"a": "A1", "b": "B1", "c": "B6"}
NODES = ("A2", "A3", "A4", "A5", "B2", "B3", "B4", "B5")
_KILLED_AT = (1 / 3, 2 / 3)
_LOOK_S = 2.0
_AWAY_S = 2.0
_LAST_TOUR_S = 60.0
"""None is given so late: it would not be flown."""
_ENDING_S = 20.0
_IN_AIR_M = 0.5
_STEP_S = 0.05
_CORES_EACH = 1.5
"""Of a drone by the clock, with what it needs at times, and its share of the station's."""
_AISLE = """
[[aisle]]
id = "{name}"
x_m = 0.0
y_m = {y_m}
spacing_m = [2.0, 1.6, 1.6, 1.6, 2.0]
shelf_distance_m = 1.2
shelf_height_m = 2.5
"""
_HALL = """
[site]
name = "hall"
line_width_m = 0.075
line_colour = "yellow"
ceiling_m = 6.0
"""
_CROSSES = """
[[cross]]
nodes = ["A2", "B2"]

[[cross]]
nodes = ["A5", "B5"]
"""
_PAD = """
[[pad]]
id = "{name}"
node = "{node}"
size_m = 0.5
charge = {charge}
"""


def hall_of(drone: str) -> str:
    """The hall as this drone's site file has it: the pads of others are none of its own."""
    pads = (
        _PAD.format(
            name="home" if name == drone else f"pad-{name}", node=node, charge=str(name == drone).lower()
        )
        for name, node in PADS.items()
    )
    aisles = (_AISLE.format(name=name, y_m=y_m) for name, y_m in (("A", 0.0), ("B", 3.4)))
    return "".join([_HALL, *aisles, _CROSSES, *pads])


class Flown:
    """The fleet's processes, and what the station told of it."""

    def __init__(self, out: Path, seed: int, minutes: float, pace: float) -> None:
        self._out, self._seed, self._pace = out, seed, pace
        lasts_s = 60.0 * minutes / pace
        self._ends_s = time.monotonic() + lasts_s
        self._kills_s = [self._ends_s - lasts_s * (1.0 - part) for part in _KILLED_AT]
        self._page, *ports = free_ports(1 + 2 * len(PADS), socket.SOCK_STREAM)
        self._ports = {name: (ports[2 * i], ports[2 * i + 1]) for i, name in enumerate(PADS)}
        self._processes: list[Process] = []
        self.visited = 0

    async def fly(self) -> None:
        """Until the time is over and every process has ended."""
        drones = [asyncio.ensure_future(self._drone(name)) for name in PADS]
        station = await self._station()
        try:
            done, begun = 0, True
            while (now_s := time.monotonic()) < self._ends_s:
                await asyncio.sleep(_LOOK_S)
                if self._kills_s and now_s > self._kills_s[0]:
                    self._kills_s.pop(0)
                    os.killpg(station.pid, signal.SIGKILL)
                    await station.wait()
                    await asyncio.sleep(_AWAY_S)
                    station, begun = await self._station(), True
                    continue
                told = await asyncio.to_thread(self._asked, "/api/fleet")
                if not told.get("flies"):
                    continue
                self.visited += max(len(told["done"]) - done, 0)
                done = len(told["done"])
                left_s = (self._ends_s - now_s) * self._pace
                is_over = not told["open"] and not told["given"]
                # nobody leaves the ground for what a dead station was asked for, till a person asks anew
                if (is_over or begun) and left_s > _LAST_TOUR_S:
                    await asyncio.to_thread(self._asked, "/api/fleet/tour", {"nodes": NODES})
                    begun = False
        finally:
            for drone in drones:
                drone.cancel()
            await self._end()

    async def _drone(self, name: str) -> None:
        site = self._out / f"site-{name}.toml"
        site.write_text(hall_of(name), encoding="utf-8")
        status, command = self._ports[name]
        settings = [
            "mission.autostart=false", "mission.start_countdown_s=0", "mission.dwell_s=1",
            "ground.listen=127.0.0.1", f"ground.status_port={status}", f"ground.command_port={command}",
            "ground.lost_action=hold",
        ]  # fmt: skip
        for flight in itertools.count(1):
            folder = self._out / f"{name}-{flight}"
            given = ["sim", "--speed", f"{self._pace:g}", "--warehouse", str(site), "--out", str(folder)]
            given += [
                f"--seed={self._seed + 100 * flight + ord(name)}",
                *(f"--set={each}" for each in settings),
            ]
            await (await self._started(given, f"{name}-{flight}.txt")).wait()

    async def _station(self) -> Process:
        drones = [f"--drone={name}=127.0.0.1:{a}/{b}" for name, (a, b) in self._ports.items()]
        given = ["ground", "--fleet", f"--listen=127.0.0.1:{self._page}", f"--state={self._out / 'state'}"]
        return await self._started([*given, *drones], "station.txt")

    async def _started(self, given: Sequence[str], log: str) -> Process:
        with (self._out / log).open("ab") as told:
            process = await asyncio.create_subprocess_exec(
                *(sys.executable, "-m", "flightd", *given),
                stdout=told,
                stderr=asyncio.subprocess.STDOUT,
                start_new_session=True,
            )
        self._processes.append(process)
        return process

    async def _end(self) -> None:
        for ending in (signal.SIGINT, signal.SIGKILL):
            for process in self._processes:
                if process.returncode is None:
                    with contextlib.suppress(ProcessLookupError):
                        os.killpg(process.pid, ending)
            running = [process.wait() for process in self._processes]
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(asyncio.gather(*running), _ENDING_S)

    def _asked(self, path: str, told: object = None) -> Mapping[str, Any]:
        page = f"http://127.0.0.1:{self._page}"
        request = urllib.request.Request(  # noqa: S310 - of this machine
            f"{page}{path}",
            None if told is None else json.dumps(told).encode(),
            {"Origin": page, "Content-Type": "application/json"},
        )
        try:
            with urllib.request.urlopen(request, timeout=10.0) as answer:  # noqa: S310
                heard: Mapping[str, Any] = json.load(answer)
        except (OSError, ValueError):  # it is being started anew
            return {}
        return heard


def way_of(out: Path, drone: str) -> Way:
    """Of all its flights."""
    rows = []
    for log in out.glob(f"{drone}-*/truth.mcap"):
        with log.open("rb") as stream:
            for _, _, message in make_reader(stream).iter_messages(topics=["/truth"]):
                truth = json.loads(message.data)
                rows.append((message.log_time * 1e-9, truth["x_m"], truth["y_m"], truth["height_m"]))
    return np.array(sorted(rows)).reshape(-1, 4)


def least_distances(ways: Mapping[str, Way]) -> tuple[float, float]:
    """Across, in metres, between any two drones: at all, and while both are in the air."""
    least, in_air = math.inf, math.inf
    for a, b in itertools.combinations(ways.values(), 2):
        times = np.arange(max(a[0, 0], b[0, 0]), min(a[-1, 0], b[-1, 0]), _STEP_S)
        at_a, at_b = (
            np.stack([np.interp(times, way[:, 0], way[:, axis]) for axis in (1, 2, 3)]) for way in (a, b)
        )
        across = np.hypot(*(at_a - at_b)[:2])
        least = min(least, across.min(initial=math.inf))
        both = np.minimum(at_a[2], at_b[2]) > _IN_AIR_M
        in_air = min(in_air, across[both].min(initial=math.inf))
    return least, in_air


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=10.0)
    borne = min((os.cpu_count() or 1) / _CORES_EACH / len(PADS), 1.0)
    parser.add_argument("--pace", type=float, default=round(borne, 2))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    if not 0.05 <= options.pace <= 1.0:
        parser.error(f"--pace {options.pace:g}: expected 0.05 to 1")
    out = options.out or Path(tempfile.mkdtemp(prefix="flightd-fleet-"))
    try:
        out.mkdir(parents=True, exist_ok=True)
        if any(out.iterdir()):
            parser.error(f"--out {out}: is not empty")
        flown = Flown(out.resolve(), options.seed, options.minutes, options.pace)
        asyncio.run(flown.fly())
    except (OSError, FlightdError) as err:
        print(err, file=sys.stderr)
        return 2
    least_m, in_air_m = least_distances({drone: way_of(out, drone) for drone in PADS})
    flights = {}
    for told in sorted(out.glob("[abc]-*/summary.json")):
        summary = json.loads(told.read_text(encoding="utf-8"))
        flights[told.parent.name] = f"{summary['mission']}: {summary['reason']} ({summary['verdict']})"
    cell = CellSize()
    good = flown.visited > 0 and bool(in_air_m > cell.body_m + 2 * cell.clearance_m)
    print(
        json.dumps(
            {
                "minutes": options.minutes,
                "pace": options.pace,
                "visited": flown.visited,
                "flights": flights,
                "least_m": round(least_m, 2),
                "least_in_air_m": round(in_air_m, 2),
                "good": good,
                "out": str(out),
            },
            indent=1,
        )
    )
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
