"""What is answered to whoever asks what a flight would be, or what is left of the present one."""

from __future__ import annotations

from collections import deque

import msgspec

from flightd.adapters.ground_link.messages.answers import (
    Code,
    PlanAnswer,
    Planned,
    PlannedPass,
    PlannedUnread,
)
from flightd.adapters.ground_link.messages.counts import Counts, shelf_counts
from flightd.adapters.ground_link.messages.requests import AskPlan, PlanFlight
from flightd.core.count_choice import CountChoice
from flightd.core.errors import InputError
from flightd.core.planned_flight import Planner
from flightd.core.types import Phase

_PLANS_PER_S = 5
"""Planning takes the tick's own time, while the drone stands; all clients together."""


def impossible(phase: Phase) -> str:
    """Why no plan is taken in a phase, in words."""
    if phase is Phase.PREFLIGHT:
        return "a plan is taken only by a drone that stands disarmed and was given no start"
    return f"a plan is taken only before the start, not in phase {phase}"


class PlanAnswers:
    """Asks the flight's `planner`."""

    def __init__(self, planner: Planner, session: str) -> None:
        self._planner = planner
        self._session = session
        self._lately: deque[int] = deque(maxlen=_PLANS_PER_S)

    def planned(self, request: PlanFlight, now_ns: int) -> Planned | tuple[Code, str]:
        """What the flight is, or why it is none."""
        if len(self._lately) == _PLANS_PER_S and now_ns - self._lately[0] < 10**9:
            return Code.BUSY, f"more than {_PLANS_PER_S} plans a second"
        self._lately.append(now_ns)
        try:
            plan = self._planner.planned(
                request.nodes,
                CountChoice.of(request.levels, shelf_counts(request.counts)),
                best_order=request.best_order,
                waits=request.waits,
            )
        except InputError as err:
            return Code.PLAN, str(err)
        return Planned(
            request=request.id,
            nodes=plan.nodes,
            levels=plan.levels,
            way=plan.way,
            places=plan.places,
            way_m=round(plan.way_m, 2),
            seconds=round(plan.seconds, 1),
            batteries=plan.batteries,
            charge=plan.charge,
            battery_s=round(plan.battery_s, 1),
            sweeps=tuple(msgspec.convert(each, PlannedPass, from_attributes=True) for each in plan.sweeps),
            unread=msgspec.convert(plan.unread, PlannedUnread | None, from_attributes=True),
            dry=request.dry,
        )

    def standing(self, request: AskPlan) -> PlanAnswer:
        """The plan as it stands."""
        plan = self._planner.standing
        return PlanAnswer(
            request=request.id,
            session=self._session,
            id=plan.id,
            nodes=plan.nodes,
            levels=plan.levels,
            visited=plan.visited,
            remaining=plan.remaining,
            counts=msgspec.convert(plan.counts, Counts, from_attributes=True),
        )
