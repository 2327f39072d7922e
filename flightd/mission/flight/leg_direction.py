"""Whether a leg leads along its aisle or from one aisle to another.  Pure."""

from __future__ import annotations

from flightd.core.types import Phase
from flightd.mission.plan.flight_plan import Stop

_INTERRUPTED = (Phase.HOLD, Phase.RELOCATE, Phase.ACQUIRE)
"""Where a leg that was interrupted goes on from."""


def leads_along_x(goal: Stop, from_m: tuple[float, float]) -> bool:
    """The way to the goal is along its aisle, not from one aisle to another."""
    x_m, y_m = from_m
    return abs(goal.x_m - x_m) >= abs(goal.y_m - y_m)


class LegDirection:
    """The direction of the leg that is flown, kept while it is interrupted; call `step` at each tick."""

    def __init__(self) -> None:
        self._along_x: bool | None = None

    def step(self, phase: Phase, goal: Stop, from_m: tuple[float, float]) -> bool | None:
        """Whether the leg leads along x; None where none is flown or goes on."""
        if phase is Phase.FOLLOW:
            self._along_x = leads_along_x(goal, from_m)
        elif phase not in _INTERRUPTED:
            self._along_x = None
        return self._along_x
