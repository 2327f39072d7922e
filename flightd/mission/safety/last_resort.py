"""What is flown when the step itself fails: down by what is still seen of the floor, or else level and down
by what the vehicle reports alone.  Pure."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeVar

from flightd.config.mission import MissionConfig
from flightd.control.flight_controller import Reference
from flightd.core.scanning import Finding, Settled
from flightd.core.shared_pose import SharedPose
from flightd.core.tick import StepFailure, TickInput, TickOutput
from flightd.core.types import (
    OVER,
    AttitudeSetpoint,
    CommandKind,
    Demand,
    Event,
    EventLevel,
    LandedState,
    Phase,
    VehicleState,
)
from flightd.mission.guidance import Guidance, Guide, MissionInputs
from flightd.mission.safety.hazard_monitor import GIVE_UP_S
from flightd.mission.safety.hazard_table import ACTIONS
from flightd.mission.triggers import Trigger

_T = TypeVar("_T")

_GIVE_UP_NS = round(GIVE_UP_S * 1e9)
_BY_SIGHT_NS = 20_000_000_000
"""For so long it may sink by the lines: from higher its autopilot goes on."""
_LEFT_TO_AUTOPILOT_M = 0.4
_DOWN = frozenset({CommandKind.STOP, CommandKind.LAND})
_SIGHT_S, _TOLD_S = 0.3, 0.2
"""How old the floor's picture and the attitude may be to sink by them."""
# constants, all of them: what is answered here calls as little as possible of what may have failed
_WHY = Trigger.STEP_FAILED.value
_ACTION = ACTIONS[Trigger.STEP_FAILED].value


@dataclass(frozen=True, slots=True)
class Fallback:
    """What goes out in place of the mission's guidance."""

    phase: Phase
    demand: Demand
    setpoint: AttitudeSetpoint | None
    shared: SharedPose | None = None

    def onto(
        self,
        last: TickOutput,
        events: tuple[Event, ...],
        findings: tuple[Finding, ...] = (),
        settled: tuple[Settled, ...] = (),
    ) -> TickOutput:
        """This in place of what went out last; where the drone is, nobody says any more."""
        return replace(
            last,
            setpoint=self.setpoint,
            demand=self.demand,
            phase=self.phase,
            reason=_WHY,
            pose=None,
            tracks=None,
            shared=self.shared,
            events=events,
            findings=findings,
            settled=settled,
        )


@dataclass(frozen=True, slots=True)
class Sinking:
    """At rest over the floor and down: what goes out, and what the autopilot's estimator may be told."""

    setpoint: AttitudeSetpoint
    shared: SharedPose | None = None


