"""Random warehouses, the same for the same seed, to fly where nobody tuned anything."""

from __future__ import annotations

import itertools
import random
import string

from flightd.site.layout import lay_out
from flightd.site.site import Aisle, LineColour, Pad, Side, Site

_COLOURS = (LineColour.YELLOW,) * 6 + (LineColour.WHITE, LineColour.WHITE, LineColour.RED, LineColour.BLUE)


def random_site(seed: int) -> Site:
    """2..5 aisles of 4..8 nodes at spacings of 1.2..2.2 m, joined at their first nodes, often at the
    last ones too and sometimes in the middle; line widths 50..100 mm, mostly yellow paint."""
    rng = random.Random(f"site {seed}")
    count = rng.randint(2, 5)
    size = rng.randint(4, 8)
    shared = sorted(
        {1, size if rng.random() < 0.8 else 1, rng.randint(2, size - 1) if rng.random() < 0.3 else 1}
    )
    crossing_x = _spacings(rng, size)
    pitch_m = round(rng.uniform(2.6, 4.0), 1)
    cross_half_m = round(rng.uniform(0.35, 0.8), 2)
    reach_m = round(min(pitch_m / 2 - 0.1, rng.uniform(1.0, 1.5)), 2)
    aisles = [
        Aisle(
            id=letter,
            x_m=0.0,
            y_m=round(i * pitch_m, 3),
            spacing_m=_between_crosses(rng, crossing_x, shared),
            cross_half_m=cross_half_m,
            overrun_m=round(rng.choice((0.3, 0.4, 0.6)), 2),
            shelves=rng.choice(((Side.LEFT, Side.RIGHT), (Side.LEFT,), (Side.RIGHT,))),
            shelf_distance_m=reach_m,
            shelf_height_m=round(rng.uniform(2.0, 5.0), 1),
        )
        for i, letter in enumerate(string.ascii_uppercase[:count])
    ]
    crosses = [
        (f"{a.id}{index}", f"{b.id}{index}") for a, b in itertools.pairwise(aisles) for index in shared
    ]
    return lay_out(
        f"random {seed}",
        aisles,
        crosses,
        [Pad("home", "A1", round(rng.uniform(0.4, 0.7), 2))],
        line_width_m=round(rng.uniform(0.05, 0.10), 3),
        line_colour=rng.choice(_COLOURS),
        ceiling_m=7.0,
    )


def _spacings(rng: random.Random, size: int) -> list[float]:
    return [round(rng.uniform(1.2, 2.2), 2) for _ in range(size - 1)]


def _between_crosses(rng: random.Random, pattern: list[float], shared: list[int]) -> tuple[float, ...]:
    """Own spacings between the shared nodes, the same total from one shared node to the next."""
    steps: list[float] = []
    stops = [*shared, len(pattern) + 1]
    for first, last in itertools.pairwise(stops):
        part = pattern[first - 1 : last - 1]
        for i in range(len(part) - 1):  # moves a node, its neighbours stay: sums hold
            shift_m = round(rng.uniform(-0.25, 0.25), 2)
            moved = (round(part[i] + shift_m, 2), round(part[i + 1] - shift_m, 2))
            if min(moved) >= 1.1 and max(moved) <= 2.3:
                part[i], part[i + 1] = moved
        steps += part
    return tuple(steps)
