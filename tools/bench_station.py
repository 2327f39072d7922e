"""What twenty pages of a ground station, five of them stalled, cost a flight and the station.

A simulated flight in real time, `flightd ground` and the pages are processes of their own.  Windows without
pages and with them take turns, so that what else the machine does counts for both.  Told, as one JSON object
on standard output and a table on standard error:

flight    intervals between setpoints (by the flight log; p99 without and with pages, and the difference),
          and over the whole flight on the wire
ages      of statuses and pictures, stamp to page (plain pages) and stamp to drawn (Chromium)
line      the same at the end of a line of 4 Mbit/s, with what the page loads and when it is ready
killed    what the flight does after kill -9 of the station
memory    of the station, with --minutes: pages come and go while a drone flies mission after mission

python -m tools.bench_station [--windows N] [--seconds S] [--minutes M] [--mbit 4,1] [--pin] [--flight-nice N]
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import signal
import socket
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from statistics import linear_regression
from typing import Any, TextIO

from flightd.core.errors import FlightdError
from flightd.core.types import AttitudeSetpoint, Event, EventLevel, Status
from flightd.replay.log import FlightLog
from flightd.runtime.free_ports import free_ports
from tools.measure_daemon import daemon_of
from tools.station_crowd import quantiles
from tools.station_processes import CrowdProcess, SimulatedFlight, Started, Station, ending, until

AIRBORNE_S, END_S = 120.0, 240.0
SETTLE_S = 5.0
SAMPLE_S = 5.0
CHURN_S = 2.0
MOST_STEP_MS = 1000.0
"""Between two setpoints; more is a pause of the flight, as on the ground."""


@dataclass(frozen=True)
class Options:
    """`nice` is that of station and pages.  With `pin` the daemon has one core, all else the other."""

    windows: int
    seconds: float
    mbits: tuple[float, ...]
    nice: int
    flight_nice: int
    pin: bool
    folder: Path


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--windows", type=int, default=4, help="windows with pages, and as many without")
    parser.add_argument("--seconds", type=float, default=15.0, help="a window's length")
    parser.add_argument("--minutes", type=float, default=0.0, help="of the memory's measure")
    parser.add_argument("--mbit", default="4,1", help="lines to try, Mbit/s")
    parser.add_argument("--nice", type=int, default=10, help="of station and pages")
    parser.add_argument("--flight-nice", type=int, default=0, help="of flight and world; below 0 needs root")
    parser.add_argument("--keep", help="folder for logs; none: they are not kept")
    parser.add_argument("--pin", action="store_true", help="the daemon on one core, all else on another")
    parser.add_argument("--no-flight", action="store_true", help="only the memory")
    words = parser.parse_args()
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    mbits = tuple(float(mbit) for mbit in words.mbit.split(",") if mbit)
    told: dict[str, Any] = {
        "flight_nice": words.flight_nice,
        "cores": os.cpu_count(),
        "load": os.getloadavg(),
        "nice": words.nice,
        "pin": words.pin,
    }
    with tempfile.TemporaryDirectory() as folder:
        kept = Path(words.keep or folder)
        options = Options(words.windows, words.seconds, mbits, words.nice, words.flight_nice, words.pin, kept)
        if not words.no_flight:
            told |= _or_why_not(lambda: measured_crowd(options), "flight")
            told |= _or_why_not(lambda: measured_line_and_kill(options), "line")
        if words.minutes:
            told |= _or_why_not(lambda: measured_memory(options, words.minutes * 60.0), "memory")
    print(json.dumps(told, indent=1))
    _table(told, sys.stderr)


def _or_why_not(measured: Callable[[], dict[str, Any]], name: str) -> dict[str, Any]:
    """What was measured, or why it was not: the rest is told all the same."""
    try:
        return measured()
    except (OSError, RuntimeError, FlightdError, KeyError) as err:
        return {name: {"error": f"{type(err).__name__}: {err}"}}


def measured_crowd(options: Options) -> dict[str, Any]:
    """One flight; windows without pages and with them take turns."""
    ports, folder = free_ports(2, socket.SOCK_STREAM), options.folder / "crowd"
    windows: dict[str, list[tuple[float, float]]] = {"alone": [], "crowd": []}
    ages: dict[str, Any] = {}
    with ending() as started:
        flight = started(
            SimulatedFlight(
                folder, ports, options.flight_nice, "mission.dwell_s=12", "mission.autostart_countdown_s=1"
            )
        )
        station = started(Station(options.folder, ports, options.nice))
        crowd = started(CrowdProcess(options.folder, options.nice))
        _until_airborne(crowd, station)
        _pin(options, flight, station, crowd)
        for index in range(options.windows):
            _say(f"window {index + 1} of {options.windows}")
            crowd.say("close")
            time.sleep(SETTLE_S)
            windows["alone"].append(_window(options.seconds))
            crowd.open_all(station.url)
            time.sleep(SETTLE_S)
            crowd.say("clear")
            _pin(options, flight, station, crowd)
            windows["crowd"].append(_window(options.seconds))
            ages = crowd.say("tell")
        flew = flight.process.poll() is None
        log, summary = flight.over(0.1)
    steps = {kind: [_steps_ms(log, *window) for window in of_kind] for kind, of_kind in windows.items()}
    pooled = {
        kind: quantiles([step for window in of_kind for step in window]) for kind, of_kind in steps.items()
    }
    return {
        "flight": {
            "setpoint_ms": pooled,
            "p99_by_window_ms": {
                kind: [quantiles(w).get("p99") for w in of_kind] for kind, of_kind in steps.items()
            },
            "p99_difference_ms": round(pooled["crowd"]["p99"] - pooled["alone"]["p99"], 2),
            "on_the_wire_ms": summary.get("setpoint_interval_ms"),
            "flew_through": flew,
            "reason": summary.get("reason", ""),
        },
        "ages": ages,
    }


def measured_line_and_kill(options: Options) -> dict[str, Any]:
    """Another flight: a page at the end of each line, then kill -9 of the station."""
    ports, folder = free_ports(2, socket.SOCK_STREAM), options.folder / "line"
    lines: dict[str, Any] = {}
    with ending() as started:
        settings = ("ground.lost_action=home", "mission.dwell_s=12", "mission.autostart_countdown_s=1")
        flight = started(SimulatedFlight(folder, ports, options.flight_nice, *settings))
        station = started(Station(options.folder, ports, options.nice))
        crowd = started(CrowdProcess(options.folder, options.nice))
        watching = started(CrowdProcess(options.folder, options.nice))
        watching.open(station.url, plain=1)
        _until_airborne(crowd, station)
        for mbit in (0.0, *options.mbits):
            _say(f"line of {mbit:g} Mbit/s" if mbit else "loopback")
            lines[f"{mbit:g} Mbit/s" if mbit else "loopback"] = {
                kind: _seen_at_the_end(crowd, station, kind, mbit, options.seconds)
                for kind in ("plain", "chromium")
            }
        crowd.say("close")
        _say("kill -9 of the station")
        killed_ns = time.monotonic_ns()
        station.end()
        log, summary = flight.over(END_S)
    return {"line": lines, "killed": _after(log, killed_ns) | {"reason": summary.get("reason", "")}}


def _seen_at_the_end(
    crowd: CrowdProcess, station: Station, kind: str, mbit: float, seconds: float
) -> dict[str, Any]:
    """What one page of this kind sees at the end of a line."""
    crowd.open(station.url, mbit=mbit, **{kind: 1})
    time.sleep(SETTLE_S)
    crowd.say("clear")
    time.sleep(seconds)
    seen: dict[str, Any] = crowd.say("tell")[kind]
    return seen | {"pictures_per_s": round(seen["picture_age_ms"]["count"] / seconds, 2)}


def measured_memory(options: Options, seconds: float) -> dict[str, Any]:
    """The station's memory while pages come and go, and a drone flies mission after mission."""
    ports, rows = free_ports(2, socket.SOCK_STREAM), []
    with ending() as started:
        words = [sys.executable, "-m", "tools.station_drone", *map(str, ports)]
        started(Started(words, options.folder / "drone.log", options.nice))
        station = started(Station(options.folder, ports, options.nice))
        crowd = started(CrowdProcess(options.folder, options.nice))
        began_s = time.monotonic()
        crowd.open_all(station.url, churn_s=CHURN_S)
        with contextlib.suppress(KeyboardInterrupt):  # what was seen until then is told
            while (at_s := time.monotonic() - began_s) < seconds:
                rows.append((at_s, station.rss_mb))
                if len(rows) % 60 == 0:
                    _say(f"{at_s / 60:.0f} min: {rows[-1][1]:.1f} MB")
                time.sleep(SAMPLE_S)
        seen = _last_told(crowd)
    half = [row for row in rows if row[0] > rows[-1][0] / 2]
    slope = linear_regression(*zip(*half, strict=True)).slope if len(half) > 1 else 0.0
    memory = {
        "minutes": round(rows[-1][0] / 60, 1),
        "mb": {
            "first": rows[0][1],
            "middle": half[0][1],
            "last": rows[-1][1],
            "most": max(mb for _, mb in rows),
        },
        "slope_mb_per_h": round(slope * 3600, 2),
        "every_minute_mb": [round(mb, 1) for _, mb in rows[:: round(60 / SAMPLE_S)]],
        "pages": seen,
    }
    return {"memory": memory}


