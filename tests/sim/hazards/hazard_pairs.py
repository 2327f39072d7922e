"""Random pairs of faults at random moments, flown whole: camera, adapter, autopilot, judged by the truth.

python -m tests.sim.hazards.hazard_pairs 500 flies the first five hundred and prints how each ended, then the
worst distances; exit 1 where one was unsafe.  `--from 7` begins with another one, `--keep DIR` keeps the logs
of the unsafe ones, `--json FILE` is written for tools.safety_case.  `--in-stages` draws both moments within
one stage of the flight instead (`STAGES`): few that are drawn over the whole of it meet the short ones.
"""

from __future__ import annotations

import argparse
import json
import math
import random
import shutil
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from flightd.app.simulation.flown_code import flown_code
from flightd.app.simulation.judgement import judge_flight
from flightd.app.simulation.launch import fly
from flightd.app.simulation.prepare import SimOptions, prepare
from flightd.app.simulation.sweep_routes import ACROSS, ALONG, SweepRoute, route_by_seed
from flightd.cli.scenario_sweep import faults_in_words
from flightd.core.errors import RunError
from flightd.sim.judge.flight_score import FlightScore
from flightd.sim.judge.verdict import SAFETY_KINDS, JudgedFault
from flightd.sim.scenario.scenario import Scenario

