"""A real mission in every state that there is, and what makes each trigger happen to it."""

from __future__ import annotations

import io
import math
import pickle
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from flightd.config.battery import BatteryConfig
from flightd.config.hazards import HazardConfig, HazardExpert, LossAction
from flightd.config.scan import ScanConfig
from flightd.config.schema import Config
from flightd.core.types import CommandKind, GridPose, LandedState, Phase
from flightd.mission.machine import FLYING, Intent, State
from flightd.mission.scan.no_scan import NO_SCAN, AnyScanner
from flightd.mission.scan.scanner import Scanner
from flightd.mission.triggers import Trigger
from tests.unit.mission import shelves
from tests.unit.mission.configured import configured
from tests.unit.mission.driven import Flight

_SHIPPED = configured(
    BatteryConfig(flight_s=60.0, swap=True, swap_wait_s=4.0),
    dwell_s=1.0,
    settle_s=0.5,
    speed_mps=1.5,
    accel_mps2=2.0,
    autostart=False,
    start_countdown_s=0.0,
    telemetry_hold_s=0.1,
    telemetry_land_s=0.3,
    lines_land_s=1.0,
    recover_s=1.5,
    relocate_s=3.0,
    expert={
        "view_height_m": 0.15,
        "arm_timeout_s": 2.0,
        "start_expires_s": 1.0,
        "adopt_s": 0.1,
        "phase_slack_s": 3.0,
        "doubt_s": 0.05,
        "first_look_s": 0.05,
        "settled_s": 0.2,
    },
)
_AT_ONCE = HazardConfig().model_copy(
    update={
        "disagree_s": 0.0,
        "overload_s": 0.0,
        "record_lost": LossAction.LAND,
        "battery_unknown": LossAction.LAND,
        "expert": HazardExpert().model_copy(update={"push_s": 0.0, "outside_s": 0.0}),
    }
)


def losing(ground: LossAction = LossAction.LAND, record: LossAction = LossAction.LAND) -> Config:
    """What is tested with, and what is done when links are lost."""
    hazards = _AT_ONCE.model_copy(update={"record_lost": record})
    link = _SHIPPED.ground.model_copy(update={"lost_action": ground})
    return _SHIPPED.model_copy(update={"hazards": hazards, "ground": link})


PARAMS = losing()
"""Everything soon, nothing started by itself."""


def flight_of(params: Config, scans: bool = False) -> Flight:
    """A flight over four nodes in a row; one that `scans` never gets a picture of a shelf."""
    scanner: AnyScanner = NO_SCAN
    if scans:
        scanner = Scanner(shelves.SITE, shelves.SIGHT, ScanConfig(max_height_m=4.0, view_s=0.4, retakes=0))
    return Flight(params, shelves.SITE, scanner)


def in_state(state: State, params: Config = PARAMS, scans: bool = False) -> Flight:
    """A flight that has just come into a state."""
    flight = flight_of(params, scans or state.phase in {Phase.CLIMB, Phase.SCAN})
    _lead(flight, state)
    assert flight.mission.state == state, (flight.mission.state, flight.mission.reason)
    return flight


def _lead(flight: Flight, state: State) -> None:
    phase, intent = state.phase, state.intent
    if phase is Phase.PREFLIGHT:
        if intent is Intent.VISIT:
            start(flight)
            flight.set(battery_frac=0.25)
    elif state.adopted:
        found_flying(flight)
        if phase is Phase.LAND:
            flight.order(CommandKind.STOP if state.stopped else CommandKind.LAND)
            flight.run(0.02, follow=False)
    elif phase in FLYING:
        fly_to(flight, phase)
        turn(flight, intent)
        if phase is Phase.HOLD:  # whoever turns back goes on
            flight.order(CommandKind.PAUSE)
    elif phase is Phase.LAND and state.on_pad:
        fly_to(flight, Phase.FOLLOW)
        flight.to(Phase.HOVER)
        flight.to(Phase.FOLLOW)
        turn(flight, intent)
        flight.to(Phase.LAND, 300.0)
    elif phase is Phase.SWAP:
        land_to_swap(flight)
        if intent is Intent.VISIT:
            start(flight)
            flight.set(battery_frac=0.15)
    elif phase is Phase.DONE:
        fly_to(flight, Phase.LAND)
        flight.set(armed=False)
        flight.run(0.02, follow=False)
    else:
        fly_to(flight, Phase.ARMING if phase is Phase.ARMING else Phase.FOLLOW)
        end(flight, state)


