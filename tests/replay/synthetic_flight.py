"""A made-up but plausible flight over the demo site, written as a log: what the report is tested with."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

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


class _Flown:
    """The drone along the legs, with sway and noise of its own; records what a daemon would."""

    def __init__(self, recorder: McapRecorder, site: Site, rng: np.random.Generator) -> None:
        self._recorder = recorder
        self._site = site
        self._rng = rng
        self._frames = 0
        self._done = 0
        self._sway = np.zeros(2)
        self.t_s = 0.0
        self.truths: list[Kinematics] = []

    def fly(self, leg: Leg) -> None:
        stamp_ns = self._stamp_ns()
        self._event(stamp_ns, EventLevel.INFO, leg.phase, f"{leg.phase} at {leg.node}")
        if leg.phase == Phase.TURN:
            self._event(stamp_ns, EventLevel.WARNING, "wind", "gusts up to 1.9 m/s, slowing down")
        for step in range(round(leg.seconds / TICK_S)):
            self._tick(leg, step)
            self.t_s += TICK_S
        self._done += leg.phase == Phase.HOVER

    def _tick(self, leg: Leg, step: int) -> None:
        flying = leg.phase not in {Phase.PREFLIGHT, Phase.ARMING, Phase.DONE}
        at, velocity = self._motion(leg, step, flying)
        battery = 1.0 - 0.0016 * self.t_s
        self.truths.append(at)
        self._vehicle(at, flying, battery)
        if at.height_m > 0.4:
            self._pose(at, velocity)
        capture, detection = 60 + float(self._rng.gamma(4, 1.2)), float(self._rng.gamma(6, 0.5))
        stages = {"capture": capture, "transport": 1.1, "detection": detection, "track": 0.4}
        if step % 2 == 0 and at.height_m > 0.2:
            self._frame(at)
        self._status(leg, at, battery, stages | {"total": math.fsum(stages.values())})

    def _motion(self, leg: Leg, step: int, flying: bool) -> tuple[Kinematics, tuple[float, float]]:
        part = (1 - math.cos(math.pi * step * TICK_S / leg.seconds)) / 2
        turn = math.pi / leg.seconds
        pace = turn / 2 * math.sin(turn * step * TICK_S)
        vx, vy, _ = ((b - a) * pace for a, b in zip(leg.start, leg.end, strict=True))
        self._sway = 0.995 * self._sway + self._rng.normal(0, 0.002, 2) * flying
        x, y, height = (a + (b - a) * part for a, b in zip(leg.start, leg.end, strict=True))
        x, y = x + self._sway[0], y + self._sway[1]
        roll = 0.03 * math.sin(self.t_s * 1.3) * flying + self._rng.normal(0, 0.004) * flying
        pitch = 0.04 * math.sin(self.t_s * 0.9) * flying + self._rng.normal(0, 0.004) * flying
        yaw = 0.02 * math.sin(self.t_s / 7)
        at = Kinematics(self._stamp_ns(), x, y, height, 0.0, 0.0, 0.0, roll, pitch, yaw, 0.0, 0.0, 0.0)
        return at, (vx, vy)

    def _vehicle(self, at: Kinematics, flying: bool, battery: float) -> None:
        state = VehicleState(
            Attitude(at.stamp_ns, at.roll_rad, at.pitch_rad, at.yaw_rad),
            at.height_m + self._rng.normal(0, 0.008),
            at.stamp_ns,
            0.0,
            "GUIDED_NOGPS",
            True,
            flying,
            LandedState.IN_AIR if at.height_m > 0.05 else LandedState.ON_GROUND,
            battery,
            16.4 - 2 * (1 - battery),
            at.stamp_ns,
        )
        self._recorder.record(Topic.VEHICLE, at.stamp_ns, state)
        setpoint = AttitudeSetpoint(at.stamp_ns, at.roll_rad * 0.9, at.pitch_rad * 0.9, 0.0, 0.0)
        self._recorder.record(Topic.SETPOINT, at.stamp_ns, setpoint)

    def _pose(self, at: Kinematics, velocity: tuple[float, float]) -> None:
        nearest = self._site.nearest(at.x_m, at.y_m)
        x, y = at.x_m + self._rng.normal(0, 0.006), at.y_m + self._rng.normal(0, 0.006)
        covariance = (0.0001, 0.0, 0.0, 0.0, 0.0001, 0.0, 0.0, 0.0, 0.0001)
        along, across = x - nearest.x_m, y - nearest.y_m
        pose = GridPose(
            at.stamp_ns,
            nearest.id,
            along,
            across,
            at.yaw_rad,
            x,
            y,
            *velocity,
            at.height_m,
            covariance,
            0.999,
        )
        self._recorder.record(Topic.POSE, at.stamp_ns, pose)

    def _frame(self, at: Kinematics) -> None:
        self._frames += 1
        lines = seen_lines(self._frames, at.stamp_ns - 60_000_000, at.roll_rad, self._rng)
        self._recorder.record(Topic.LINES, at.stamp_ns, lines)
        if self._frames % 60 == 0:
            self._recorder.image(Topic.FRAME, lines.stamp_ns, self._frames, picture(lines, self._rng))

    def _status(self, leg: Leg, at: Kinematics, battery: float, stages: dict[str, float]) -> None:
        status = Status(
            at.stamp_ns,
            leg.phase,
            "",
            leg.node,
            leg.goal,
            self._done,
            12,
            battery,
            at.height_m,
            self._frames,
            self._frames // 400,
            25.0,
            stages,
        )
        self._recorder.record(Topic.STATUS, at.stamp_ns, status)

    def _event(self, stamp_ns: int, level: EventLevel, name: str, text: str) -> None:
        self._recorder.record(Topic.EVENT, stamp_ns, Event(stamp_ns, level, name, text))

    def _stamp_ns(self) -> int:
        return START_NS + round(self.t_s * NS)


def write_flight(
    folder: Path, *, truth: bool = True, summary: bool = True, seed: int = 1, scans: bool = False
) -> Path:
    """Write `flight.mcap` (and `truth.mcap`, `summary.json`) to `folder`; returns the log's path."""
    made = _made(seed, scans)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "flight.mcap"
    path.write_bytes(made.log)
    if truth:
        (folder / "truth.mcap").write_bytes(made.truth)
    if summary:
        (folder / "summary.json").write_text(json.dumps(SUMMARY | {"flight_time_s": made.seconds}))
    return path


@dataclass(frozen=True)
class _Made:
    log: bytes
    truth: bytes
    seconds: float


@cache
def _made(seed: int, scans: bool) -> _Made:
    """Once in a process: many tests read the same flight."""
    site = parse_site(SITE_TOML, "demo")
    with TemporaryDirectory() as folder:
        log, truth = Path(folder) / "flight.mcap", Path(folder) / "truth.mcap"
        metadata = {"vehicle": "ardupilot", "site": site.name}
        with McapRecorder(log, when_full=wait_for_disk, metadata=metadata) as recorder:
            recorder.record(Topic.MAP, 0, Document(SITE_TOML))  # stamps before the flight
            recorder.record(Topic.CONFIG, START_NS, Document('[vehicle]\nkind = "ardupilot"\n'))
            flown = _Flown(recorder, site, np.random.default_rng(seed))
            for leg in legs(site, scans):
                flown.fly(leg)
        with McapRecorder(truth, when_full=wait_for_disk) as recorder:
            for kinematics in flown.truths:
                recorder.record(Topic.TRUTH, kinematics.stamp_ns, asdict(kinematics))
        return _Made(log.read_bytes(), truth.read_bytes(), flown.t_s)


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
