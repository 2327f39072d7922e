"""One control tick: what the pilot is given and what it answers, all that a replay needs of a flight."""

from __future__ import annotations

import traceback
from dataclasses import dataclass, field

from flightd.core.refusal import Refusal
from flightd.core.scanning import CodeSet, CountedPlace, Finding, Settled
from flightd.core.shared_pose import SharedPose
from flightd.core.tracks import TrackSet
from flightd.core.types import (
    HEALTHY,
    Attitude,
    AttitudeSetpoint,
    Command,
    Demand,
    Event,
    GridPose,
    Health,
    LineSet,
    Phase,
    VehicleState,
)

TICK_S = 0.02
"""Longest period of the control tick; fresh lines shorten it."""
CLOSEST_TICKS_S = 0.005
"""Between two ticks: several detectors that answer together cost one tick, not one each."""
_SHOWN_CHARS = 160


@dataclass(frozen=True, slots=True)
class TickInput:
    """What arrived since the last tick, oldest first.  `vehicle` is the newest state, None until there
    is one; `ground_silent_s` the time since an attending ground station was heard, 0 if none attends;
    `counted` are the locations that an earlier flight of the same count has booked.  `unfit` is what the
    check of this computer before the flight found against it; `aisle_closed` what the interlock of
    the aisle says, where one is demanded."""

    now_ns: int
    lines: tuple[LineSet, ...] = ()
    vehicle: VehicleState | None = None
    attitudes: tuple[Attitude, ...] = ()
    commands: tuple[Command, ...] = ()
    ground_silent_s: float = 0.0
    codes: tuple[CodeSet, ...] = ()
    counted: tuple[CountedPlace, ...] = ()
    health: Health = HEALTHY
    unfit: Refusal | None = None
    aisle_closed: bool = True


@dataclass(frozen=True, slots=True)
class TickOutput:
    """What goes out.  `setpoint` is None when nothing may be sent (hands off, or not flying).

    `visited` and `planned` count visits: a node to which the route comes twice counts twice.  `findings` are
    pending until a later `settled` names their locations."""

    setpoint: AttitudeSetpoint | None
    demand: Demand
    phase: Phase
    reason: str
    goal: str
    visited: int
    planned: int
    pose: GridPose | None
    tracks: TrackSet | None
    events: tuple[Event, ...] = field(default=())
    findings: tuple[Finding, ...] = ()
    settled: tuple[Settled, ...] = ()
    shared: SharedPose | None = None
    """What the vehicle's own estimator may be told of the motion, once for each frame."""


@dataclass(frozen=True, slots=True)
class StepFailure:
    """What a tick raised: one line for people, and the whole traceback for the log."""

    stamp_ns: int
    error: str
    traceback: str

    @classmethod
    def of(cls, now_ns: int, err: Exception, part: str = "") -> StepFailure:
        """What `part` of the tick raised (empty: the pilot's step)."""
        words = (part, type(err).__name__, str(err).replace("\n", " "))
        line = ": ".join(word for word in words if word)
        return cls(now_ns, line[:_SHOWN_CHARS], "".join(traceback.format_exception(err)))