def _last_told(crowd: CrowdProcess) -> dict[str, Any]:
    """How the pages fared; what was measured before counts, though they do not say."""
    try:
        seen = crowd.say("tell")
    except (OSError, RuntimeError) as err:
        return {"error": str(err)}
    closed = seen["plain"]["closed"]
    return {
        "open": seen["browsers"],
        "closed": closed,
        "stalled": seen["stalled_again"],
        "reloads": seen["reloads"],
        "came_and_went_to_the_end": seen["churning"],
    }


def _after(log: FlightLog, killed_ns: int) -> dict[str, Any]:
    """What the flight did once nobody attended it any more."""
    events = [event for event in log.messages(Event) if event.stamp_ns > killed_ns]
    lost = [event for event in events if event.name == "ground_link"]
    warned = [
        event
        for event in events
        if event.level is not EventLevel.INFO and event not in lost and "ground link lost" not in event.text
    ]
    phases = dict.fromkeys(
        status.phase.value for status in log.messages(Status) if status.stamp_ns > killed_ns
    )
    return {
        "ground_link": [
            {"after_s": round((event.stamp_ns - killed_ns) * 1e-9, 2), "text": event.text} for event in lost
        ],
        "other_warnings": [f"{event.name}: {event.text}" for event in warned],
        "phases": list(phases),
    }