def end(flight: Flight, state: State) -> None:
    """End the leg in hand."""
    if state.phase is Phase.PILOT:
        flight.set(in_control=False)
    elif state.phase is Phase.ABORTED:
        flight.set(armed=False)
    elif state.phase is Phase.LAND:
        flight.order(CommandKind.STOP if state.stopped else CommandKind.LAND)
    else:
        return
    flight.run(0.02, follow=False)


def found_flying(flight: Flight) -> None:
    flight.set(armed=True, landed=LandedState.IN_AIR, height_m=1.5)
    flight.run(0.02, follow=False)
    flight.run(0.2, follow=False)


def start(flight: Flight) -> None:
    """Order a start once the flight is ready."""
    flight.set(battery_frac=0.95)
    flight.run(0.02, follow=False)
    flight.order(CommandKind.START)


def fly_to(flight: Flight, phase: Phase) -> None:
    start(flight)
    if phase is Phase.HOLD:
        flight.to(Phase.FOLLOW)
        flight.order(CommandKind.PAUSE)
    elif phase is Phase.RELOCATE:
        flight.to(Phase.FOLLOW)
        flight.integrity = 0.5
    flight.to(phase)


def turn(flight: Flight, intent: Intent) -> None:
    if intent is Intent.HOME:
        flight.order(CommandKind.HOME)
    elif intent is Intent.RETURN:
        flight.set(battery_frac=0.15)
        flight.run(0.02, follow=False)


def land_to_swap(flight: Flight) -> None:
    """A node was visited on this battery, others are left."""
    fly_to(flight, Phase.FOLLOW)
    flight.to(Phase.HOVER)
    flight.to(Phase.FOLLOW)
    turn(flight, Intent.RETURN)
    flight.to(Phase.LAND)
    flight.set(landed=LandedState.ON_GROUND, armed=False, height_m=0.1)
    flight.run(0.02, follow=False)


@dataclass(frozen=True)
class Stimulus:
    """What makes a trigger happen, how long that may take, and how the mission is configured for it."""

    act: Callable[[Flight], None]
    within_s: float = 0.4
    params: Config = PARAMS
    scanning: tuple[Phase, ...] = ()
    """Where a scanner is needed for it."""
    hold: bool = True
    """Done anew at each tick."""
    follow: bool = False
    """The drone goes where it is led; otherwise it stays."""


def sensed(within_s: float = 0.4, **changes: Any) -> Stimulus:
    return Stimulus(lambda flight: flight.set(**changes), within_s)


def warned(within_s: float = 0.4, **changes: Any) -> Stimulus:
    return Stimulus(lambda flight: _warn(flight, **changes), within_s)


def _warn(flight: Flight, **changes: Any) -> None:
    """Beside what is warned of already."""
    flight.set(warnings=replace(flight.inputs.warnings, **changes))


def off_the_floor(**changes: Any) -> Stimulus:
    """Near the pad a picture may stay the same, or show nothing."""

    def act(flight: Flight) -> None:
        height_m = max(flight.inputs.height_m, 0.6)
        flight.set(height_m=height_m)
        _warn(flight, **changes)

    return Stimulus(act)


def _lose_lines(flight: Flight) -> None:
    """Near the floor a take-off may."""
    flight.set(x_age_s=9.0, y_age_s=9.0)
    if flight.phase is Phase.TAKE_OFF:
        flight.set(height_m=1.1)


def sick(params: Config = PARAMS, **changes: Any) -> Stimulus:
    def act(flight: Flight) -> None:
        _warn(flight, health=replace(flight.inputs.warnings.health, **changes))

    return Stimulus(act, params=params)


def ordered(kind: CommandKind, node: str = "", within_s: float = 0.04) -> Stimulus:
    return Stimulus(lambda flight: flight.order(kind, node), within_s, hold=False)


def placed(within_s: float = 0.8, **changes: Any) -> Stimulus:
    """The drone at rest at its goal, but for the changes."""

    def act(flight: Flight) -> None:
        goal = flight.mission.goal
        at = {"x_m": goal.x_m, "y_m": goal.y_m, "yaw_rad": goal.yaw_rad, "integrity": 1.0, **changes}
        flight.set(pose=replace(_pose(flight), vx_mps=0.0, vy_mps=0.0, **at))

    return Stimulus(act, within_s)


def _pose(flight: Flight) -> GridPose:
    return flight.inputs.pose or GridPose(0, "A1", 0, 0, 0.0, 0, 0, 0, 0, 1.5, (0.0,) * 9, 1.0)


def _jump(flight: Flight) -> None:
    pose = _pose(flight)
    flight.set(pose=replace(pose, x_m=pose.x_m + 3.0))
    flight.run(0.02, follow=False)


