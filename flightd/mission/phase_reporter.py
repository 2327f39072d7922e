"""Why the mission does what it does, and the event of each change of phase.  Pure."""

from __future__ import annotations

from flightd.core.refusal import Refusal
from flightd.core.types import EventLevel, Phase
from flightd.mission.event_log import EventLog
from flightd.mission.guidance import MissionInputs
from flightd.mission.machine import Cause, State
from flightd.mission.plan.itinerary import Itinerary
from flightd.mission.reasons import Happened, Paused, Plain, Reason, VehicleRefuses, in_words
from flightd.mission.scan.shelf_scan import ShelfScan
from flightd.mission.triggers import Trigger


class PhaseReporter:
    """Keeps what led to the phase in hand, and the `reason` that is given for it now."""

    def __init__(self, events: EventLog, route: Itinerary, scan: ShelfScan) -> None:
        self._events = events
        self._route = route
        self._scan = scan
        self._cause: Reason | None = None
        self._reason: Reason | None = None

    @property
    def reason(self) -> str:
        """Why it does what it does, in words; empty before the first tick."""
        return "" if self._reason is None else in_words(self._reason)

    def wait(self, reason: Reason) -> None:
        """It waits on the ground for this."""
        self._reason = reason

    def turn(self, trigger: Trigger) -> None:
        """The phase in hand goes on for another cause."""
        self._cause = Happened(trigger)

    def begin(
        self, s: MissionInputs, before: State, after: State, trigger: Trigger, cause: Cause, phase_s: float
    ) -> None:
        """A phase begins; the one before it lasted `phase_s`."""
        self._explain(s, before, after, trigger, cause)
        if trigger is Trigger.TIMED_OUT and before.phase is Phase.LAND:
            self._report_endless_landing(s.now_ns, after, phase_s)
        level = EventLevel.WARNING if _alarming(before, after, trigger) else EventLevel.INFO
        text = f"{before.phase.value} -> {after.phase.value}: {self.reason}"
        self._events.report(s.now_ns, level, "phase", text)

    def doubt(self, s: MissionInputs) -> None:
        """It looks for its position: where it may be."""
        places = ", ".join(f"{node} {share:.0%}" for node, share in s.rivals[:5])
        if places:
            self._events.report(s.now_ns, EventLevel.WARNING, "position", f"doubted, it may be {places}")

    def halt(self, *, paused: bool) -> None:
        """It stands still in the air; an operator wants that, too, if `paused`."""
        if self._cause is not None:
            held = paused and self._cause != Happened(Trigger.HOLD)
            self._reason = Paused(self._cause) if held else self._cause

    def land(self, refusal: Refusal | None) -> None:
        """It lands; `refusal` is what the vehicle says to being asked to disarm, None if nothing."""
        self._reason = self._cause
        if refusal and self._cause is not None:
            self._reason = VehicleRefuses(self._cause, refusal)

    def _explain(self, s: MissionInputs, before: State, after: State, trigger: Trigger, cause: Cause) -> None:
        """Set the reason for the phase that begins; of an end on the pad, why it turned home."""
        refused = s.vehicle is not None and trigger in {Trigger.TIMED_OUT, Trigger.START_EXPIRED}
        refusal = s.vehicle.refusal if s.vehicle is not None and refused else None
        if trigger is Trigger.NOT_COUNTED and (blind := self._scan.blind) is not None:
            self._cause = blind
            self._events.report(s.now_ns, EventLevel.ERROR, "not_counted", in_words(blind))
        elif cause is Cause.LANDED:
            self._cause = Plain.LANDED
        elif cause is Cause.TRIGGER:
            happened = Happened(trigger)
            self._cause = VehicleRefuses(happened, refusal) if refusal else happened
        elif after.over and before.on_pad:
            self._cause = self._route.why_home or self._cause
        self._reason = self._cause

    def _report_endless_landing(self, now_ns: int, after: State, phase_s: float) -> None:
        """Say what becomes of a landing that does not come to its end."""
        if after.over:
            text = "not disarmed after all: see that the drone stands, and disarm it by hand"
        else:
            text = f"not down after {phase_s:.0f} s: the autopilot lands by itself"
        self._events.report(now_ns, EventLevel.ERROR, "landing", text)


def _alarming(before: State, after: State, trigger: Trigger) -> bool:
    """Whether a change of phase is none of those that were planned."""
    if after.phase is Phase.LAND:
        return not after.on_pad
    if trigger is Trigger.START_EXPIRED:
        return True
    if after.phase in {Phase.ABORTED, Phase.PILOT}:  # a landing has been reported already
        return before.phase is not Phase.LAND or (before.stopped and trigger is not Trigger.DISARMED)
    return after.halted and trigger is not Trigger.AWAITS_MORE
