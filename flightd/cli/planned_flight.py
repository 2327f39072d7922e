"""A planned flight in lines for people, from the plan itself or from what a drone answers."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flightd.adapters.ground_link.messages.answers import Planned, PlannedPass
    from flightd.core.planned_flight import PlannedFlight, PlannedSweep


def planned_in_words(plan: PlannedFlight | Planned) -> list[str]:
    """The nodes, the flight's figures, what labels are too small, and how shelves are counted in
    passing."""
    batteries = "1 battery" if plan.batteries == 1 else f"{plan.batteries} batteries"
    nodes = "1 node" if len(plan.nodes) == 1 else f"{len(plan.nodes)} nodes"
    lost = f", the labels of {plan.unread.places} too small" if plan.unread else ""
    counted = f", {plan.places} places counted{lost}" if plan.places else ""
    figures = (
        f"{nodes}, {plan.way_m:.0f} m{counted}, about {plan.seconds / 60:.1f} min in the air, {batteries}"
    )
    unread = [] if plan.unread is None else [f"{plan.unread.what}; {plan.unread.remedy}"]
    return [" ".join(plan.nodes), figures, *unread, *(_sweep_in_words(each) for each in plan.sweeps)]


def _sweep_in_words(sweep: PlannedSweep | PlannedPass) -> str:
    return f"in passing, {sweep.text}" if sweep.swept else sweep.text
