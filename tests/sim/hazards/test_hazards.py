"""Every hazard of the table, by ideal sight: found in time, answered as the table says, ended safely.

`FLIGHTD_SEEDS=20` flies each row with so many winds, sensors and eyes.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest

from flightd.config.schema import Config, load_config
from flightd.core.types import Command, CommandKind, Health, Phase
from flightd.mission.safety.hazard_table import HAZARDS, PHASE_OF, Action
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.plant.wind import Wind, WindParams
from flightd.site.corridor import Corridor
from flightd.site.site_file import load_site
from tests.rigs.brisk import BRISK
from tests.sim.ideal.ideal_flight import Flown, IdealFlight

CONFIGS = Path(__file__).parents[3] / "configs"
CONFIG = load_config(CONFIGS / "sim.toml").with_values(mission=BRISK)
SITE = load_site(CONFIGS / "site-demo.toml")
SEEDS = range(1, 1 + int(os.environ.get("FLIGHTD_SEEDS", "1")))
BODY_M = 0.3
"""Half the width of the drone, with its propellers."""
WAY_M = 0.9
"""The free way to both sides of the line: the shelves less the drone."""


@dataclass(frozen=True)
class Trial:
    """What goes wrong on the way to A3, for how long, and within what time it must be found."""

    begin: Callable[[IdealFlight], None]
    end: Callable[[IdealFlight], None] | None = None
    lasts_s: float = math.inf
    found_s: float = 0.5
    ends: Phase = Phase.ABORTED
    gust_mps: float = 0.3
    way_m: float = WAY_M
    visits: tuple[str, ...] = ("A3",)
    battery: dict[str, float] = field(default_factory=dict)
    """Keys of its section."""
    limit_s: float = 100.0
    """Until when it is flown, what waits without an end a little longer than until it waits."""
    or_ends: Phase | None = None
    """How it may end as well."""


def fault(**values: object) -> Callable[[IdealFlight], None]:
    def begin(flight: IdealFlight) -> None:
        for key, value in values.items():
            assert hasattr(flight.faults, key)
            setattr(flight.faults, key, value)

    return begin


def blow(x_mps: float, y_mps: float) -> Callable[[IdealFlight], None]:
    def begin(flight: IdealFlight) -> None:
        flight.airframe.wind = Wind(WindParams(x_mps, y_mps, correlation_s=0.3), flight.seed)

    return begin


def order(kind: CommandKind) -> Callable[[IdealFlight], None]:
    return lambda flight: flight.commands.append(Command("1", kind))


def pilot(flight: IdealFlight) -> None:
    flight.in_control = False


def failsafe(flight: IdealFlight) -> None:
    """It lands by itself; what is sent to it is not heard."""
    flight.in_control, flight.faults.in_failsafe = False, True


def tilt(roll_deg: float, pitch_deg: float) -> Callable[[IdealFlight], None]:
    def begin(flight: IdealFlight) -> None:
        flight.sensors.fault.roll_rad = math.radians(roll_deg)
        flight.sensors.fault.pitch_rad = math.radians(pitch_deg)

    return begin


def open_aisle(flight: IdealFlight) -> None:
    flight.aisle_closed = False


def drift(error_mps: float) -> Callable[[IdealFlight], None]:
    def begin(flight: IdealFlight) -> None:
        flight.sensors.fault.climb_drift_mps = error_mps

    return begin


def freeze(flight: IdealFlight) -> None:
    flight.faults.battery = round(flight.airframe.battery_frac, 2)


def silence(flight: IdealFlight) -> None:
    flight.ground_silent_s = 60.0


def ring(flight: IdealFlight) -> None:
    """The attitude answers slowly and hardly damped: of one that is only slow the loop learns in time."""
    whole = flight.airframe.params
    slow_radps = 0.3 * whole.attitude_bandwidth_radps
    flight.airframe.params = replace(whole, attitude_bandwidth_radps=slow_radps, attitude_damping=0.15)


def mislead(flight: IdealFlight) -> None:
    """The autopilot believes another one of its estimators."""
    flight.sensors.fault.roll_rad, flight.sensors.fault.pitch_rad = math.radians(3.0), math.radians(-3.0)


ROWS = {row.name: row for row in HAZARDS}
TRIALS: dict[str, Trial] = {
    "pilot": Trial(pilot, found_s=0.1),
    "uplink_lost": Trial(failsafe, found_s=0.1),
    "stop": Trial(order(CommandKind.STOP), found_s=0.05),
    "telemetry_stale": Trial(fault(silent=True), fault(silent=False), 1.5, ends=Phase.DONE),
    "telemetry_lost": Trial(fault(silent=True), found_s=3.2, limit_s=140.0),
    "heartbeat_lost": Trial(fault(heartless=True), found_s=5.2),
    "height_lost": Trial(fault(rangeless=True), found_s=4.4),
    "climb_lost": Trial(fault(climbless=True), found_s=1.2),
    "climb_wrong": Trial(drift(-1.0), found_s=1.0),
    "height_wrong": Trial(fault(height_m=-0.7), found_s=1.0),
    "attitude_wrong": Trial(fault(yaw_rad=math.radians(25.0)), found_s=1.0),
    "battery_low": Trial(
        fault(battery=0.15), found_s=0.05, ends=Phase.SWAP, visits=("A2", "A3"), limit_s=35.0
    ),
    "battery_critical": Trial(fault(battery=0.05), found_s=0.05),
    "battery_unknown": Trial(fault(battery=math.nan), found_s=3.2),
    "battery_unknown-frozen": Trial(
        freeze, found_s=41.0, visits=("A3", "A4", "A3", "A2", "A3"), battery={"frozen": 0.05}
    ),
    "battery_critical-told_full": Trial(fault(battery=1.0, cell_v=3.2), found_s=2.5),
    "wind": Trial(blow(0.0, 3.5), found_s=9.0),
    "ceiling_left": Trial(fault(height_m=4.2), found_s=0.6),
    "corridor_left": Trial(blow(0.0, 5.0), blow(0.0, 0.0), 1.0, found_s=2.5, ends=Phase.DONE),
    "ground_lost": Trial(silence, found_s=0.05, ends=Phase.DONE),
    "aisle_open": Trial(open_aisle, found_s=0.05),
    "lines_lost": Trial(fault(bare=True)),
    "camera_frozen": Trial(fault(frozen=True)),
    "camera_blind": Trial(fault(blank=True)),
    "frames_stale": Trial(fault(late_ns=900_000_000)),
    "camera_gone": Trial(fault(blind=True), fault(blind=False), 1.0, ends=Phase.DONE),
    # later than the others: what is only just known does not leap
    "delay_leapt": Trial(
        fault(delay_ns=-33_000_000), ends=Phase.DONE, found_s=2.0, visits=("A4", "A3", "A1")
    ),
    "lean_leapt": Trial(mislead, ends=Phase.DONE, found_s=0.05),
    "detector_killed": Trial(fault(health=Health(0.08, 1)), ends=Phase.DONE, found_s=0.05),
    "detector_hung": Trial(fault(health=Health(0.08, 2)), ends=Phase.DONE, found_s=0.05),
    "overload": Trial(fault(health=Health(0.4)), found_s=3.2),
    "swings": Trial(ring, found_s=12.0, or_ends=Phase.DONE),  # the gains that it lowers may calm it
    "clock_jump": Trial(fault(stamps_refused=40), ends=Phase.DONE, found_s=0.05),
    "loop_stalled": Trial(fault(stall_ns=400_000_000), ends=Phase.DONE, found_s=0.45),
    "clock_unsure": Trial(
        fault(clock_error_s=0.1), fault(clock_error_s=0.0), 2.0, ends=Phase.DONE, found_s=1.1
    ),
    "disk_full": Trial(fault(health=Health(0.08, 0, 0, "No space left on device")), found_s=0.05),
    "recorder_dead": Trial(fault(health=Health(0.08, 0, 1)), ends=Phase.DONE, found_s=0.05),
    "recorder_hung": Trial(fault(health=Health(0.08, 0, 2)), ends=Phase.DONE, found_s=0.05),
}


def fly(trial: Trial, seed: int, config: Config = CONFIG) -> tuple[Flown, float]:
    """The flight and the time at which the fault began, s of its clock."""
    flight = IdealFlight(
        SITE,
        config.with_values(battery=trial.battery),
        visits=trial.visits,
        seed=seed,
        wind=WindParams(gust_rms_mps=trial.gust_mps),
    )
    step, begun_ns, over = flight.pilot.step, [0], [False]

    def watch(tick):  # type: ignore[no-untyped-def]
        k = flight.airframe.kinematics(tick.now_ns)
        mission = flight.pilot.mission
        if not begun_ns[0] and mission.phase is Phase.FOLLOW and mission.goal.node == "A3" and k.x_m > 0.9:
            begun_ns[0] = tick.now_ns
            trial.begin(flight)
        elif begun_ns[0] and not over[0] and (tick.now_ns - begun_ns[0]) * 1e-9 > trial.lasts_s:
            over[0] = True
            assert trial.end is not None
            trial.end(flight)
        return step(tick)

    flight.pilot.step = watch  # type: ignore[method-assign]
    flown = flight.fly(trial.limit_s)
    assert begun_ns[0], "the fault never began"
    return flown, begun_ns[0] * 1e-9


def shelf_distance_m(k: Kinematics) -> float:
    return min(
        math.hypot(max(s.x0_m - k.x_m, 0.0, k.x_m - s.x1_m), k.y_m - s.y_m)
        for s in SITE.shelves
        if k.height_m < s.height_m
    )


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", TRIALS)
def test_a_hazard_is_found_answered_and_ends_safely(name: str, seed: int) -> None:
    trial, row = TRIALS[name], ROWS[name.partition("-")[0]]
    flown, begun_s = fly(trial, seed)
    assert row.trigger is not None
    told = [e for e in flown.events if e.name == "hazard" and e.stamp_ns * 1e-9 >= begun_s]
    said = [e for e in told if e.text.startswith(row.trigger.value)]
    assert said, [e.text for e in flown.events]
    assert said[0].stamp_ns * 1e-9 - begun_s <= trial.found_s
    after = {o.phase for o in flown.outputs if o.setpoint is None or o.setpoint.stamp_ns * 1e-9 > begun_s}
    if row.action in PHASE_OF:
        assert PHASE_OF[row.action] in after
    if row.action is Action.HANDS_OFF:
        assert flown.phase is Phase.PILOT
        return
    assert flown.phase in {trial.ends, trial.or_ends}, flown.reason
    truth = [k for _, k in flown.truth]
    assert truth[-1].height_m < 0.2
    assert min(map(shelf_distance_m, truth)) > BODY_M
    corridor = Corridor(SITE, WAY_M)
    assert max(corridor.nearest(k.x_m, k.y_m).distance_m for k in truth) <= trial.way_m


def test_roll_and_pitch_told_some_degrees_wrong_are_learnt_and_leaned_against() -> None:
    flown, _ = fly(Trial(tilt(3.0, -3.0)), 1)
    assert flown.phase is Phase.DONE, flown.reason
    assert max(Corridor(SITE, WAY_M).nearest(k.x_m, k.y_m).distance_m for _, k in flown.truth) < 0.6


def test_a_drone_that_is_not_heard_comes_to_rest_by_the_pictures() -> None:
    flown, begun_s = fly(TRIALS["telemetry_lost"], 5)
    silent = [k for _, k in flown.truth if 0.0 < k.stamp_ns * 1e-9 - begun_s < 4.0]
    assert max(math.hypot(k.vx_mps, k.vy_mps) for k in silent) > 0.6
    assert math.hypot(silent[-1].x_m - silent[0].x_m, silent[-1].y_m - silent[0].y_m) < 1.0
    assert math.hypot(silent[-1].vx_mps, silent[-1].vy_mps) < 0.15


@pytest.mark.parametrize("name", ["heartbeat_lost", "telemetry_lost"])
def test_silence_is_no_pilot_however_long_it_is_waited_through(name: str) -> None:
    patient = CONFIG.with_values(mission={"telemetry_hold_s": 2.0})
    flown, _ = fly(TRIALS[name], 1, patient)
    assert flown.phase is Phase.ABORTED
    assert flown.truth[-1][1].height_m < 0.2


def test_one_that_loses_its_height_high_up_is_down_within_twenty_seconds() -> None:
    flown, begun_s = fly(TRIALS["height_lost"], 5, CONFIG.with_values(mission={"height_m": 4.2}))
    found_s = next(e.stamp_ns * 1e-9 for e in flown.events if "height" in e.text and e.name == "hazard")
    truth = [k for _, k in flown.truth]
    down_s = next(k.stamp_ns * 1e-9 for k in truth if k.stamp_ns * 1e-9 > found_s and k.height_m < 0.15)
    assert max(k.height_m for k in truth) > 4.0
    assert begun_s < found_s < down_s < found_s + 20.0
    touched = [k for k in truth if down_s - 0.3 < k.stamp_ns * 1e-9 < down_s]
    assert min(k.climb_mps for k in touched) > -0.45


@pytest.mark.parametrize("seed", SEEDS)
def test_one_that_is_not_heard_any_more_is_soon_down_by_what_it_was_commanded_to_sink(seed: int) -> None:
    """It drifts until then; its last height is known, and what it is told since."""
    flown, _ = fly(TRIALS["telemetry_lost"], seed)
    landing = [k.height_m for phase, k in flown.truth if phase is Phase.LAND]
    assert landing[0] > 1.3
    down = next(i for i, height_m in enumerate(landing) if height_m < 0.13)
    assert down * 0.02 < 2.9
    speeds = [(landing[i] - landing[i + 1]) / 0.02 for i in range(down)]
    assert max(speeds[-5:]) < 0.6
