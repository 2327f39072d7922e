"""A warehouse of equal aisles, joined at both ends, with the pad at A1: what a site file begins with."""

from __future__ import annotations

import itertools
import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

_LETTERS: Final = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"


@dataclass(frozen=True, slots=True)
class RackRow:
    """Racks along every aisle: width of a bay, heights of the labels, places in each bay on each level."""

    bay_width_m: float
    levels_m: Sequence[float]
    positions: int


@dataclass(frozen=True, slots=True)
class AisleGrid:
    """At most 26 `aisles`, `pitch_m` from each other, of `nodes` each; `spacing_m` between the nodes
    repeats as often as it must.  `racks` None: no locations."""

    name: str
    aisles: int
    nodes: int
    spacing_m: Sequence[float]
    pitch_m: float
    line_width_m: float
    line_colour: str
    shelf_distance_m: float
    shelf_height_m: float
    ceiling_m: float
    racks: RackRow | None = None

    def toml(self) -> str:
        """The site file; whether the measures make sense is for its reader to say."""
        letters = _LETTERS[: self.aisles]
        crosses = [
            f'[[cross]]\nnodes = ["{a}{end}", "{b}{end}"]'
            for a, b in itertools.pairwise(letters)
            for end in (1, self.nodes)
        ]
        aisles = [self._aisle(i, letter) for i, letter in enumerate(letters)]
        return "\n\n".join(
            [self._head(), *aisles, *crosses, *self._racks(), '[[pad]]\nid = "home"\nnode = "A1"']
        )

    def _head(self) -> str:
        return (
            f"[site]\nname = {json.dumps(self.name)}\nline_width_m = {self.line_width_m}\n"
            f"line_colour = {json.dumps(self.line_colour)}\nceiling_m = {self.ceiling_m}"
        )

    def _aisle(self, number: int, letter: str) -> str:
        steps = [repr(self.spacing_m[i % len(self.spacing_m)]) for i in range(self.nodes - 1)]
        return (
            f'[[aisle]]\nid = "{letter}"\nx_m = 0.0\ny_m = {round(number * self.pitch_m, 6)}\n'
            f"spacing_m = [{', '.join(steps)}]\nshelf_distance_m = {self.shelf_distance_m}\n"
            f"shelf_height_m = {self.shelf_height_m}"
        )

    def _racks(self) -> list[str]:
        if self.racks is None:
            return []
        levels = ", ".join(repr(level) for level in self.racks.levels_m)
        return [
            f"[[rack]]\nbay_width_m = {self.racks.bay_width_m}\nlevels_m = [{levels}]\n"
            f"positions = {self.racks.positions}"
        ]