def _steps_ms(log: FlightLog, since_s: float, until_s: float) -> list[float]:
    stamps = [
        setpoint.stamp_ns * 1e-6
        for setpoint in log.messages(AttitudeSetpoint)
        if since_s * 1e9 < setpoint.stamp_ns < until_s * 1e9
    ]
    steps = [after - before for before, after in pairwise(stamps)]
    return [step for step in steps if step < MOST_STEP_MS]


def _until_airborne(crowd: CrowdProcess, station: Station) -> None:
    crowd.open(station.url, plain=1)
    until(lambda: crowd.say("tell")["phase"] in {"follow", "hover"}, AIRBORNE_S)


def _pin(options: Options, flight: Started, *others: Started) -> None:
    if options.pin:
        daemon = daemon_of(flight.process.pid)
        flight.pin(0, daemon)
        flight.pin(1, [pid for pid in flight.pids if pid not in daemon])
        for other in others:
            other.pin(1)


def _window(seconds: float) -> tuple[float, float]:
    since_s = time.monotonic()
    time.sleep(seconds)
    return since_s, time.monotonic()


def _say(text: str) -> None:
    print(f"bench_station: {text}", file=sys.stderr, flush=True)


def _table(told: dict[str, Any], sink: TextIO) -> None:
    for name, value in _leaves(told):
        print(f"{name:42} {value}", file=sink)


def _leaves(told: dict[str, Any], path: str = "") -> Iterator[tuple[str, str]]:
    """A row for each value, quantiles in one."""
    for key, value in told.items():
        if not isinstance(value, dict):
            yield path + key, str(value)[:80]
        elif "count" in value:
            yield path + key, "  ".join(f"{name} {figure}" for name, figure in value.items())
        else:
            yield from _leaves(value, f"{path}{key} ")


if __name__ == "__main__":
    main()
