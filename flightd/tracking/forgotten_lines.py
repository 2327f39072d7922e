"""Which of the lines and features held are dropped, and when."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from typing import Final

from flightd.tracking.held_lines import HeldLine

_FEATURES: Final = 6
"""So many features are held across an axis, those seen last, since several detectors take turns."""
_LINES: Final = 16
"""And so many lines, of both axes."""
FEATURE_NS: Final = 500_000_000
"""A feature is not held for longer unseen."""


def forgotten_features(held: Sequence[HeldLine], refused: Collection[int | None], stamp_ns: int) -> set[int]:
    """The places in `held` of features that were not seen for long by then, turned out to be none (the
    `refused`), or are too many."""
    old = set[int]()
    for axis in range(2):
        lately = [line for line, one in enumerate(held) if one.feature is not None and one.axis == axis]
        lately.sort(key=lambda line: -held[line].seen_ns)
        old |= set(lately[_FEATURES:])
        old |= {line for line in lately if stamp_ns - held[line].seen_ns > FEATURE_NS}
        old |= {line for line in lately if held[line].feature in refused}
    return old


def forgotten_lines(
    held: Sequence[HeldLine],
    held_on: Callable[[int], bool],
    forget_ns: int,
    stamp_ns: int,
) -> set[int]:
    """The places in `held` of lines, no features, that were not seen for `forget_ns` by then and are not
    `held_on` nevertheless, only showed for a moment, or are too many."""
    old, lines = set[int](), list[int]()
    for line, one in enumerate(held):
        if one.feature is not None:
            continue
        lines.append(line)
        glimpsed = one.is_lost(stamp_ns) and not one.is_sure
        if glimpsed or (stamp_ns - one.seen_ns > forget_ns and not held_on(line)):
            old.add(line)
    lines.sort(key=lambda line: -held[line].seen_ns)
    return old | set(lines[_LINES:])