def _resume(flight: Flight) -> None:
    if flight.phase is Phase.HOLD:
        flight.order(CommandKind.RESUME)


def _start(flight: Flight) -> None:
    if flight.mission.state.intent is Intent.WAIT:
        start(flight)
    else:
        flight.order(CommandKind.START)


def _idle(_: Flight) -> None:
    """Time passes."""


def _beat_lost(flight: Flight) -> None:
    flight.heartbeat_s = 9.0


def _full(flight: Flight) -> None:
    flight.set(battery_frac=0.95)


def _hold(flight: Flight) -> None:
    """What was lost holds nothing whose charge only just brings it back."""
    if flight.mission.state.intent is Intent.RETURN:
        flight.order(CommandKind.PAUSE)
    else:
        flight.set(ground_silent_s=9.0)


def _stuck(flight: Flight) -> None:
    """Nothing that the phase waits for comes about."""
    if flight.phase is Phase.TAKE_OFF:
        flight.set(height_m=0.2)
    elif flight.phase is not Phase.RELOCATE:
        flight.set(pose=None)


def _found(flight: Flight) -> None:
    flight.set(armed=True, landed=LandedState.IN_AIR, height_m=1.5)


_HOME = losing(record=LossAction.HOME)
_HELD = losing(ground=LossAction.HOLD)
_PATIENT = PARAMS.with_values(
    mission=PARAMS.mission.with_values(expert=PARAMS.mission.expert.with_values(start_expires_s=5.0))
)
_ONE_BATTERY = PARAMS.model_copy(update={"battery": BatteryConfig(flight_s=60.0)})

