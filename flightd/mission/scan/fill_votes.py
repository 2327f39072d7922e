"""What several pictures say together of how full one location is.

Pictures from other places show other sides of the goods and other parts of what is behind them.  Where one
was taken for a front, they do not agree, and nothing is told.
"""

from __future__ import annotations

from statistics import median
from typing import Final

from flightd.core.inventory import CaseGrid, LocationState, PlaceFill

_SAME: Final = 0.1
_SAME_LEAN_M: Final = 0.01
_LEAST_AGREEING: Final = 0.7
"""Part of the pictures whose shares, or leans, must be so near to that in the middle."""
_LEAST_KNOWN: Final = 0.6
"""Part of the pictures that must tell a share."""
_LEAST_CASES: Final = 2
"""Pictures that must tell the same cases."""
_NOTHING: Final = 0.03
"""A share that goods, however few, do not stay below."""


class FillVotes:
    """The shares that pictures of one location tell."""

    def __init__(self) -> None:
        self._fills: list[PlaceFill] = []

    def add(self, fill: PlaceFill | None) -> None:
        """Take in one picture, None for one that does not show the opening."""
        if fill is not None:
            self._fills.append(fill)

    @property
    def sees_goods(self) -> bool:
        """Whether most of the pictures that tell a share show goods anywhere in the opening."""
        shares = [fill.share for fill in self._fills if fill.share is not None]
        return bool(shares) and median(shares) >= _NOTHING

    @property
    def cases(self) -> CaseGrid | None:
        """The cases that pictures tell, where several do and none tells others."""
        told = [fill.cases for fill in self._fills if fill.cases is not None]
        return told[0] if len(told) >= _LEAST_CASES and len(set(told)) == 1 else None

    def together(self, state: LocationState) -> PlaceFill | None:
        """What holds of a location of this state, None without any picture of its opening.  What contradicts
        the state is unknown: the state stands."""
        if not self._fills:
            return None
        if state is LocationState.OCCLUDED:
            return PlaceFill(None)
        shares = [fill.share for fill in self._fills if fill.share is not None]
        if state is LocationState.EMPTY:
            return PlaceFill(None) if shares and median(shares) > _SAME else PlaceFill(0.0)
        cases = self.cases
        if len(shares) < _LEAST_KNOWN * len(self._fills):
            return PlaceFill(None, cases=cases)
        share = median(shares)
        agreeing = sum(abs(other - share) <= _SAME for other in shares)
        if share < _NOTHING or agreeing < _LEAST_AGREEING * len(shares):
            return PlaceFill(None, cases=cases)
        overhangs = [fill.overhang_m for fill in self._fills if fill.overhang_m is not None]
        overhang_m = round(median(overhangs), 3) if len(overhangs) > _LEAST_KNOWN * len(shares) else None
        return PlaceFill(round(share, 3), overhang_m, self._lean_m(len(shares)), cases)

    def _lean_m(self, telling: int) -> float | None:
        """How much the goods lean, of so many pictures that tell a share."""
        leans = [fill.lean_m for fill in self._fills if fill.lean_m is not None]
        if len(leans) < _LEAST_KNOWN * telling:
            return None
        lean_m = median(leans)
        agreeing = sum(abs(other - lean_m) <= _SAME_LEAN_M for other in leans)
        return round(lean_m, 3) if agreeing >= _LEAST_AGREEING * len(leans) else None
