"""What the lines of one frame say of the heading, each with one vote.  Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import median
from typing import NamedTuple

from flightd.tracking.line_sight import agrees, turn_of
from flightd.tracking.tilt_compensation import GroundLine

_TOGETHER_RAD = math.radians(4.0)
"""Lines that say the same against a heading say so within this."""
_SAME_LINE_M = 0.15
"""Two pieces of one painted line, or both edges of a strip, are one witness: as far apart as that at most."""


class HeadingVote(NamedTuple):
    """`error_rad` is what the winners say against the heading (told less true); it is `holds` where at least
    as many lines agree with it as say any one other thing; else the winners lead by `lead` lines."""

    error_rad: float
    holds: bool
    lead: int


def heading_vote(
    lines: Sequence[GroundLine], yaw_rad: float, sigma_yaw_rad: float, before_rad: float
) -> HeadingVote | None:
    """How the lines of a frame vote on a heading known to `sigma_yaw_rad`; None without a line.  Among equals
    those win that say most nearly what won before, `before_rad`."""
    said = [(line, -turn_of(line, yaw_rad)) for line in _witnesses(lines)]
    agreeing = [error for line, error in said if agrees(error, line.sigma_theta_rad, sigma_yaw_rad)]
    against = [error for line, error in said if not agrees(error, line.sigma_theta_rad, sigma_yaw_rad)]
    if not said:
        return None
    winners = _most(against, before_rad)
    if len(agreeing) >= len(winners):
        return HeadingVote(min(agreeing, key=abs), holds=True, lead=0)
    others = [error for error in against if error not in winners]
    lead = len(winners) - max(len(agreeing), len(_most(others, before_rad)))
    from_rad = winners[0]
    error_rad = from_rad + median(_apart(error, from_rad) for error in winners)
    return HeadingVote(_apart(error_rad, 0.0), holds=False, lead=lead)


def _most(errors: Sequence[float], before_rad: float) -> list[float]:
    """The most of them that say the same."""
    groups = ([other for other in errors if abs(_apart(other, one)) < _TOGETHER_RAD] for one in errors)
    return max(groups, key=lambda group: (len(group), -abs(_apart(group[0], before_rad))), default=[])


def _apart(error_rad: float, from_rad: float) -> float:
    """A line says nothing of whole right angles."""
    return math.remainder(error_rad - from_rad, math.pi / 2)


def _witnesses(lines: Sequence[GroundLine]) -> list[GroundLine]:
    kept: list[GroundLine] = []
    for line in sorted(lines, key=lambda line: -math.dist(*line.ends_m)):
        if not any(_lies_on(line, other) for other in kept):
            kept.append(line)
    return kept


def _lies_on(line: GroundLine, other: GroundLine) -> bool:
    """Whether it runs along the other, on it or close beside."""
    turned_rad = math.remainder(line.theta_rad - other.theta_rad, math.pi)
    cos, sin = math.cos(other.theta_rad), math.sin(other.theta_rad)
    beside_m = abs(line.right_m * cos - line.forward_m * sin - other.rho_m)
    return abs(turned_rad) < _TOGETHER_RAD and beside_m < _SAME_LINE_M
