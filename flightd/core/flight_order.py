"""What one flight is to do, which its configuration does not say of every flight."""

from __future__ import annotations

from dataclasses import dataclass

from flightd.core.count_choice import ShelfCount


@dataclass(frozen=True, slots=True)
class FlightOrder:
    """The `nodes` to visit, as listed or (`best_order`) in the quickest order; none: every node, aisle by
    aisle.  The drone stands on `pad` at first (None: the home pad), heading `start_yaw_rad`, clockwise from
    the aisles.  `autostart`: it does not wait for the start command."""

    nodes: tuple[str, ...] = ()
    best_order: bool = False
    pad: str | None = None
    start_yaw_rad: float = 0.0
    autostart: bool = False


@dataclass(frozen=True, slots=True)
class ChosenPlan:
    """What somebody chose in the order's place before the start, by the command `id`: these `nodes`, counted
    on these `levels` (none: all), or only what is of `counts`.  No nodes: as ordered again."""

    id: str
    nodes: tuple[str, ...] = ()
    levels: tuple[int, ...] = ()
    counts: tuple[ShelfCount, ...] | None = None
