"""What a flight over chosen nodes would be, and how the plan that stands is getting on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from flightd.core.count_choice import ALL, CountChoice, ShelfCount

MOST_NODES = 500
"""A plan over more nodes is refused: it is read and checked between two ticks."""


@dataclass(frozen=True, slots=True)
class PlannedFlight:
    """The `nodes` to visit, in the order in which they are flown, and the shelf `levels` that are counted at
    them (none: all).  `places` is how many locations that is; `way` are all nodes where it stops or
    turns, from pad to pad, `way_m` how long that is.
    `seconds` in the air need `batteries`, full ones but for the first, of which `charge` is left; a battery
    is taken to last `battery_s` in the air down to its reserve.  `sweeps` is what is flown past, empty where
    shelves are counted by stopping; `unread` is what of `places` has labels too small to read."""

    nodes: tuple[str, ...]
    levels: tuple[int, ...]
    way: tuple[str, ...]
    places: int
    way_m: float
    seconds: float
    batteries: int
    charge: float
    battery_s: float
    sweeps: tuple[PlannedSweep, ...] = ()
    unread: UnreadLabels | None = None


@dataclass(frozen=True, slots=True)
class UnreadLabels:
    """The labels of so many `places` are not surely read, or not at all, from as near as a stop looks from.

    Their modules are `px_per_module` wide in the picture from the aisle's line, at the worst place; they are
    read `within_m`.  `what` and `remedy` say so."""

    places: int
    px_per_module: float
    within_m: float
    what: str
    remedy: str


@dataclass(frozen=True, slots=True)
class PlannedSweep:
    """How `places` on these levels are counted in passing, in all the aisles where it is the same.

    Flown at `height_m`, `distance_m` from the shelf, at `speed_mps`, which `limit` keeps from being more;
    `limits_mps` is what each limit alone allows.  `exposure` is a part of the front camera's usual one,
    `views` how many whole views each place gets of the `fps` frames read in a second, `needed_fps` how many
    that speed needs.  Not `swept`: it is counted by stopping, and `stops_for` is why: `labels` too small in
    the picture, a place's `width` more than that, a `line` that is not open and clear both ways, too few
    `nodes`.  `text` says so in a line."""

    aisles: tuple[str, ...]
    levels: tuple[int, ...]
    places: int
    height_m: float
    distance_m: float
    speed_mps: float
    limit: str
    limits_mps: dict[str, float]
    exposure: float
    blur_modules: float
    px_per_module: float
    views: float
    fps: float
    needed_fps: float
    swept: bool
    stops_for: str
    text: str


@dataclass(frozen=True, slots=True)
class StandingPlan:
    """The plan of this flight: `id` of the order that it came with (empty: that of the configuration), its
    nodes and levels, which of them were `visited` and which it still wants to visit; `counts` if only what is
    of these is counted at its nodes."""

    id: str
    nodes: tuple[str, ...]
    levels: tuple[int, ...]
    visited: tuple[str, ...]
    remaining: tuple[str, ...]
    counts: tuple[ShelfCount, ...] | None = None


class Planner(Protocol):
    """What knows the map and the drone, and so what a flight would be."""

    @property
    def standing(self) -> StandingPlan:
        """The plan that is flown, or would be with the next start."""
        ...

    def planned(
        self, nodes: Sequence[str], choice: CountChoice = ALL, *, best_order: bool, waits: bool = False
    ) -> PlannedFlight:
        """What a flight over the nodes (none: those of the configuration) would be, counting what `choice`
        takes; changes nothing.  InputError where it cannot be flown."""
        ...