STIMULI: Mapping[Trigger, Stimulus] = {
    Trigger.PILOT_TOOK: sensed(in_control=False),
    Trigger.FAILSAFE_TOOK: sensed(in_control=False, in_failsafe=True),
    Trigger.STOP: ordered(CommandKind.STOP),
    Trigger.DOWN_TO_SWAP: sensed(armed=False),
    Trigger.DOWN_AS_TOLD: sensed(armed=False),
    Trigger.NOT_COUNTED: replace(sensed(armed=False), scanning=(Phase.LAND,)),
    Trigger.DISARMED: sensed(armed=False),
    Trigger.VANISHED: sensed(61.0, telemetry_age_s=70.0),
    Trigger.TELEMETRY_LOST: sensed(telemetry_age_s=0.4),
    Trigger.STEP_FAILED: sensed(failed=True),
    Trigger.HEARTBEAT_LOST: Stimulus(_beat_lost),
    Trigger.HEIGHT_STUCK: warned(height_stuck=True),
    Trigger.CLIMB_WRONG: warned(climb_wrong=True),
    Trigger.CLIMB_LOST: sensed(1.2, climb_mps=math.nan),
    Trigger.HEIGHT_LOST: sensed(height_m=math.nan),
    Trigger.CEILING_LEFT: warned(headroom_m=-1.0),
    Trigger.ATTITUDE_WRONG: warned(heading_error_rad=1.0),
    Trigger.BATTERY_CRITICAL: sensed(battery_frac=0.05),
    Trigger.WIND: warned(push_mps2=5.0),
    Trigger.LAND_HERE: ordered(CommandKind.LAND),
    Trigger.GROUND_LOST: sensed(ground_silent_s=9.0),
    Trigger.BATTERY_UNKNOWN: sensed(battery_frac=math.nan),
    Trigger.AISLE_OPEN: sensed(aisle_closed=False),
    Trigger.RECORD_LOST: sick(recorder_error="disk full"),
    Trigger.HAZARD_LASTS: warned(1.3, frozen_s=9.0),
    Trigger.LINES_LOST_LONG: Stimulus(_lose_lines, 2.5),
    Trigger.NO_LINES: sensed(x_age_s=math.inf, y_age_s=math.inf, height_m=1.1),
    Trigger.CUT_OFF: placed(node="beyond the barrier"),
    Trigger.POSITION_UNKNOWN: Stimulus(_idle, 3.3),
    Trigger.TIMED_OUT: Stimulus(_stuck, 70.0, params=_PATIENT),
    Trigger.START_EXPIRED: Stimulus(_idle, 1.2),
    Trigger.TELEMETRY_STALE: sensed(telemetry_age_s=0.2),
    Trigger.CLOCK_JUMP: sensed(dt_s=0.6),
    Trigger.CLOCK_UNSURE: sensed(clock_error_s=0.5),
    Trigger.CAMERA_FROZEN: off_the_floor(frozen_s=9.0),
    Trigger.CAMERA_BLIND: off_the_floor(blank_s=9.0),
    Trigger.FRAMES_STALE: warned(frame_age_s=9.0),
    Trigger.HEIGHT_WRONG: warned(height_doubted=True),
    Trigger.CORRIDOR_LEFT: warned(outside_m=1.0),
    Trigger.SWINGS: warned(swings=True),
    Trigger.OVERLOAD: sick(latency_p99_s=9.0),
    Trigger.LINES_LOST: sensed(x_age_s=9.0, y_age_s=9.0),
    Trigger.HOLD: Stimulus(_hold, params=_HELD),
    Trigger.POSITION_DOUBTED: placed(integrity=0.5),
    Trigger.LINES_FOUND: Stimulus(_resume, 0.6, hold=False),
    Trigger.POSITION_SURE: placed(),
    Trigger.FOUND_FLYING: Stimulus(_found),
    Trigger.UNATTENDED: Stimulus(_idle, 1.7),
    Trigger.READY: Stimulus(_full),
    Trigger.ARMED: sensed(armed=True, in_control=True),
    Trigger.AT_HEIGHT: sensed(height_m=1.5),
    Trigger.ACQUIRED: placed(),
    Trigger.ARRIVED: placed(),
    Trigger.SCAN_DUE: Stimulus(_idle, scanning=(Phase.HOVER,)),
    Trigger.AT_VIEW: Stimulus(_idle, 10.0, follow=True),
    Trigger.VIEW_MISSED: Stimulus(_idle, 30.0),
    Trigger.VIEW_DONE: Stimulus(_idle, 0.6),
    Trigger.AWAITS_MORE: Stimulus(
        lambda flight: flight.order(CommandKind.GOTO, "A3", waits=True), 0.04, hold=False
    ),
    Trigger.DWELLED: placed(1.2),
    Trigger.TURNED: placed(),
    Trigger.ROUTE_DONE: placed(1.2),
    Trigger.BATTERY_LOW: sensed(battery_frac=0.15),
    Trigger.DETECTOR_LOST: sick(detectors_replaced=5),
    Trigger.RECORDER_DEAD: sick(recorder_restarts=5),
    Trigger.DELAY_LEAPT: warned(delay_leaps=1),
    Trigger.LEAN_LEAPT: warned(lean_leaps=1),
    Trigger.START: Stimulus(_start, 0.04, hold=False),
    Trigger.PLAN: Stimulus(
        lambda flight: flight.order(CommandKind.PLAN, nodes=("A3", "A2")), 0.04, hold=False
    ),
    Trigger.GOTO: ordered(CommandKind.GOTO, "A3"),
    Trigger.GO_HOME: ordered(CommandKind.HOME),
    Trigger.PAUSE: ordered(CommandKind.PAUSE),
    Trigger.RESUME: ordered(CommandKind.RESUME),
    Trigger.HOME_IN_NEED: sick(_HOME, recorder_error="disk full"),
    Trigger.BACK_TO_SWAP: sensed(battery_frac=0.15),
    Trigger.BACK_TO_END: replace(sensed(battery_frac=0.15), params=_ONE_BATTERY),
    Trigger.POSITION_CORRECTED: Stimulus(_jump, 0.02, hold=False),
}


class _Begun:
    """A flight that has come into a state, to be gone on with any number of times.  Pickled once: copies of
    it cost a third of deep ones."""

    def __init__(self, flight: Flight, params: Config) -> None:
        self._shared = {str(n): thing for n, thing in enumerate((flight.site, shelves.SIGHT, params))}
        names = {id(thing): name for name, thing in self._shared.items()}
        written = io.BytesIO()
        pickler = pickle.Pickler(written)
        pickler.persistent_id = lambda thing: names.get(id(thing))  # type: ignore[method-assign]
        pickler.dump(flight)
        self._written = written.getvalue()

    def copied(self) -> Flight:
        reader = pickle.Unpickler(io.BytesIO(self._written))
        reader.persistent_load = self._shared.__getitem__  # type: ignore[method-assign]
        flight = reader.load()
        assert isinstance(flight, Flight)
        return flight


_BEGUN: dict[tuple[State, int, bool], _Begun] = {}


def fresh(state: State, params: Config = PARAMS, scans: bool = False) -> Flight:
    """A flight of its own in a state."""
    key = state, id(params), scans
    if key not in _BEGUN:
        _BEGUN[key] = _Begun(in_state(state, params, scans), params)
    return _BEGUN[key].copied()
