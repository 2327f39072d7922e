"""What a flight is judged by: what was planned, what the daemon logged, and what was true."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

from flightd.core.types import AttitudeSetpoint, Event, EventLevel, Phase, Status
from flightd.mission.plan.flight_plan import FlightPlan
from flightd.sim.judge.motion import TrueMotion
from flightd.sim.plant.kinematics import ON_FLOOR_M, ArmedChange, Kinematics
from flightd.site.site import Site


def phase_begins(events: Iterable[Event], phase: Phase) -> list[Event]:
    """The events by which a phase began: `before -> phase: why`."""
    return [event for event in events if event.name == "phase" and f" -> {phase.value}: " in event.text]


@dataclass(frozen=True)
class FlightEvidence:
    """`site` as it really is; `statuses`, `events` and `setpoints` (those that went out; None: not known) are
    the daemon's, `truth` and `armed` the simulator's; all in time order.  `armed` is None where the vehicle
    does not tell.  `piloted_ns`: from when on there was a pilot who could take over, infinite where there was
    none; a hand-over before is the autopilot's failsafe, and still judged.  `lost`: messages that the flight
    log did not take."""

    site: Site
    plan: FlightPlan
    statuses: Sequence[Status]
    events: Sequence[Event]
    truth: Sequence[Kinematics]
    setpoints: Sequence[AttitudeSetpoint] | None = None
    armed: Sequence[ArmedChange] | None = None
    piloted_ns: float = -math.inf
    lost: int = 0

    @cached_property
    def handed_over_ns(self) -> float:
        """When the pilot took over, infinite if he did not: what comes then is his."""
        begins = (status.stamp_ns for status in self.statuses if status.phase is Phase.PILOT)
        return max(next(begins, math.inf), self.piloted_ns)

    @property
    def handed_over(self) -> bool:
        return self.handed_over_ns < math.inf

    @cached_property
    def motion(self) -> TrueMotion:
        """The motion for which the daemon answers, until it handed over."""
        return TrueMotion.of([t for t in self.truth if t.stamp_ns < self.handed_over_ns])

    @cached_property
    def in_air(self) -> TrueMotion:
        """The part of it off the floor."""
        return self.motion.chosen(self.motion.flying)

    @property
    def begun_s(self) -> float:
        """When it first left the floor; infinite if it never did."""
        return float(self.in_air.stamp_s[0]) if len(self.in_air) else math.inf

    def armed_s(self) -> list[tuple[float, float]]:
        """From when to when, s of the clock, it was armed; infinite where it stays so.  Empty where the
        vehicle does not tell."""
        changes = self.armed or ()
        ends_s = [*(change.stamp_ns * 1e-9 for change in changes[1:]), math.inf]
        return [
            (change.stamp_ns * 1e-9, end_s)
            for change, end_s in zip(changes, ends_s, strict=False)
            if change.armed
        ]

    @property
    def landed(self) -> Kinematics | None:
        """Where it stands at the end, None where it does not, or never flew."""
        down = len(self.in_air) and self.truth[-1].height_m <= ON_FLOOR_M
        return self.truth[-1] if down else None

    @property
    def landings(self) -> list[Event]:
        """When the daemon began to land, in time order: warnings where that was not the plan's."""
        again = f"{Phase.LAND.value} -> "
        return [event for event in phase_begins(self.events, Phase.LAND) if not event.text.startswith(again)]

    @property
    def landings_in_need(self) -> list[Event]:
        """Those that were not the plan's, for whatever came."""
        return [event for event in self.landings if event.level is not EventLevel.INFO]

    def truth_at(self, stamp_ns: int) -> Kinematics | None:
        """The first sample not before `stamp_ns`, or the last."""
        index = bisect_left(self.truth, stamp_ns, key=lambda t: t.stamp_ns)
        return self.truth[min(index, len(self.truth) - 1)] if self.truth else None

    def phase_at(self, stamp_ns: int) -> Phase:
        """The phase that the daemon said to be in."""
        index = bisect_left(self.statuses, stamp_ns, key=lambda status: status.stamp_ns) - 1
        return self.statuses[index].phase if index >= 0 else Phase.PREFLIGHT
