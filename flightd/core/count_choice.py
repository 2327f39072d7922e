"""Which locations a flight counts: by their level on all of it, or shelf by shelf."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class ShelfCount:
    """What is counted from `node` on one `side` of its aisle, "left" (-y) or "right" (+y; empty: on both),
    of the shelf `levels` there, from 1 at the floor (none: all)."""

    node: str
    side: str = ""
    levels: tuple[int, ...] = ()

    def __str__(self) -> str:
        levels = f"on level {', '.join(map(str, self.levels))}" if self.levels else ""
        return " ".join(filter(None, (self.node, self.side, levels)))

    @property
    def alone(self) -> CountChoice:
        """The choice of this one."""
        return CountChoice((), (self,))

    def takes(self, side: str, level: int) -> bool:
        """Whether a location of its node with this side and level is of it."""
        return self.side in {"", side} and (not self.levels or level in self.levels)


@dataclass(frozen=True, slots=True)
class CountChoice:
    """What hangs on these `levels` (none: all), at whichever node; or, where `shelves` are told, what is of
    one of these alone, and nothing at other nodes."""

    levels: tuple[int, ...] = ()
    shelves: tuple[ShelfCount, ...] | None = None
    _at: dict[str, list[ShelfCount]] = field(init=False, repr=False, compare=False)
    """The shelves by their nodes: each location of a site is asked for."""

    def __post_init__(self) -> None:
        at: dict[str, list[ShelfCount]] = defaultdict(list)
        for one in self.shelves or ():
            at[one.node].append(one)
        object.__setattr__(self, "_at", dict(at))

    @classmethod
    def of(cls, levels: tuple[int, ...], shelves: tuple[ShelfCount, ...] | None) -> CountChoice:
        """With `shelves`, whatever the levels are."""
        return cls(levels) if shelves is None else cls((), shelves)

    def takes(self, node: str, side: str, level: int) -> bool:
        """Whether a location with this node, side and level is counted."""
        if self.shelves is None:
            return not self.levels or level in self.levels
        return any(one.takes(side, level) for one in self._at.get(node, ()))


ALL = CountChoice()
