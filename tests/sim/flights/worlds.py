"""How well the simulated worlds are flown: the table of many seeds.

python -m tests.sim.flights.worlds --world rough --seeds 7101-7140 flies each seed as `flightd sim` does (with
`--ideal`: by computed sight, without pictures and sockets, at a tenth of the work, and judged by nobody) and
prints a line for each and one for all; exit 1 where a flight was not completed, not safe, or could not be
judged.  Each flies its site's whole route: that is what figures of a world are flown by.  `--nodes A2,A3` is
a short look, `--nodes 3` flies to the first three; `--warehouse random` is a random site by each seed.
`--vehicle px4` and `--set KEY=VALUE` (`--set vehicle.pose_output=none`) are those of `flightd sim`.
`--off-ms=-50,60` configures a camera's delay of 60 ms wrong by so much; `--json FILE` keeps what was found.
The last line tells which share of the flights erred by less than 1 and 2 of the sigmas that they told.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import sys
import tempfile
from collections import deque
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from flightd.app.simulation.judgement import judge_flight
from flightd.app.simulation.launch import fly
from flightd.app.simulation.prepare import SimOptions, prepare
from flightd.app.simulation.sensor_summary import sensor_summary
from flightd.config.paths import shipped
from flightd.config.schema import load_config
from flightd.core.errors import FlightdError, RunError
from flightd.core.snapshot import Snapshot
from flightd.core.topics import Topic
from flightd.core.tracks import SensorEstimate
from flightd.core.types import Attitude, Phase
from flightd.replay.log import read_log
from flightd.sim.judge.verdict import SAFETY_KINDS
from flightd.sim.leap import NEVER, Leap
from flightd.sim.plant.plant_kind import PlantKind
from flightd.sim.plant.wind import WindParams
from flightd.sim.random_sites import random_site
from flightd.sim.scenario.scenario import Scenario
from flightd.sim.unknowns import WorldKind, unknowns_of
from flightd.site.site import Site
from flightd.site.site_file import load_site
from tests.sim.ideal.ideal_flight import Flown, IdealFlight, rms_off_line

_LONGEST_S = 900.0
_TRUE_DELAY_S = 0.06
_KNOWN_AFTER_S = 20.0
_DELAY_MS, _ANGLE_DEG = 5.0, 0.3
"""As well as a delay and an angle have to be known by then."""
_TILTS = "tilt_roll_deg", "tilt_pitch_deg"
_WITH_SIGMA = (
    "delay_to_attitude_s",
    "mount_roll_deg",
    "mount_pitch_deg",
    "mount_yaw_deg",
    *_TILTS,
    "focal_percent",
    "height_percent",
)
"""What is held against the sigma that the flight tells of it: honest are 68 % within 1, 95 % within 2."""


@dataclass(frozen=True, slots=True)
class PlannedFlight:
    """One flight; `off_ms` None leaves the camera's delay to the world, empty `nodes` are all."""

    world: WorldKind
    seed: int
    nodes: str
    warehouse: str | None = None
    plant: PlantKind = PlantKind.OWN
    off_ms: int | None = None
    ideal: bool = False
    """By computed sight."""
    vehicle: str | None = None
    settings: tuple[str, ...] = ()

    def site(self) -> Site:
        if self.warehouse is None:
            return load_site(shipped("site-demo.toml"))
        return random_site(int(self.warehouse.removeprefix("random:")))

    def visits(self) -> tuple[str, ...]:
        """The nodes by name; none: all of the site's."""
        if self.nodes.isdecimal():
            return tuple(self.site().serpentine_route()[: int(self.nodes)])
        return tuple(self.nodes.split(",")) if self.nodes else ()


