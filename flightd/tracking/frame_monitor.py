"""Whether the pictures that arrive show anything: fresh ones, not the same again, neither black nor white."""

from __future__ import annotations

import math

from flightd.core.types import UNCHECKED, LineSet, PictureCheck

_DARK, _BRIGHT = 6.0, 249.0
_FLAT = 2.0
"""Mean grey levels, and spread of them, beyond which a picture shows nothing."""


class FrameMonitor:
    """Call `take` with each frame's lines in the order of exposure."""

    def __init__(self) -> None:
        self._last = UNCHECKED
        self._changed_ns = -math.inf
        self._repeats = 0
        self._shown_ns = -math.inf
        self._blank = False
        self.newest_ns = -math.inf

    def take(self, lines: LineSet) -> bool:
        """False when the picture is the one before once more: it says nothing of its time."""
        self.newest_ns = max(self.newest_ns, lines.stamp_ns)
        check = lines.picture
        self._blank = _is_blank(check)
        if not self._blank:
            self._shown_ns = lines.stamp_ns
        same = check != UNCHECKED and check == self._last
        self._last = check
        self._repeats = self._repeats + 1 if same else 0
        if not same:
            self._changed_ns = lines.stamp_ns
        return not same

    def frozen_s(self, now_ns: int) -> float:
        """Since when the same picture has been coming; 0 while they change."""
        return (now_ns - self._changed_ns) * 1e-9 if self._repeats else 0.0

    def blank_s(self, now_ns: int) -> float:
        """Since when nothing can be made out; 0 while something can, infinite if never."""
        return (now_ns - self._shown_ns) * 1e-9 if self._blank else 0.0

    def age_s(self, now_ns: int) -> float:
        """Age of the newest picture, infinite before the first."""
        return (now_ns - self.newest_ns) * 1e-9


def _is_blank(check: PictureCheck) -> bool:
    return not _DARK <= check.mean <= _BRIGHT or check.spread < _FLAT