MOMENTS_S: Final[dict[SweepRoute, tuple[float, float]]] = {ALONG: (0.0, 36.0), ACROSS: (0.0, 51.0)}
"""From lift-off until the drone has landed, undisturbed."""
STAGES: Final[dict[SweepRoute, dict[str, tuple[tuple[float, float], ...]]]] = {
    ALONG: {
        "take-off": ((0.0, 3.0),),
        "at a node": ((7.0, 9.4), (15.7, 18.1)),
        "in a turn": ((18.1, 23.9),),
        "above the pad": ((31.5, 36.0),),
    },
    ACROSS: {
        "take-off": ((0.0, 3.0),),
        "at a node": ((3.5, 5.5), (14.4, 16.8), (24.3, 26.7)),
        "in a turn": ((5.5, 8.8), (16.8, 20.1), (26.7, 32.5), (37.2, 40.5)),
        "above the pad": ((46.3, 51.0),),
    },
}
"""When an undisturbed flight is in them, s from lift-off."""
_LASTS_S = (0.2, 15.0)
_KINDS: tuple[Callable[[random.Random], dict[str, Any]], ...] = (
    lambda draw: {"kind": "camera_frozen"},
    lambda draw: {"kind": draw.choice(["camera_black", "camera_white"])},
    lambda draw: {"kind": "camera_gone"},
    lambda draw: {"kind": "camera_late", "delay_s": round(draw.uniform(0.2, 1.5), 2)},
    lambda draw: {"kind": "camera_turned", "turn_deg": round(draw.choice([-1, 1]) * draw.uniform(5, 30), 1)},
    lambda draw: {"kind": "telemetry_silent"},
    lambda draw: {"kind": "heartbeat_silent"},
    lambda draw: {"kind": "companion_dead", "duration_s": math.inf},
    lambda draw: {
        "kind": "attitude_biased",
        "yaw_deg": round(draw.choice([-1, 1]) * draw.uniform(10, 40), 1),
    },
    lambda draw: {
        "kind": "attitude_biased",
        draw.choice(["roll_deg", "pitch_deg"]): round(draw.choice([-1, 1]) * draw.uniform(1, 4), 1),
    },
    lambda draw: {
        "kind": "attitude_slow",
        "share": round(draw.uniform(0.3, 0.9), 2),
        "damping": round(draw.uniform(0.15, 0.7), 2),
    },
    lambda draw: {"kind": "uplink_silent"},
    lambda draw: {"kind": "height_biased", "offset_m": round(draw.uniform(-1.0, 3.0), 2)},
    lambda draw: {"kind": "height_lost"},
    lambda draw: {
        "kind": "height_stuck",
        "reading_m": round(draw.uniform(0.05, 2.0), 2),
        "swing_m": draw.choice([0.0, 0.12, 0.4]),
    },
    lambda draw: {"kind": "height_scaled", "share": round(draw.uniform(0.3, 1.5), 2)},
    lambda draw: {"kind": "battery", "charge": round(draw.uniform(0.03, 0.3), 2)},
    lambda draw: {"kind": "wind", "mean_y_mps": round(draw.uniform(-3.5, 3.5), 2)},
    lambda draw: {"kind": "wind", "mean_x_mps": round(draw.uniform(-3.5, 3.5), 2)},
    # he lands when it ends: one who flies on for ever is no flight of ours
    lambda draw: {"kind": "pilot", "duration_s": round(draw.uniform(*_LASTS_S), 2)},
    lambda draw: {"kind": "clock_jump", "jump_s": round(draw.uniform(-5.0, 5.0), 2)},
    lambda draw: {"kind": "detector_killed"},
    lambda draw: {"kind": "step_fails"},
    lambda draw: {"kind": "landing_unreported"},
    lambda draw: {"kind": "battery_silent"},
    lambda draw: {"kind": "climb_silent"},
    lambda draw: {"kind": "charge_misreported", "percent": draw.randint(0, 100)},
    lambda draw: {"kind": "timesync_silent"},
    lambda draw: {"kind": "clock_rate", "share": round(draw.uniform(-0.03, 0.03), 4)},
    lambda draw: {"kind": "height_quality"},
    lambda draw: {
        "kind": "climb_stuck",
        "reading_mps": draw.choice([0.0, round(draw.uniform(-1.0, 1.0), 2)]),
    },
    lambda draw: {
        "kind": "climb_drifts",
        "error_mps": round(draw.uniform(-0.8, 0.8), 2),
        "duration_s": 3.0,
    },
    lambda draw: {"kind": "aisle_opened"},
    lambda draw: {
        "kind": "bare_floor",
        "at_node": "",  # of the route
        "half_m": round(draw.uniform(0.5, 4.0), 2),
    },
    lambda draw: {"kind": "camera_disordered", "delay_s": round(draw.uniform(0.05, 0.2), 2)},
)
"""Each as strong as the table of hazards claims to bear."""
LEFT_OUT: Final[dict[str, str]] = {
    "vehicle_reboot": "its motors stop: it falls whatever is done",
    "order": "over the real link, which needs the clock",
    **dict.fromkeys(
        (
            "detector_hung",
            "writer_killed",
            "writer_hung",
            "disk_full",
            "loop_stalled",
            "cpu_taken",
            "ground_silent",
        ),
        "needs the clock, and these fly in lockstep",
    ),
}
"""The other kinds, and why; nor does anything happen to the front camera: nothing is scanned."""
PASSED: Final[dict[SweepRoute, tuple[str, ...]]] = {ALONG: ("A2", "A3", "A4"), ACROSS: ("B1", "B2")}
"""Where the floor may be bare."""
_UNSAFE = SAFETY_KINDS | {"record_lost"}
"""None of them takes the disk away: no record is lost either."""


@dataclass(frozen=True, slots=True)
class FlownPair:
    """What went wrong, how it ended, and what was unsafe about it."""

    seed: int
    faults: str
    ended: str
    score: FlightScore
    unsafe: tuple[JudgedFault, ...]

    def document(self) -> dict[str, Any]:
        """What `evidence_of_pairs` of tools.safety_case reads."""
        return {
            "seed": self.seed,
            "faults": self.faults,
            "ended": self.ended,
            "unsafe": [asdict(fault) for fault in self.unsafe],
            "min_clearance_m": self.score.min_clearance_m,
            "max_overshoot_m": self.score.max_overshoot_m,
        }

    def __str__(self) -> str:
        words = faults_in_words(map(asdict, self.unsafe)) or "safe"
        return f"{self.seed}: {self.faults}: {self.ended}: {words}"


