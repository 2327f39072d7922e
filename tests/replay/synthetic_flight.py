"""A made-up but plausible flight over the demo site, written as a log: what the report is tested with."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import cv2
import numpy as np

from flightd.adapters.recorder.recorder import McapRecorder, wait_for_disk
from flightd.core.topics import Document, Topic
from flightd.core.types import (
    Attitude,
    AttitudeSetpoint,
    Event,
    EventLevel,
    GridPose,
    LandedState,
    Line,
    LineSet,
    Phase,
    Status,
    VehicleState,
)
from flightd.sim.plant.kinematics import Kinematics
from flightd.site.site import Site
from flightd.site.site_file import parse_site

SITE_TOML = (Path(__file__).parents[2] / "configs" / "site-demo.toml").read_text()
NS = 1_000_000_000
START_NS = 5 * NS
TICK_S = 0.02
CRUISE_MPS = 0.7
DWELL_S = 2.5
HEIGHT_M = 1.5


@dataclass(frozen=True)
class Leg:
    """Part of the flight with one phase: from one place to another in `seconds`."""

    phase: Phase
    seconds: float
    start: tuple[float, float, float]
    end: tuple[float, float, float]
    node: str
    goal: str


def legs(site: Site, scans: bool = False) -> Iterator[Leg]:
    """Up, node by node over the serpentine, home, down."""
    way = site.expand(site.serpentine_route())
    home = site.nodes[way[0]]
    ground, up = (home.x_m, home.y_m, 0.0), (home.x_m, home.y_m, HEIGHT_M)
    yield Leg(Phase.PREFLIGHT, 1.5, ground, ground, home.id, home.id)
    yield Leg(Phase.ARMING, 1.0, ground, ground, home.id, home.id)
    yield Leg(Phase.TAKE_OFF, 4.0, ground, up, home.id, home.id)
    yield Leg(Phase.ACQUIRE, 1.2, up, up, home.id, way[1])
    here, done = up, {way[0]}
    for a, b in itertools.pairwise(way):
        node = site.nodes[b]
        there = (node.x_m, node.y_m, HEIGHT_M)
        across = site.nodes[a].aisle != node.aisle
        seconds = math.dist(here, there) / CRUISE_MPS + 0.8
        yield Leg(Phase.TURN if across else Phase.FOLLOW, seconds, here, there, a, b)
        if b not in done or b == way[-1]:
            yield Leg(Phase.HOVER, 0.1 if scans else DWELL_S, there, there, b, b)
            if scans:
                aside = (there[0] + 0.3, there[1], there[2])
                yield Leg(Phase.CLIMB, 0.4, there, aside, b, b)
                yield Leg(Phase.SCAN, DWELL_S - 0.5, aside, aside, b, b)
        done.add(b)
        here = there
    yield Leg(Phase.LAND, 5.0, here, ground, home.id, home.id)
    yield Leg(Phase.DONE, 1.0, ground, ground, home.id, home.id)


def seen_lines(seq: int, stamp_ns: int, roll_rad: float, rng: np.random.Generator) -> LineSet:
    """An aisle line, and every third time a cross line."""
    theta = 0.04 * math.sin(seq / 17)
    rho = 40 * math.sin(seq / 23) + 200 * roll_rad
    aisle = (rho, theta) if theta >= 0 else (-rho, theta + math.pi)
    lines = [Line(*aisle, 30.0, -178.0, 178.0, 0.95, 0.1, 0.001)]
    if seq % 3 == 0:
        lines.append(Line(30.0 - seq % 60, math.pi / 2 + theta, 30.0, -300.0, 300.0, 0.9, 0.1, 0.001))
    timings = {"mask": float(rng.gamma(9, 0.05)), "hypothesise": float(rng.gamma(9, 0.08)), "refine": 0.6}
    return LineSet(seq, stamp_ns, 640, 360, tuple(lines), (), "combined", timings)


def picture(lines: LineSet, rng: np.random.Generator) -> bytes:
    """The concrete floor with these lines painted on it, as JPEG."""
    floor = np.full((360, 640, 3), (118, 122, 124), np.uint8)
    for line in lines.lines:
        ends = [line.point_at(-500.0), line.point_at(500.0)]
        (x0, y0), (x1, y1) = [(round(x + 319.5), round(y + 179.5)) for x, y in ends]
        cv2.line(floor, (x0, y0), (x1, y1), (40, 190, 225), 30, cv2.LINE_AA)
    noisy = np.clip(floor + rng.normal(0, 9, floor.shape), 0, 255).astype(np.uint8)
    ok, jpeg = cv2.imencode(".jpg", noisy, [cv2.IMWRITE_JPEG_QUALITY, 80])
    assert ok
    return jpeg.tobytes()


def write_flight(
    folder: Path, *, truth: bool = True, summary: bool = True, seed: int = 1, scans: bool = False
) -> Path:
    """Write `flight.mcap` (and `truth.mcap`, `summary.json`) to `folder`; returns the log's path."""
    rng = np.random.default_rng(seed)
    site = parse_site(SITE_TOML, "demo")
    path = folder / "flight.mcap"
    truths: list[Kinematics] = []
    with McapRecorder(
        path, when_full=wait_for_disk, metadata={"vehicle": "ardupilot", "site": site.name}
    ) as recorder:
        recorder.record(Topic.MAP, 0, Document(SITE_TOML))  # stamps before the flight
        recorder.record(Topic.CONFIG, START_NS, Document('[vehicle]\nkind = "ardupilot"\n'))
        t_s, frames, done, sway = 0.0, 0, 0, np.zeros(2)
        plan = list(legs(site, scans))
        for leg in plan:
            stamp_ns = START_NS + round(t_s * NS)
            recorder.record(
                Topic.EVENT,
                stamp_ns,
                Event(stamp_ns, EventLevel.INFO, leg.phase, f"{leg.phase} at {leg.node}"),
            )
            if leg.phase == Phase.TURN:
                gust = Event(stamp_ns, EventLevel.WARNING, "wind", "gusts up to 1.9 m/s, slowing down")
                recorder.record(Topic.EVENT, stamp_ns, gust)
            for step in range(round(leg.seconds / TICK_S)):
                part = (1 - math.cos(math.pi * step * TICK_S / leg.seconds)) / 2
                flying = leg.phase not in {Phase.PREFLIGHT, Phase.ARMING, Phase.DONE}
                turn = math.pi / leg.seconds
                pace = turn / 2 * math.sin(turn * step * TICK_S)
                vx, vy, _ = ((b - a) * pace for a, b in zip(leg.start, leg.end, strict=True))
                sway = 0.995 * sway + rng.normal(0, 0.002, 2) * flying
                x, y, height = (a + (b - a) * part for a, b in zip(leg.start, leg.end, strict=True))
                x, y = x + sway[0], y + sway[1]
                stamp_ns = START_NS + round(t_s * NS)
                roll = 0.03 * math.sin(t_s * 1.3) * flying + rng.normal(0, 0.004) * flying
                pitch = 0.04 * math.sin(t_s * 0.9) * flying + rng.normal(0, 0.004) * flying
                yaw = 0.02 * math.sin(t_s / 7)
                battery = 1.0 - 0.0016 * t_s
                truths.append(
                    Kinematics(stamp_ns, x, y, height, 0.0, 0.0, 0.0, roll, pitch, yaw, 0.0, 0.0, 0.0)
                )
                attitude = Attitude(stamp_ns, roll, pitch, yaw)
                landed = LandedState.IN_AIR if height > 0.05 else LandedState.ON_GROUND
                recorder.record(
                    Topic.VEHICLE,
                    stamp_ns,
                    VehicleState(
                        attitude,
                        height + rng.normal(0, 0.008),
                        stamp_ns,
                        0.0,
                        "GUIDED_NOGPS",
                        True,
                        flying,
                        landed,
                        battery,
                        16.4 - 2 * (1 - battery),
                        stamp_ns,
                    ),
                )
                recorder.record(
                    Topic.SETPOINT, stamp_ns, AttitudeSetpoint(stamp_ns, roll * 0.9, pitch * 0.9, 0.0, 0.0)
                )
                if height > 0.4:
                    nearest = site.nearest(x, y)
                    ex, ey = x + rng.normal(0, 0.006), y + rng.normal(0, 0.006)
                    recorder.record(
                        Topic.POSE,
                        stamp_ns,
                        GridPose(
                            stamp_ns,
                            nearest.id,
                            ex - nearest.x_m,
                            ey - nearest.y_m,
                            yaw,
                            ex,
                            ey,
                            vx,
                            vy,
                            height,
                            (0.0001, 0.0, 0.0, 0.0, 0.0001, 0.0, 0.0, 0.0, 0.0001),
                            0.999,
                        ),
                    )
                capture, detection = 60 + float(rng.gamma(4, 1.2)), float(rng.gamma(6, 0.5))
                stages = {"capture": capture, "transport": 1.1, "detection": detection, "track": 0.4}
                if step % 2 == 0 and height > 0.2:
                    frames += 1
                    lines = seen_lines(frames, stamp_ns - 60_000_000, roll, rng)
                    recorder.record(Topic.LINES, stamp_ns, lines)
                    if frames % 60 == 0:
                        recorder.image(Topic.FRAME, lines.stamp_ns, frames, picture(lines, rng))
                status = Status(
                    stamp_ns,
                    leg.phase,
                    "",
                    leg.node,
                    leg.goal,
                    done,
                    12,
                    battery,
                    height,
                    frames,
                    frames // 400,
                    25.0,
                    stages | {"total": math.fsum(stages.values())},
                )
                recorder.record(Topic.STATUS, stamp_ns, status)
                t_s += TICK_S
            done += leg.phase == Phase.HOVER
    if truth:
        with McapRecorder(folder / "truth.mcap", when_full=wait_for_disk) as recorder:
            for kinematics in truths:
                recorder.record(Topic.TRUTH, kinematics.stamp_ns, asdict(kinematics))
    if summary:
        (folder / "summary.json").write_text(json.dumps(SUMMARY | {"flight_time_s": t_s}))
    return path


SUMMARY: dict[str, object] = {
    "mission": "completed",
    "reason": "",
    "nodes_planned": 12,
    "nodes_visited": 12,
    "nodes_miscounted": 0,
    "cross_track_rms_m": 0.0214,
    "hover_error_p95_m": 0.0543,
    "codes_expected": 36,
    "codes_read": 36,
    "codes_wrong": 0,
    "landed_error_m": 0.061,
    "wall_time_s": 14.2,
    "frames": 1580,
    "frames_dropped": 3,
    "latency_ms": {"p50": 66.1, "p99": 73.8},
    "seed": 1,
    "vehicle": "ardupilot",
}