@dataclass(frozen=True, slots=True)
class Result:
    """What the table tells of one flight; NaN where it got to nothing that can be measured, None where no
    judge said it.  `errors` are the sensors' estimates less the truth after 20 s in the air: delay (ms), and
    the greater one of roll and pitch of mount and tilt bias (deg).  `since_leap_s` is how long before then
    the camera's delay (`camera`) and the autopilot's clock (`clock`) leapt, below 0 where they did later; the
    true delay is the one of then."""

    planned: PlannedFlight
    completed: bool
    rms_m: float
    hover_p95_m: float
    landed_m: float
    miscounted: int | None
    faults: str
    unsafe: bool | None
    reason: str
    errors: dict[str, float] = field(default_factory=dict)
    since_leap_s: dict[str, float] = field(default_factory=dict)
    sigmas: dict[str, float] = field(default_factory=dict)
    """How many of its own sigmas each estimate was off by then, signed."""

    @property
    def is_good(self) -> bool:
        """Completed, and safe as far as one asks: by computed sight nobody does."""
        return self.completed and (self.planned.ideal or self.unsafe is False)


Rows: TypeAlias = Sequence[dict[str, Any]]
"""What a truth log holds, of the fields of `Kinematics` each."""


class _SensorProbe:
    """Sees what the flight knows of its sensors so long after its take-off began, or at its end, and what
    attitude it was told in the second before."""

    def __init__(self) -> None:
        self.seen: SensorEstimate | None = None
        self.seen_ns = 0
        self.told = deque[Attitude](maxlen=50)
        self._up_ns: int | None = None

    def __call__(self, status: Snapshot) -> None:
        if self._up_ns is None and status.phase is Phase.TAKE_OFF:
            self._up_ns = status.stamp_ns
        tracks = status.output.tracks
        if self._up_ns is None or tracks is None or not tracks.sensors.is_known:
            return
        if self.seen is None or (status.stamp_ns - self._up_ns) * 1e-9 < _KNOWN_AFTER_S:
            self.seen, self.seen_ns = tracks.sensors, status.stamp_ns
            if status.vehicle is not None:
                self.told.append(status.vehicle.attitude)

    def since_s(self, leap: Leap, truth: Rows) -> float:
        """How long before that a leap had come."""
        return leap.since_s(((row["stamp_ns"], row["height_m"]) for row in truth), self.seen_ns)

    def tilt_error_deg(self, rows: Rows) -> tuple[float, float]:
        """By how much roll and pitch were told too large, on average."""
        stamps = [row["stamp_ns"] for row in rows]
        at = [told.stamp_ns for told in self.told]
        roll, pitch = (np.interp(at, stamps, [row[key] for row in rows]) for key in ("roll_rad", "pitch_rad"))
        off_roll = statistics.fmean(told.roll_rad for told in self.told) - float(np.mean(roll))
        off_pitch = statistics.fmean(told.pitch_rad for told in self.told) - float(np.mean(pitch))
        return math.degrees(off_roll), math.degrees(off_pitch)


def flown(planned: PlannedFlight) -> Result:
    """One flight; one that could not be flown, or not be judged, is told as aborted."""
    try:
        return _flown_ideally(planned) if planned.ideal else _flown_by_pictures(planned)
    except FlightdError as err:
        nothing = (math.nan,) * 3
        return Result(planned, False, *nothing, miscounted=None, faults="", unsafe=None, reason=str(err))


