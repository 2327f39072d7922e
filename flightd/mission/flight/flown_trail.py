"""The way that was flown last, and the way back along it.  What the drone flew through while it saw the floor
is free, as high as it was then, wherever on the map it is.  Pure."""

from __future__ import annotations

import math

_STEP_M = 0.2
"""Points are so far apart; who comes as near to one again has flown a loop, which is left out."""
_KEPT_M = 1.6
"""No further back: others of a fleet may follow by then."""


class FlownTrail:
    """Call `step` with the place over the floor (m, any axes) at each tick."""

    def __init__(self) -> None:
        self._points: list[tuple[float, float]] = []

    def clear(self) -> None:
        """What was flown says nothing any more."""
        self._points = []

    def step(self, x_m: float, y_m: float) -> None:
        """The drone is here."""
        close = (i for i, point in enumerate(self._points) if math.dist(point, (x_m, y_m)) < _STEP_M)
        near = next(close, None)
        if near is not None:
            del self._points[near + 1 :]
            return
        self._points.append((x_m, y_m))
        del self._points[: -round(_KEPT_M / _STEP_M)]

    def back(self, from_m: tuple[float, float], by_m: float) -> tuple[float, float] | None:
        """The place about `by_m` before this one on the way here; None where none is known: nobody has flown
        straight to one much further away.  What lay after it is forgotten."""
        while self._points:
            point = self._points[-1]
            apart_m = math.dist(point, from_m)
            if apart_m > by_m + 2.0 * _STEP_M:
                break
            if apart_m >= by_m:
                return point
            self._points.pop()
        self.clear()
        return None