def draw_pair(seed: int, *, in_stages: bool = False) -> Scenario:
    """Two different kinds of fault, each for good or for a while, or at a place."""
    draw = random.Random(seed)
    route = route_by_seed(seed)
    nodes = PASSED[route]
    windows_s: Sequence[tuple[float, float]] = (MOMENTS_S[route],)
    if in_stages:
        windows_s = STAGES[route][draw.choice(sorted(STAGES[route]))]
    faults = []
    for make in draw.sample(_KINDS, 2):
        lasts_s = math.inf if draw.random() < 0.5 else round(draw.uniform(*_LASTS_S), 2)
        when = {"at_s": round(draw.uniform(*draw.choice(windows_s)), 2), "duration_s": lasts_s}
        fault = make(draw)
        faults.append(fault | {"at_node": draw.choice(nodes)} if "at_node" in fault else when | fault)
    return Scenario.model_validate({"fault": faults})


def fly_pair(seed: int, folder: Path, vehicle: str, *, in_stages: bool = False) -> FlownPair:
    """Fly it on the seed's route, with wind and sensors of the same seed."""
    scenario = draw_pair(seed, in_stages=in_stages)
    # one that waits on its pad for a fresh battery waits for ever
    options = SimOptions(seed=seed, vehicle=vehicle, settings=["battery.swap=false"])
    simulation = prepare(options, scenario, folder, lambda _: None, sweep_route=route_by_seed(seed).setting)
    ended = ""
    try:
        fly(simulation)
    except RunError as err:
        ended = str(err)
    judgement = judge_flight(simulation)
    unsafe = [fault for fault in judgement.faults if fault.kind in _UNSAFE]
    words = "; ".join(
        " ".join(
            f"{value}" for key, value in fault.model_dump(exclude_defaults=True).items() if key != "camera"
        )
        for fault in scenario.fault
    )
    return FlownPair(seed, words, ended or judgement.score.reason, judgement.score, tuple(unsafe))


def main(arguments: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("flights", type=int, nargs="?", default=20)
    parser.add_argument("--from", dest="first", type=int, default=1)
    parser.add_argument("--vehicle", choices=["ardupilot", "px4"], default="ardupilot")
    parser.add_argument("--in-stages", action="store_true")
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args(arguments)
    if options.json is not None and options.in_stages:
        parser.error("--json tells of seeds as they are drawn over the whole flight, without --in-stages")
    flown, code = [], flown_code()
    for seed in range(options.first, options.first + options.flights):
        with tempfile.TemporaryDirectory() as made:
            folder = Path(made)
            pair = fly_pair(seed, folder, options.vehicle, in_stages=options.in_stages)
            if pair.unsafe and options.keep is not None:
                shutil.copytree(folder, options.keep / str(seed), dirs_exist_ok=True)
        flown.append(pair)
        print(pair, flush=True)
    if options.json is not None:
        origin = {"vehicle": options.vehicle, "code": code, "flown": f"{datetime.now(UTC):%Y-%m-%d}"}
        document = {"pairs": [pair.document() | origin for pair in flown]}
        options.json.write_text(json.dumps(document, default=str) + "\n", encoding="utf-8")
    unsafe = [pair.seed for pair in flown if pair.unsafe]
    clearances = [pair.score.min_clearance_m for pair in flown if pair.score.min_clearance_m is not None]
    above = [pair.score.max_overshoot_m for pair in flown if pair.score.max_overshoot_m is not None]
    print(
        f"{len(flown)} flights, {len(unsafe)} unsafe {unsafe};"
        f" nearest {min(clearances, default=math.nan):.2f} m,"
        f" highest above the command {max(above, default=math.nan):.2f} m"
    )
    return 1 if unsafe else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