def _flown_by_pictures(planned: PlannedFlight) -> Result:
    """One flight of the whole pipeline, in lockstep."""
    settings, scenario = [], Scenario()
    if planned.nodes:
        settings.append(f"mission.nodes={','.join(planned.visits())}")
    if planned.off_ms is not None:
        drawn_s = unknowns_of(planned.world, planned.seed).camera_delay_s
        camera = {"capture_delay_s": _TRUE_DELAY_S - drawn_s}
        scenario = Scenario.model_validate({"camera": camera})
        settings.append(f"camera.latency_s={_TRUE_DELAY_S + planned.off_ms / 1e3:.3f}")
    options = SimOptions(
        seed=planned.seed,
        world=planned.world,
        warehouse=planned.warehouse,
        vehicle=planned.vehicle,
        plant=planned.plant,
        settings=[*settings, *planned.settings],
    )
    probe, ended = _SensorProbe(), ""
    with tempfile.TemporaryDirectory() as folder:
        simulation = replace(prepare(options, scenario, Path(folder), lambda _: None), observer=probe)
        try:
            fly(simulation)
        except RunError as err:
            ended = str(err)
        judgement = judge_flight(simulation)
        errors, sigmas, since_leap_s = {}, {}, dict[str, float]()
        if probe.seen is not None:
            truth = _truth(simulation.truth_log)
            leaps = {"camera": simulation.unknowns.camera_leap, "clock": simulation.unknowns.clock_leap}
            since_leap_s = {name: probe.since_s(leap, truth) for name, leap in leaps.items() if leap != NEVER}
            leapt = since_leap_s.get("camera", -math.inf) > 0.0
            tilt_deg = probe.tilt_error_deg(truth)
            known = sensor_summary(simulation, probe.seen, leapt=leapt)
            errors, sigmas = _errors(known, tilt_deg), sigmas_off(known, tilt_deg)
    score = judgement.score
    return Result(
        planned=planned,
        completed=score.mission == "completed",
        rms_m=_number(score.cross_track_rms_m),
        hover_p95_m=_number(score.hover_error_p95_m),
        landed_m=_number(score.landed_error_m),
        miscounted=score.nodes_miscounted,
        faults=" ".join(fault.kind for fault in judgement.faults),
        unsafe=any(fault.kind in SAFETY_KINDS for fault in judgement.faults),
        reason=ended or score.reason,
        errors=errors,
        since_leap_s=since_leap_s,
        sigmas=sigmas,
    )


def _truth(log: Path) -> Rows:
    return [one.message for one in read_log(log, {Topic.TRUTH}).entries if isinstance(one.message, dict)]


def _errors(sensors: dict[str, dict[str, float | None]], tilt_deg: tuple[float, float]) -> dict[str, float]:
    """Estimated less true, of what the flight is held to; the tilt's error wanders, and is that of then."""

    def off(key: str, scale: float = 1.0) -> float:
        told, true = sensors["estimated"][key], sensors["drawn"][key]
        return math.nan if told is None or true is None else scale * (told - true)

    mount = max(abs(off("mount_roll_deg")), abs(off("mount_pitch_deg")))
    told = sensors["estimated"]["tilt_roll_deg"], sensors["estimated"]["tilt_pitch_deg"]
    tilt = max(abs((value or 0.0) - true) for value, true in zip(told, tilt_deg, strict=True))
    return {"delay_ms": off("delay_to_attitude_s", 1e3), "mount_deg": mount, "tilt_deg": tilt}


def sigmas_off(
    sensors: dict[str, dict[str, float | None]], tilt_deg: tuple[float, float]
) -> dict[str, float]:
    """Estimated less true in the flight's own sigmas, of all that it tells with a sigma; true tilts are those
    of then, and the true delay is the one against the attitude."""
    estimated, sigma = sensors["estimated"], sensors["estimated_sigma"]
    true = sensors["drawn"] | dict(zip(_TILTS, tilt_deg, strict=True))
    off = {}
    for key in _WITH_SIGMA:
        told, right, one_sigma = estimated[key], true[key], sigma[key]
        if told is not None and right is not None and one_sigma:
            off[key] = (told - right) / one_sigma
    return off


def _number(value: float | None) -> float:
    return math.nan if value is None else value


