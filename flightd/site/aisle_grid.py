"""A warehouse of equal aisles, joined at both ends, with the pad at A1: what a site file begins with."""

from __future__ import annotations

import itertools
import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

_LETTERS: Final = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
_OVER_SHELVES_M: Final = 1.5
"""Of a ceiling that nobody gave: room for the drone above what it counts."""


def assumed_ceiling_m(shelf_height_m: float, levels_m: Sequence[float]) -> float:
    """A ceiling over racks for which none was given: to be measured before anything flies there."""
    return round(max(shelf_height_m, *levels_m) + _OVER_SHELVES_M, 2)


@dataclass(frozen=True, slots=True)
class RackRow:
    """Racks along every aisle, on the sides that have shelves: width of a bay, heights of the labels, places
    in each bay on each level; how far below its label goods stand, and the pattern of location codes (None:
    as the site file's reader has it)."""

    bay_width_m: float
    levels_m: Sequence[float]
    positions: int
    deck_below_label_m: float | None = None
    pattern: str | None = None


@dataclass(frozen=True, slots=True)
class AisleGrid:
    """At most 26 `aisles`, `pitch_m` from each other, of `nodes` each; `spacing_m` between the nodes
    repeats as often as it must; `shelves` are the sides that have them.  `racks` None: no locations."""

    name: str
    aisles: int
    nodes: int
    spacing_m: Sequence[float]
    pitch_m: float
    line_width_m: float
    line_colour: str
    cross_half_m: float
    overrun_m: float
    shelves: Sequence[str]
    shelf_distance_m: float
    shelf_height_m: float
    ceiling_m: float | None
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
        head = (
            f"[site]\nname = {json.dumps(self.name)}\nline_width_m = {self.line_width_m}\n"
            f"line_colour = {json.dumps(self.line_colour)}"
        )
        return head if self.ceiling_m is None else f"{head}\nceiling_m = {self.ceiling_m}"

    def _aisle(self, number: int, letter: str) -> str:
        steps = [repr(self.spacing_m[i % len(self.spacing_m)]) for i in range(self.nodes - 1)]
        return (
            f'[[aisle]]\nid = "{letter}"\nx_m = 0.0\ny_m = {round(number * self.pitch_m, 6)}\n'
            f"spacing_m = [{', '.join(steps)}]\ncross_half_m = {self.cross_half_m}\n"
            f"overrun_m = {self.overrun_m}\nshelves = {json.dumps(self.shelves)}\n"
            f"shelf_distance_m = {self.shelf_distance_m}\n"
            f"shelf_height_m = {self.shelf_height_m}"
        )

    def _racks(self) -> list[str]:
        racks = self.racks
        if racks is None:
            return []
        levels = ", ".join(repr(level) for level in racks.levels_m)
        lines = [
            "[[rack]]",
            f"sides = {json.dumps(self.shelves)}",
            f"bay_width_m = {racks.bay_width_m}",
            f"levels_m = [{levels}]",
            f"positions = {racks.positions}",
        ]
        if racks.deck_below_label_m is not None:
            lines.append(f"deck_below_label_m = {racks.deck_below_label_m}")
        if racks.pattern is not None:
            lines.append(f"pattern = {json.dumps(racks.pattern)}")
        return ["\n".join(lines)]
