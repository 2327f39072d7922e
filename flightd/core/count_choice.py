"""Which locations a flight counts: by their level on all of it, or shelf by shelf."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ShelfCount:
    """What is counted from `node` on one `side` of its aisle, "left" (-y) or "right" (+y; empty: on both),
    of the shelf `levels` there, from 1 at the floor (none: all)."""

    node: str
    side: str = ""
    levels: tuple[int, ...] = ()

    def takes(self, node: str, side: str, level: int) -> bool:
        """Whether a location with this node, side and level is of it."""
        here = node == self.node and self.side in {"", side}
        return here and (not self.levels or level in self.levels)


@dataclass(frozen=True, slots=True)
class CountChoice:
    """What hangs on these `levels` (none: all), at whichever node; or, where `shelves` are told, what is of
    one of these alone, and nothing at other nodes."""

    levels: tuple[int, ...] = ()
    shelves: tuple[ShelfCount, ...] | None = None

    @classmethod
    def of(cls, levels: tuple[int, ...], shelves: tuple[ShelfCount, ...] | None) -> CountChoice:
        """With `shelves`, whatever the levels are."""
        return cls(levels) if shelves is None else cls((), shelves)

    def at(self, node: str) -> CountChoice:
        """The same for the locations of one node."""
        if self.shelves is None:
            return self
        return CountChoice((), tuple(one for one in self.shelves if one.node == node))

    def takes(self, node: str, side: str, level: int) -> bool:
        """Whether a location with this node, side and level is counted."""
        if self.shelves is None:
            return not self.levels or level in self.levels
        return any(one.takes(node, side, level) for one in self.shelves)


ALL = CountChoice()