def _flown_ideally(planned: PlannedFlight) -> Result:
    """One flight by computed sight, with that world's sensors and link."""
    config, site = load_config(shipped("sim.toml")), planned.site()
    unknowns = unknowns_of(planned.world, planned.seed)
    wind, painted = unknowns.wind(WindParams(), told=False), unknowns.floor(site, planned.seed)
    flight = IdealFlight(
        site, config, visits=planned.visits(), seed=planned.seed, wind=wind, unknowns=unknowns, world=painted
    )
    flown = flight.fly(_LONGEST_S)
    end, pad = flown.truth[-1][1], site.nodes[site.home.node]
    completed = flown.phase is Phase.DONE
    return Result(
        planned=planned,
        completed=completed,
        rms_m=rms_off_line(flown, painted),
        hover_p95_m=hover_p95_m(flown, painted),
        landed_m=math.hypot(end.x_m - pad.x_m, end.y_m - pad.y_m) if completed else math.nan,
        miscounted=None,
        faults="",
        unsafe=None,
        reason=flown.reason,
    )


def hover_p95_m(flown: Flown, site: Site) -> float:
    """How far from its node the drone hovered, all but the worst twentieth; NaN where it never did."""
    off_m = [
        math.hypot(k.x_m - site.nodes[output.goal].x_m, k.y_m - site.nodes[output.goal].y_m)
        for output, (phase, k) in zip(flown.outputs, flown.truth, strict=True)
        if phase is Phase.HOVER and output.goal in site.nodes
    ]
    return statistics.quantiles(off_m, n=20)[-1] if len(off_m) > 1 else math.nan


def summary_line(results: Sequence[Result]) -> str:
    """All flights in one line; root mean square, mean and worst of what could be measured.  What no judge
    looked at is not told; of judged flights those that could not be judged count as not safe."""
    done = sum(result.completed for result in results)
    rms = [result.rms_m for result in results if not math.isnan(result.rms_m)]
    p95 = [result.hover_p95_m for result in results if not math.isnan(result.hover_p95_m)]
    landed = [result.landed_m for result in results if not math.isnan(result.landed_m)]
    square = math.sqrt(statistics.fmean(one * one for one in rms)) if rms else math.nan
    return (
        f"{done} of {len(results)} completed, {_safe(results)}rms {square:.3f} m "
        f"(worst {max(rms, default=math.nan):.3f}), "
        f"hover p95 {statistics.fmean(p95) if p95 else math.nan:.3f} m "
        f"(worst {max(p95, default=math.nan):.3f}), landed within {max(landed, default=math.nan):.3f} m"
        f"{_miscounted(results)}{_known_line(results)}"
        f"{_honesty_line(results)}"
    )


def _safe(results: Sequence[Result]) -> str:
    asked = [result for result in results if not result.planned.ideal]
    if not asked:
        return ""
    safe = f"{sum(result.unsafe is False for result in asked)} of {len(asked)} safe, "
    unjudged = sum(result.unsafe is None for result in asked)
    return safe + (f"{unjudged} not judged, " if unjudged else "")


def _miscounted(results: Sequence[Result]) -> str:
    told = [result.miscounted for result in results if result.miscounted is not None]
    return f", {sum(told)} miscounted" if told else ""


def _known_line(results: Sequence[Result]) -> str:
    """How many flights knew their sensors after 20 s; empty where no flight tells."""
    told = [result.errors for result in results if result.errors]
    if not told:
        return ""
    bounds = {"delay_ms": _DELAY_MS, "mount_deg": _ANGLE_DEG, "tilt_deg": _ANGLE_DEG}
    known = (f"{key} {sum(abs(e[key]) <= most for e in told)}" for key, most in bounds.items())
    leapt = sum(result.since_leap_s.get("camera", -math.inf) > 0.0 for result in results)
    late = f" (the delay of {leapt} leapt before)" if leapt else ""
    return f"; of {len(told)} known after {_KNOWN_AFTER_S:.0f} s: " + ", ".join(known) + late


