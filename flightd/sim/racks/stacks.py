"""Goods that fill their place in part: stacks of any width and height beside each other, some set back from
the rack's face, some standing out over it, some leaning."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flightd.sim.racks.cartons import CartonStack
from flightd.sim.racks.rack_layout import Opening
from flightd.site.rack_depth import RACK_DEPTH_M

PALLET_M = 0.10
BARE_M = 0.35
"""Goods that are no higher stand on none."""
_LEAST_WIDTH_M = 0.12
_LEAST_HEIGHT_M = 0.06
_WIDTHS, _HEIGHTS = (0.2, 0.96), (0.15, 0.94)
"""Parts of the opening that all stacks together, and each of them, take."""
_SET_BACK, _STANDING_OUT = 0.25, 0.15
"""Shares of the places whose stacks stand deep in the rack, and of those where one stands out."""
_SET_BACK_M, _STANDING_OUT_M = (0.05, 0.30), (0.03, 0.12)
_LEANING, _LEAN_M = 0.15, (0.02, 0.06)


@dataclass(frozen=True, slots=True)
class Goods:
    """What stands in a place: a front of this size whose middle is `right_m` of the opening's, `recess_m`
    behind the rack's face (before it where negative).  `covered` hangs a sheet before it, `dark` is dark and
    matte all over; `looks` seeds everything else.  `depth_m` is how deep it is, None up to the rack's back;
    its top is `lean_m` to the right of its foot.  `cartons` are a stack of one kind, None for anything else.
    `beside` are the other stacks of the place."""

    width_m: float
    height_m: float
    right_m: float
    recess_m: float
    covered: bool
    looks: int
    dark: bool = False
    depth_m: float | None = None
    lean_m: float = 0.0
    cartons: CartonStack | None = None
    beside: tuple[Goods, ...] = ()

    @property
    def stacks(self) -> tuple[Goods, ...]:
        """Everything that stands in the place."""
        return (self, *self.beside)

    @property
    def filled_m(self) -> float:
        """The height of its front, less what is missing of its highest row."""
        if self.cartons is None:
            return self.height_m
        return self.height_m - self.load_m * (1.0 - self.cartons.share)

    @property
    def load_m(self) -> float:
        """The height of what stands on its pallet; low goods have none."""
        return self.height_m - (PALLET_M if self.height_m > BARE_M else 0.0)

    def share_of(self, opening: Opening) -> float:
        """The part of the opening's front, 0..1, that goods stand in."""
        filled = sum(stack.width_m * stack.filled_m for stack in self.stacks)
        return filled / (opening.width_m * opening.level.height_m)


def in_stacks(whole: Goods, opening: Opening, rng: np.random.Generator) -> Goods:
    """The same goods as one to three stacks, the widest first: labels hang on it."""
    room_m = opening.width_m
    all_m = max(float(rng.uniform(*_WIDTHS)) * room_m, min(_LEAST_WIDTH_M, room_m))
    count = min(int(rng.choice((1, 1, 2, 2, 3))), max(int(all_m / _LEAST_WIDTH_M), 1))
    least_m = min(_LEAST_WIDTH_M, all_m / count)
    widths_m = least_m + _parts(count, rng) * (all_m - count * least_m)
    gaps_m = _parts(count + 1, rng) * (room_m - all_m)
    deep, out, leaning = (float(draw) for draw in rng.random(3))
    stacks = []
    left_m = -room_m / 2
    for number in range(count):
        left_m += float(gaps_m[number])
        width_m = float(widths_m[number])
        height_m = max(float(rng.uniform(*_HEIGHTS)) * opening.level.height_m, _LEAST_HEIGHT_M)
        recess_m = float(rng.uniform(*_SET_BACK_M)) if deep < _SET_BACK else float(rng.uniform(0.0, 0.05))
        if number == 0 and out < _STANDING_OUT:
            recess_m = -float(rng.uniform(*_STANDING_OUT_M))
        beside_m = min(float(gaps_m[number]), float(gaps_m[number + 1]), _LEAN_M[1])
        leans = number == 0 and leaning < _LEANING and beside_m > _LEAN_M[0]
        lean_m = float(rng.choice((-1.0, 1.0)) * rng.uniform(_LEAN_M[0], beside_m)) if leans else 0.0
        stacks.append(
            replace(
                whole,
                width_m=width_m,
                height_m=min(height_m, opening.level.height_m),
                right_m=left_m + width_m / 2,
                recess_m=recess_m,
                looks=whole.looks + number,
                depth_m=float(rng.uniform(0.3, 0.85)) * (RACK_DEPTH_M - max(recess_m, 0.0)),
                lean_m=lean_m,
            )
        )
        left_m += width_m
    stacks.sort(key=lambda stack: -stack.width_m)
    return replace(stacks[0], beside=tuple(stacks[1:]))


def _parts(count: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """So many random parts of one."""
    parts = rng.uniform(0.2, 1.0, count)
    return np.asarray(parts / parts.sum())
