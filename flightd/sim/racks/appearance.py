"""What stands in the racks and how the front camera's picture comes out: one frozen set of shares."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from flightd.sim.racks.stock import StockShares


@dataclass(frozen=True, slots=True)
class RackAppearance:
    """`shares` of the places; `in_part` of those with goods are filled only in part, in stacks, and of the
    others `cartons` hold cartons of one kind, most of them regularly stacked; `seed` of the goods, the
    flight's own when None; `location_labels` hangs a small label with each location's code on the beam below
    it.  `noise` is the standard deviation in grey levels at mid grey, `soft_px` the sigma of the lens blur,
    `exposure` scales the brightness, `flicker` is the share of it that beats with the mains; `light` is a
    factor on it by rack front ("A left") or by a level of one ("A left 2")."""

    shares: StockShares = field(default_factory=StockShares)
    seed: int | None = None
    location_labels: bool = True
    noise: float = 2.0
    soft_px: float = 0.5
    vignetting: float = 0.2
    exposure: float = 1.0
    flicker: float = 0.01
    in_part: float = 0.0
    cartons: float = 0.0
    motion_blur: bool = True
    light: Mapping[str, float] = field(default_factory=dict)