def _honesty_line(results: Sequence[Result]) -> str:
    """Shares of flights whose estimates were then within 1 and 2 of their own sigmas."""
    shares = []
    for key in _WITH_SIGMA:
        off = [abs(result.sigmas[key]) for result in results if key in result.sigmas]
        if off:
            within = "/".join(f"{sum(one <= most for one in off) / len(off):.0%}" for most in (1.0, 2.0))
            shares.append(f"{key} {within}")
    return f"; within 1/2 of the flight's own sigma: {', '.join(shares)}" if shares else ""


def _line(result: Result) -> str:
    planned, e = result.planned, result.errors
    judged = "" if planned.ideal or result.unsafe is not None else " (not judged)"
    outcome = f"{'completed' if result.completed else 'ABORTED'}{judged}: {result.reason} {result.faults}"
    off = "" if planned.off_ms is None else f"{planned.off_ms:+d}"
    known = f"{e['delay_ms']:+6.1f} {e['mount_deg']:5.2f} {e['tilt_deg']:5.2f}" if e else " " * 18
    leapt = "+".join(name for name, since_s in result.since_leap_s.items() if since_s > 0.0)
    return (
        f"{planned.seed:>6} {off:>4} {result.rms_m:6.3f} {result.hover_p95_m:6.3f} {result.landed_m:6.3f}"
        f" {known}  {leapt:12}  {outcome}"
    )


def _document(result: Result) -> dict[str, Any]:
    """JSON has neither NaN nor infinity."""

    def known(value: object) -> object:
        if isinstance(value, dict):
            return {key: known(one) for key, one in value.items()}
        return None if isinstance(value, float) and not math.isfinite(value) else value

    return {key: known(value) for key, value in asdict(result).items()}


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--world", type=WorldKind, default=WorldKind.ROUGH)
    parser.add_argument("--seeds", default="7101-7110", help="FIRST-LAST")
    parser.add_argument("--nodes", default="", help="route, or so many of the site's; default: all nodes")
    parser.add_argument(
        "--warehouse", help="random (by each flight's seed) or random:SEED; else the demo site"
    )
    parser.add_argument("--vehicle", help="ardupilot (default), px4, ardrone or mavsdk")
    parser.add_argument(
        "--set", dest="settings", action="append", default=[], help="KEY=VALUE over the configuration"
    )
    parser.add_argument("--plant", type=PlantKind, default=PlantKind.OWN)
    parser.add_argument("--off-ms", help="configured delays less the true one, with commas between them")
    parser.add_argument("--ideal", action="store_true", help="by computed sight")
    parser.add_argument("--jobs", type=int, default=1, help="so many flights at once")
    parser.add_argument("--json", type=Path)
    given = parser.parse_args(arguments)
    if given.ideal and (given.off_ms or given.plant is not PlantKind.OWN):
        parser.error("--ideal flies our own airframe, its delay as the world draws it")
    if given.ideal and (given.vehicle or given.settings):
        parser.error("--ideal flies no adapter, by the simulator's own configuration")
    first, _, last = given.seeds.partition("-")
    offs = [int(off) for off in given.off_ms.split(",")] if given.off_ms else [None]
    each = [
        PlannedFlight(
            given.world,
            seed,
            given.nodes,
            f"random:{seed}" if given.warehouse == "random" else given.warehouse,
            given.plant,
            off_ms,
            given.ideal,
            given.vehicle,
            tuple(given.settings),
        )
        for off_ms in offs
        for seed in range(int(first), int(last or first) + 1)
    ]
    results = []
    print(f"{'seed':>6} {'off':>4} {'rms':>6} {'p95':>6} {'landed':>6}  delay mount  tilt  {'leapt':12}  end")
    with ProcessPoolExecutor(given.jobs, max_tasks_per_child=1) as pool:
        for result in pool.map(flown, each):
            results.append(result)
            print(_line(result), flush=True)
    print(summary_line(results))
    if given.json is not None:
        given.json.write_text(json.dumps([_document(result) for result in results], indent=1))
    return 0 if all(result.is_good for result in results) else 1


if __name__ == "__main__":
    sys.exit(main())
