"""Which line of a frame is which line held."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from flightd.tracking.line_sight import LineSight

_GATE_SIGMAS = 4.0
_LEAST_SHARE = 0.3
"""Of the gate: so near a line is taken for one held however sure both are."""
_SURE_HITS = 3
"""A line seen so often is surely one."""
_LOST_NS, _NEW_HITS = 250_000_000, 10
"""A line seen less often is forgotten so soon: what only shows now and then is none.  What is found where a
line should be that was not seen for longer is taken for that once it is surely a line, and while it is new:
a stain that shows for a frame would else tell where the drone is, and how fast."""
_PLAY_M = 0.1
"""A hovering drone sways by less."""


class SeenLine(NamedTuple):
    """A line in one frame: the axis across which it lies, its offset from the drone, m, and whether it is
    surely one."""

    axis: int
    offset_m: float
    sure: bool


@dataclass(slots=True)
class HeldLine:
    """A line that is followed, or what a point of the floor, the `feature` of that number, is across the
    axis."""

    id: int
    axis: int
    width_m: float
    seen_ns: int
    from_m: float
    to_m: float
    lever_m: float
    """Its offset with play: by this lever lengths are held to scale.  By the offset itself, in which there is
    the noise that it followed, a filter would learn while it hovers that all lengths are longer: what it
    held and by what it errs then go together."""
    sight_m: float
    """Its offset as it was last seen, not filtered."""
    hits: int = 1
    feature: int | None = None
    surveyed: bool = False
    """Its distance from another line was held against the map."""

    @property
    def is_sure(self) -> bool:
        """It is surely a line."""
        return self.hits >= _SURE_HITS

    @classmethod
    def first(cls, line_id: int, sight: LineSight, stamp_ns: int, offset_m: float) -> HeldLine:
        """As it was seen for the first time, held at `offset_m`."""
        return cls(
            id=line_id,
            axis=sight.axis,
            width_m=sight.width_m,
            seen_ns=stamp_ns,
            from_m=sight.from_m,
            to_m=sight.to_m,
            lever_m=offset_m,
            sight_m=sight.offset_m,
            feature=sight.feature,
        )

    def take(self, sight: LineSight, stamp_ns: int) -> None:
        """It was seen once more."""
        self.seen_ns, self.hits, self.sight_m = stamp_ns, self.hits + 1, sight.offset_m
        self.width_m += 0.2 * (sight.width_m - self.width_m)
        self.from_m, self.to_m = sight.from_m, sight.to_m

    def lever_to(self, offset_m: float) -> None:
        """Have the lever follow the offset, but for its play."""
        self.lever_m = min(max(self.lever_m, offset_m - _PLAY_M), offset_m + _PLAY_M)

    def is_lost(self, stamp_ns: int) -> bool:
        """It has not been seen lately: where it is now is what was dead-reckoned."""
        return stamp_ns - self.seen_ns > _LOST_NS


def reach_of(sigma_m: float, gate_m: float) -> float:
    """How far from where it should be, known to `sigma_m`, a line is still taken for that."""
    return min(max(_GATE_SIGMAS * sigma_m, _LEAST_SHARE * gate_m), gate_m)


def associate(
    sights: Sequence[LineSight],
    held: Sequence[HeldLine],
    innovation: Callable[[LineSight, int], tuple[float, float]],
    gate_m: float,
    stamp_ns: int,
) -> tuple[list[tuple[LineSight, int]], list[LineSight]]:
    """Each sight with the line held that it is, and those that are none; the surest sights choose first.
    `innovation` says of a sight and a line how far they are apart and the standard deviation of that;
    `gate_m` is the farthest that is looked for, `stamp_ns` the time of the sights."""
    known: list[tuple[LineSight, int]] = []
    fresh: list[LineSight] = []
    taken: set[int] = set()
    for sight in sorted(sights, key=lambda seen: seen.sigma_m):
        best, best_m = None, gate_m
        for line, one in enumerate(held):
            if line in taken or one.axis != sight.axis or one.feature is not None:
                continue
            apart_m, sigma_m = innovation(sight, line)
            reach_m = _LEAST_SHARE * gate_m if one.is_lost(stamp_ns) else reach_of(sigma_m, gate_m)
            if abs(apart_m) < min(best_m, reach_m):
                best, best_m = line, abs(apart_m)
        if best is None:
            fresh.append(sight)
        else:
            taken.add(best)
            known.append((sight, best))
    return known, fresh


def refound(
    held: Sequence[HeldLine],
    seen: Sequence[int],
    apart: Callable[[int, int], tuple[float, float]],
    gate_m: float,
    stamp_ns: int,
) -> list[tuple[int, int]]:
    """Which of the lines `seen` in the frame of that time have become sure with it and are where a line
    should be that was lost: places of both in `held`, the new one first.  `apart` says of two lines how far
    they are from each other, and the standard deviation of that."""
    pairs: list[tuple[int, int]] = []
    for new in seen:
        if not (held[new].is_sure and held[new].hits <= _NEW_HITS):
            continue
        best, least_m = None, gate_m
        for old, line in enumerate(held):
            lost = line.feature is None and line.axis == held[new].axis and line.is_lost(stamp_ns)
            if not lost or not line.is_sure or any(old == taken for _, taken in pairs):
                continue
            apart_m, sigma_m = apart(new, old)
            if abs(apart_m) < min(least_m, reach_of(sigma_m, gate_m)):
                best, least_m = old, abs(apart_m)
        if best is not None:
            pairs.append((new, best))
    return pairs


def awaits_survey(held: Sequence[HeldLine], axis: int) -> bool:
    """Whether `unsurveyed` may find any lines across an axis, whatever the map has of them."""
    sure = [one for one in held if one.axis == axis and one.feature is None and one.is_sure]
    return len(sure) > 1 and not all(one.surveyed for one in sure)


def unsurveyed(
    held: Sequence[HeldLine], axis: int, ids: Container[int], sigma: Callable[[int], float]
) -> Iterator[tuple[int, int]]:
    """Places of the lines across an axis, of those `ids`, that were held against no other one yet, each with
    that of the surest one to hold it against, by `sigma` of a line."""
    known = [(line, one) for line, one in enumerate(held) if one.axis == axis and one.id in ids]
    for line, one in known:
        if one.surveyed or not one.is_sure:
            continue
        others = [at for at, other in known if other.surveyed]
        others = others or [at for at, other in known if at != line and other.is_sure]
        if others:
            yield line, min(others, key=sigma)
