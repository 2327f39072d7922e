"""A planned flight in lines for people, from the plan itself or from what a drone answers."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flightd.adapters.ground_link.messages.answers import Planned
    from flightd.core.planned_flight import PlannedFlight


def planned_in_words(plan: PlannedFlight | Planned) -> list[str]:
    """The nodes, the flight's figures, and how shelves are counted in passing."""
    batteries = "1 battery" if plan.batteries == 1 else f"{plan.batteries} batteries"
    counted = f", {plan.places} places counted" if plan.places else ""
    figures = (
        f"{len(plan.nodes)} nodes, {plan.way_m:.0f} m{counted}, about {plan.seconds / 60:.1f} min in the air,"
        f" {batteries}"
    )
    return [" ".join(plan.nodes), figures, *(f"in passing, {each.text}" for each in plan.sweeps)]
