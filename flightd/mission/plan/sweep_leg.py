"""One flight past a shelf without stopping: along an aisle's line, at one height, nose to the shelf."""

from __future__ import annotations

from dataclasses import dataclass

from flightd.site.site import Side


@dataclass(frozen=True, slots=True)
class SweepLeg:
    """`nodes` are flown over in their order, the drone stands over the first; `locations` are counted on the
    way, all on `levels` of one side.  `exposure` is a part of the front camera's usual one; `last`: what was
    not decided on this leg and those before it is visited next."""

    aisle: str
    side: Side
    levels: tuple[int, ...]
    nodes: tuple[str, ...]
    locations: tuple[str, ...]
    height_m: float
    yaw_rad: float
    speed_mps: float
    exposure: float = 1.0
    last: bool = False

    @property
    def end(self) -> str:
        """The node at which it stops."""
        return self.nodes[-1]
