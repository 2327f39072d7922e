"""How each rack front is lit, learnt from its pictures, and what its next ones are taken with.  Pure."""

from __future__ import annotations

import math
import statistics
from collections import deque
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

from flightd.site.site import Side

Face: TypeAlias = tuple[str, Side, int]
"""Aisle, side and level of what is lit alike."""

_WANTED = 200.0
"""Grey level that white paper is to have, 0..255."""
_LEAST, _MOST = 110.0, 240.0
"""Paper that is darker or lighter is made to be as wanted; without any so light, emptiness is not told."""
_CLOSE = 170.0, 225.0
"""Within these it is."""
_BURNT, _BURNT_AS = 250.0, 320.0
"""Paper so light may be lighter by any factor: it is taken to be so light."""
_BLACK = 20.0
"""Noise is as light."""
_MOST_STEP = 1.6
"""The light is changed by no more at once."""
_PICTURES = 3
"""The middle one of so many counts."""
_UNFOLLOWED = 8
"""Pictures in a row taken otherwise than asked for after which a camera is known not to follow."""
_GRID = math.log(1.1)
"""Exposures are asked for in steps: none for each change of speed."""
_TOUCH = 1e-6
_SLOWEST = 0.5
"""Part of a leg's speed that it is flown with at least for want of light."""
_SAME = 0.02


@dataclass(frozen=True, slots=True)
class Shot:
    """What pictures are wanted with: parts of the camera's usual exposure and gain, from no faster flight."""

    exposure: float = 1.0
    gain: float = 1.0
    speed_mps: float = math.inf


USUAL = Shot()


@dataclass(frozen=True, slots=True)
class LegLight:
    """What a flight past a rack front leaves to choose: its speed and the exposure planned for it, and the
    speed at which a picture of the usual exposure is blurred by as much as it may be."""

    speed_mps: float
    exposure: float
    sharp_mps: float


@dataclass(slots=True)
class _Lit:
    """`part` is the light of the next pictures as a part of the usual one, exposure times gain."""

    part: float
    settling: bool = False
    changed: bool = False
    per_light: deque[float] = field(default_factory=lambda: deque(maxlen=_PICTURES))
    """What the white of paper was, by the light of its picture."""


class _Follows:
    """Whether a camera goes by what is asked of it; it is believed to until it shows that it does not."""

    def __init__(self) -> None:
        self._unfollowed = 0
        self._followed = False

    def __bool__(self) -> bool:
        return self._followed or self._unfollowed < _UNFOLLOWED

    def deny(self) -> None:
        """It has shown elsewhere that it does not."""
        self._followed, self._unfollowed = False, _UNFOLLOWED

    def note(self, wanted: float, taken: float) -> None:
        """A picture was wanted with one part of the usual, and taken with another."""
        if not math.isclose(taken, 1.0, rel_tol=_SAME):
            self._followed = True
        elif not math.isclose(wanted, 1.0, rel_tol=_SAME):
            self._unfollowed += 1


class FaceLight:
    """Call `take` with each picture of a rack front; `shot` is what the next ones are wanted with.

    Exposure is preferred to gain, which brings noise; no exposure is longer than blur allows at the speed
    that is flown.  What gain of up to `most_gain` cannot make up for is flown past more slowly.  A front is
    left as it is until its paper is really too dark or too light, and then made to be as wanted, step by
    step, from `least` to `most` times the usual light."""

    def __init__(self, least: float, most: float, most_gain: float) -> None:
        self._least, self._most, self._most_gain = least, most, most_gain
        self._faces: dict[Face, _Lit] = {}
        self._exposes, self._gains = _Follows(), _Follows()

    def fix(self) -> None:
        """The camera is known not to support exposure control."""
        self._exposes.deny()

    @property
    def follows(self) -> bool:
        """Whether the camera supports exposure control, as far as is known."""
        return bool(self._exposes)

    def drain_changed(self) -> list[tuple[Face, float]]:
        """The fronts whose light was changed since the last call, and to which part of the usual one."""
        changed = sorted((face, lit.part) for face, lit in self._faces.items() if lit.changed)
        for face, _ in changed:
            self._faces[face].changed = False
        return changed

    def part(self, faces: Collection[Face], usual: float = 1.0) -> float:
        """The light that these fronts together want, as a part of the usual one; `usual` where no picture of
        them was taken."""
        known = [self._faces[face].part for face in faces if face in self._faces]
        return statistics.geometric_mean(known) if known and self._exposes else usual

    def shot(self, faces: Collection[Face], leg: LegLight, flown_mps: float) -> Shot:
        """How to take pictures of these fronts on a leg, at the speed `flown_mps`."""
        if not self._exposes:
            return Shot(1.0, 1.0, min(leg.speed_mps, leg.sharp_mps))
        light = self.part(faces, leg.exposure)
        gain_most = self._most_gain if self._gains else 1.0
        speed_mps = min(leg.speed_mps, max(leg.sharp_mps * gain_most / light, _SLOWEST * leg.speed_mps))
        longest = leg.sharp_mps / max(speed_mps, flown_mps)
        exposure = _on_grid(min(light, longest))
        gain = min(max(light / exposure, 1.0), gain_most) if light > longest else 1.0
        return Shot(exposure, round(gain, 2), speed_mps)

    def take(
        self,
        whites: Mapping[Face, float | None],
        wanted: Shot,
        taken: tuple[float, float],
        usual: float,
    ) -> None:
        """One picture of some fronts: it was `wanted` so, and `taken` with these parts of the usual exposure
        and gain; `whites`, as in `CodeSet`, by front.  `usual` is the light that was planned for them."""
        self._exposes.note(wanted.exposure, taken[0])
        self._gains.note(wanted.gain, taken[1])
        if not self._exposes:
            return
        light = taken[0] * taken[1]
        for face, white in whites.items():
            if white is None:
                continue
            lit = self._faces.setdefault(face, _Lit(usual))
            lit.per_light.append((_BURNT_AS if white >= _BURNT else max(white, _BLACK)) / light)
            if len(lit.per_light) == _PICTURES:
                self._settle(lit)

    def _settle(self, lit: _Lit) -> None:
        expected = statistics.median(lit.per_light) * lit.part
        low, high = _CLOSE if lit.settling else (_LEAST, _MOST)
        lit.settling = not low <= expected <= high
        if lit.settling:
            step = min(max(_WANTED / expected, 1.0 / _MOST_STEP), _MOST_STEP)
            part = min(max(lit.part * step, self._least), self._most)
            lit.changed, lit.part = lit.changed or part != lit.part, part


def _on_grid(exposure: float) -> float:
    """The next shorter one that may be asked for; the usual one is."""
    return round(math.exp(math.floor(math.log(exposure) / _GRID + _TOUCH) * _GRID), 4)
