"""Heights that leap: an echo that came by a longer way, or goods that the drone flies over."""

from __future__ import annotations

_LEAP_M, _LEAP_MPS = 0.25, 3.0
"""A height that is off the last one by more, and by more than a fast climb makes, has leapt."""
_SAME_M, _SAME_SHARE = 0.15, 0.1
"""Two readings that leapt agree when they differ by less than the greater of both."""
_FORGOTTEN_NS = 500_000_000


class LeapingHeights:
    """Call `believes` with each height that a range finder tells.

    One that leaps is believed once the next one agrees with it: a single echo by racks or goods is nobody's
    height, and what climbs, lands or finds a hazard by it should not wait to see."""

    def __init__(self) -> None:
        self._believed: tuple[float, int] | None = None
        self._leapt: tuple[float, int] | None = None

    def believes(self, height_m: float, stamp_ns: int) -> bool:
        """Whether the height, m, that was measured then is to be taken."""
        last, leapt = self._believed, self._leapt
        if last is None or stamp_ns - last[1] > _FORGOTTEN_NS:
            is_believed = True
        else:
            bound_m = _LEAP_M + _LEAP_MPS * max(stamp_ns - last[1], 0) * 1e-9
            is_believed = abs(height_m - last[0]) <= bound_m or (
                leapt is not None
                and abs(height_m - leapt[0]) <= max(_SAME_M, _SAME_SHARE * max(height_m, leapt[0]))
            )
        if is_believed:
            self._believed, self._leapt = (height_m, stamp_ns), None
        else:
            self._leapt = height_m, stamp_ns
        return is_believed
