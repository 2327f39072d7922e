"""The roll and pitch that are told of a level drone whose floor nobody sees.  Pure."""

from __future__ import annotations

import math

from flightd.tracking.carried_lean import LEVEL, Lean

_MOST_RAD = math.radians(3.0)
"""No leap has a drone lean by more that sees nothing."""


class ToldLevel:
    """What was told while it stood; that error wanders, and fades within `fade_s`.  By what the picture makes
    of it later nobody flies level.  Of a leap, a share: while it is still known what the attitude before
    erred by, the new one errs by all of it; once that has faded, each of the two is as likely right."""

    def __init__(self, fade_s: float) -> None:
        self._fade_s = fade_s
        self._stood_ns, self._stood = 0, LEVEL
        self._leapt_ns, self._leapt = 0, LEVEL

    @property
    def is_known(self) -> bool:
        return self._stood_ns > 0

    def stood(self, now_ns: int, told: tuple[float, float] | None) -> None:
        """It stands; None: as level as was told last."""
        self._stood_ns, self._leapt = now_ns, LEVEL
        if told is not None:
            self._stood = Lean(*told)

    def leaps(self, stamp_ns: int, leap: Lean) -> None:
        """In the air the told roll and pitch leap by so much."""
        before = self._leapt.times(self._left(stamp_ns, self._leapt_ns))
        share = 1.0 / (2.0 - self._left(stamp_ns, self._stood_ns) ** 2)
        self._leapt_ns, self._leapt = stamp_ns, before.plus(leap.times(share))

    def at(self, now_ns: int) -> Lean:
        """Roll and pitch, rad."""
        return self._stood.times(self._left(now_ns, self._stood_ns)).plus(self.by_leaps(now_ns))

    def by_leaps(self, now_ns: int) -> Lean:
        """What of it leaps have made."""
        return self._leapt.times(self._left(now_ns, self._leapt_ns)).within(_MOST_RAD)

    def _left(self, now_ns: int, since_ns: int) -> float:
        return math.exp(-max(now_ns - since_ns, 0) * 1e-9 / self._fade_s)
