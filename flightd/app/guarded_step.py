"""The pilot's step, and what goes out where that fails at catching its own errors."""

from __future__ import annotations

from flightd.core.tick import StepFailure, TickInput, TickOutput
from flightd.core.types import AttitudeSetpoint, Demand, Event, EventLevel, Phase
from flightd.mission.safety.last_resort import Fallback
from flightd.mission.triggers import Trigger
from flightd.pilot import Pilot

_BEFORE = TickOutput(None, Demand.STANDBY, Phase.PREFLIGHT, "", "", 0, 0, None, None)
_WHY = Trigger.STEP_FAILED.value


class GuardedStep:
    """Steps a pilot until an error escapes it; from then on the vehicle is landed by its own word, and where
    not even that can be asked for, simply landed."""

    def __init__(self, pilot: Pilot) -> None:
        self._pilot = pilot
        self._resort = pilot.another_resort()
        self.output = _BEFORE
        """What the newest step answered."""
        self.failure: StepFailure | None = None
        """What the newest step raised, None where it raised nothing."""
        self.escaped = False
        """The pilot is not stepped any more."""

    def step(self, tick: TickInput) -> TickOutput:
        """Raises nothing."""
        self.failure = None
        self._resort.seen = tick.vehicle or self._resort.seen
        if not self.escaped:
            try:
                self.output, self.failure = self._pilot.step(tick), self._pilot.failure
            except Exception as err:  # noqa: BLE001 - whatever it is, the drone has to come down
                self.escaped = True
                self.failure = StepFailure.of(tick.now_ns, err)
            else:
                return self.output
        self.output = self._without_pilot(tick)
        return self.output

    def _without_pilot(self, tick: TickInput) -> TickOutput:
        now_ns, last = tick.now_ns, self.output
        try:
            answer = self._resort.step(now_ns, tick.vehicle, last.phase)
        except Exception:  # noqa: BLE001 - told already, or nothing more to tell
            answer = Fallback(Phase.LAND, Demand.LAND, AttitudeSetpoint(now_ns))
        events: list[Event] = []
        if self.failure is not None:
            events.append(Event(now_ns, EventLevel.ERROR, "step_failed", self.failure.error))
        if answer.phase is not last.phase:
            text = f"{last.phase} -> {answer.phase}: {_WHY}"
            events.append(Event(now_ns, EventLevel.WARNING, "phase", text))
        return answer.onto(last, tuple(events))
