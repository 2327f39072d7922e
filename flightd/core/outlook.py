"""What a mission expects and what troubles it, as people on the ground are told of it."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class HazardSeen:
    """A hazard that holds: what it is and what is done about it, in words, and since when."""

    text: str
    action: str
    since_ns: int


@dataclass(frozen=True, slots=True)
class Outlook:
    """`obstacles` is all that keeps the drone on the ground while it waits there, worst first; `way` the
    nodes that it flies over next, in order (not those far ahead).  `battery_left_s` is how long the charge
    above the reserve lasts in the air and `home_s` how long the way to the nearest charge pad takes; NaN: not
    known.  `plan` is the id of the order that the plan came with; empty: the configuration's.  At the node
    `waits_at` its way ends, and it holds until it is told where to fly on; empty: it flies home.  `lands_at`
    is the node of the pad on which it comes down at last."""

    hazards: tuple[HazardSeen, ...] = ()
    obstacles: tuple[str, ...] = ()
    way: tuple[str, ...] = ()
    battery_left_s: float = math.nan
    home_s: float = math.nan
    plan: str = ""
    waits_at: str = ""
    lands_at: str = ""


NO_OUTLOOK = Outlook()
"""Nothing is known of the mission."""