class LastResort:
    """Answers a tick whose step has failed: tell it by `caught`, then ask for the `answer`.

    After the first failure the drone is levelled at the same height, and the mission is left to land it.  It
    has `given_up` the mission once that fails again: what is in the air sinks at rest over the floor as long
    as that can be steered without the mission, then it is kept level, and its autopilot is told to land; a
    pilot who takes it keeps it; what was found flying is taken over first.  Nothing is armed, and what stands
    is disarmed."""

    def __init__(self, params: MissionConfig) -> None:
        self._hold_ns = round(params.telemetry_hold_s * 1e9)
        self._sink_mps = params.land_mps
        self._end: Phase | None = None
        self._failures = 0
        self._by_sight_until_ns: int | None = None
        self._was_adopted = self._sinks = False
        self.failure: StepFailure | None = None
        """What the newest step raised, None where it raised nothing."""
        self.seen: VehicleState | None = None
        """What the vehicle told last, to be set at each tick at which it tells anything."""

    @property
    def failed(self) -> bool:
        """A step has failed in this flight."""
        return self._failures > 0

    @property
    def sinks_by_sight(self) -> bool:
        """The mission is not stepped any more, and the drone is still steered."""
        return self._sinks

    @property
    def given_up(self) -> bool:
        """The mission is not stepped any more."""
        return self._failures > 1

    def found_flying(self) -> None:
        """The drone was taken over in the air: its lines need not be those that they are taken for."""
        self._was_adopted = True

    def caught(self, now_ns: int, err: Exception) -> None:
        """The step has raised this."""
        self._failures += 1
        self.failure = StepFailure.of(now_ns, err)

    def answer(
        self,
        tick: TickInput,
        last: TickOutput,
        drain_events: Callable[[], tuple[Event, ...]],
        drain_findings: Callable[[], tuple[tuple[Finding, ...], tuple[Settled, ...]]],
        by_sight: Callable[[], Sinking | None],
    ) -> TickOutput:
        """What goes out; `last` is what did before, two drain what the mission's parts still have to tell,
        `by_sight` is how it sinks at rest over the floor, None where that is not known."""
        answer = Fallback(last.phase, last.demand, last.setpoint and AttitudeSetpoint(tick.now_ns))
        if self.given_up:
            answer = self._sighted(tick, last, self.step(tick.now_ns, tick.vehicle, last.phase), by_sight)
        no_events: tuple[Event, ...] = ()
        nothing: tuple[tuple[Finding, ...], tuple[Settled, ...]] = ((), ())
        findings, settled = _rescued(drain_findings, nothing)
        news = self._news(tick.now_ns, last.phase, answer.phase)
        return answer.onto(last, (*_rescued(drain_events, no_events), *news), findings, settled)

    def step(self, now_ns: int, vehicle: VehicleState | None, before: Phase) -> Fallback:
        """Level and down; `before` is the phase answered last.  A vehicle that tells nothing any more is
        what it was, not heard."""
        if before in OVER:
            self._end = self._end or before
        self.seen = vehicle = vehicle or self.seen
        silent_ns = _GIVE_UP_NS if vehicle is None else _silent_ns(now_ns, vehicle)
        heard = vehicle is not None and self._hears(now_ns, vehicle)  # silence is no pilot
        if self._end is None and vehicle is not None:
            if (heard and not vehicle.armed) or silent_ns > _GIVE_UP_NS:
                self._end = Phase.ABORTED
            elif heard and not vehicle.in_control and before is not Phase.RECOVER:
                self._end = Phase.PILOT
        if self._end is Phase.PILOT:
            return Fallback(Phase.PILOT, Demand.HANDS_OFF, None)
        if self._end is not None or vehicle is None:
            return Fallback(self._end or Phase.ABORTED, _ended(vehicle), None)
        sinking = AttitudeSetpoint(now_ns, climb_mps=-self._sink_mps)
        if not vehicle.in_control and before is Phase.RECOVER:
            return Fallback(before, Demand.KEEP, sinking)
        standing = heard and vehicle.landed is LandedState.ON_GROUND
        return Fallback(Phase.LAND, Demand.DISARM if standing else Demand.LAND, sinking)

    def _hears(self, now_ns: int, vehicle: VehicleState) -> bool:
        return not vehicle.unheard and now_ns - vehicle.attitude.stamp_ns <= self._hold_ns

    def _sighted(
        self, tick: TickInput, last: TickOutput, otherwise: Fallback, by_sight: Callable[[], Sinking | None]
    ) -> Fallback:
        """At rest over the floor in place of what is level; once that ends it stays so.  A landing of the
        autopilot's own that was asked for, before or by an order, is not put off."""
        if self._by_sight_until_ns is None:
            lands = last.demand in {Demand.LAND, Demand.DISARM}
            self._by_sight_until_ns = 0 if lands or self._was_adopted else tick.now_ns + _BY_SIGHT_NS
        self._sinks = False
        if otherwise.setpoint is None or otherwise.demand is not Demand.LAND:
            return otherwise
        if any(command.kind in _DOWN for command in tick.commands):
            self._by_sight_until_ns = 0
        nothing: Sinking | None = None
        sinking = _rescued(by_sight, nothing) if tick.now_ns < self._by_sight_until_ns else None
        self._sinks = sinking is not None
        if sinking is None:
            self._by_sight_until_ns = 0
            return otherwise
        return Fallback(Phase.LAND, Demand.KEEP, sinking.setpoint, sinking.shared)

    def _news(self, now_ns: int, before: Phase, after: Phase) -> tuple[Event, ...]:
        events = []
        if self.failure is not None:
            events.append(Event(now_ns, EventLevel.ERROR, "step_failed", self.failure.error))
        if after is not before:
            events.append(Event(now_ns, EventLevel.WARNING, "hazard", f"{_WHY}: {_ACTION}"))
            events.append(Event(now_ns, EventLevel.WARNING, "phase", f"{before} -> {after}: {_WHY}"))
        return tuple(events)


def sinking_by_sight(inputs: MissionInputs, sink_mps: float) -> Guidance | None:
    """How it comes down at rest over the floor; None where the lines, the attitude, the height or the
    vehicle tell too little for that, low enough for the autopilot's own landing, and where the vehicle comes
    to rest in that by itself."""
    vehicle, pose, warnings = inputs.vehicle, inputs.pose, inputs.warnings
    if vehicle is None or pose is None:
        return None
    is_steered = (
        vehicle.armed
        and vehicle.in_control
        and vehicle.landed is LandedState.IN_AIR
        and not vehicle.hovers_unsteered
        and inputs.sight_s < _SIGHT_S
        and inputs.telemetry_age_s < _TOLD_S
        and inputs.believed_height_m > _LEFT_TO_AUTOPILOT_M
        and not (warnings.height_stuck or warnings.climb_wrong)
    )
    if not is_steered:
        return None
    reference = Reference(pose.x_m, pose.y_m, pose.yaw_rad, math.nan, climb_mps=-sink_mps)
    return Guidance(Phase.LAND, Guide.BRAKE, reference, Demand.KEEP, dead_reckoned=True)


def _silent_ns(now_ns: int, vehicle: VehicleState) -> int:
    """For how long it has not been heard, in attitudes or in heartbeats."""
    return max(now_ns - vehicle.attitude.stamp_ns, now_ns - vehicle.heartbeat_ns)


def _ended(vehicle: VehicleState | None) -> Demand:
    return Demand.LAND if vehicle is not None and vehicle.may_fly else Demand.DISARM


def _rescued(drain: Callable[[], _T], otherwise: _T) -> _T:
    """What a part still has to tell after a step that failed."""
    try:
        return drain()
    except Exception:  # noqa: BLE001 - the failure itself is told already
        return otherwise
