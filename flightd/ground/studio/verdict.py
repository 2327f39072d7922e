"""Whether a new profile is better or worse than those that fly, in words for a person."""

from __future__ import annotations

import enum
import math
from collections.abc import Iterator, Sequence

import msgspec

from flightd.ground.studio.profile_score import LogScore, ProfileScore

LEAST_DIFFERENCE = 0.01
"""Shares that differ by less are the same."""
_CHANCE_SIGMAS = 2.0


class Judged(enum.StrEnum):
    """What the comparison comes to."""

    BETTER = "better"
    SAME = "same"
    WORSE = "worse"
    ALONE = "alone"
    """There is none to compare with."""


class Verdict(msgspec.Struct, frozen=True):
    """`reasons` say figure by figure what is worse, else what is better."""

    judged: Judged
    reasons: tuple[str, ...] = ()


def verdict(scores: Sequence[tuple[str, ProfileScore, LogScore]]) -> Verdict:
    """Of the first against the others: worse as soon as one figure is worse than that of any of them."""
    (_, new, new_logs), *others = scores
    if not others:
        return Verdict(Judged.ALONE)
    worse: list[str] = []
    better: list[str] = []
    for name, old, old_logs in others:
        shares = zip(_shares(new, new_logs), _shares(old, old_logs), strict=True)
        for (figure, mine, count), (_, theirs, _) in shares:
            if count and abs(mine - theirs) > max(LEAST_DIFFERENCE, _chance(theirs, count)):
                reason = f"{figure}: {_percent(mine)}, {name} {_percent(theirs)}"
                (worse if mine < theirs else better).append(reason)
    if worse:
        return Verdict(Judged.WORSE, tuple(worse))
    return Verdict(Judged.BETTER, tuple(better)) if better else Verdict(Judged.SAME)


def _shares(pictures: ProfileScore, logs: LogScore) -> Iterator[tuple[str, float, int]]:
    """Figure, share that is right (more is better), and of how many."""
    for figure, right, total in (
        ("marked paint that is seen", pictures.paint_kept, pictures.paint),
        ("marked floor that is left out", pictures.floor_refused, pictures.floor),
        ("labelled lines that are found", pictures.lines_found, pictures.lines),
        ("found lines that are labelled", pictures.lines_right, pictures.lines_judged),
        ("lines of the logs that are found again", logs.again, logs.lines),
    ):
        yield figure, right / max(total, 1), total


def _chance(share: float, count: int) -> float:
    """By how much a share of so many may differ without meaning anything."""
    return _CHANCE_SIGMAS * math.sqrt(max(share * (1.0 - share), 0.0) / count)


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"
