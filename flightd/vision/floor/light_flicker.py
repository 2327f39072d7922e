"""Lamps that beat with the mains, seen in the brightness of pictures that follow each other.

Such light beats twice in a period of the mains.  A short exposure takes a moment of that, so its brightness
differs from picture to picture, by as much in every strip (at another moment, where rows are read one after
the other).  What moves through the picture changes some strips; what drifts changes all of them slowly.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flightd.vision.floor.brightness import Brightness

FEWEST_PICTURES = 15
"""A lamp that is switched meanwhile is in few of so many."""
_FEWEST_STRIPS = 6
_USABLE = (8.0, 245.0)
"""A strip that is darker or brighter at any time shows no light that beats."""
_SEEN = 0.05
"""Amplitude, as a share of the brightness, from which it disturbs: colours and labels are read worse."""
_ALIKE = 0.4
_STILL = 0.7
"""How much of a beat is left in the difference of neighbours (of 0 to 2) below which one of a tenth may pass
unseen."""


@dataclass(frozen=True, slots=True)
class Flicker:
    """`amplitude` of the beat, a share of the brightness; `alike` is how much of it the strip that shows
    least has (0 to 1)."""

    amplitude: float
    alike: float

    @property
    def is_seen(self) -> bool:
        """Whether light beats, and not the scene, and by so much that it disturbs."""
        return self.amplitude >= _SEEN and self.alike >= _ALIKE


def flicker_of(series: Sequence[Brightness]) -> Flicker | None:
    """Of pictures in their order; None where they are too few, or too dark or bright, to tell."""
    if len(series) < FEWEST_PICTURES:
        return None
    strips = np.array([one.strips for one in series])
    usable = (strips > _USABLE[0]).all(axis=0) & (strips < _USABLE[1]).all(axis=0)
    if usable.sum() < _FEWEST_STRIPS:
        return None
    levels = np.log(strips[:, usable])
    against_neighbours = levels[1:-1] - (levels[:-2] + levels[2:]) / 2
    beats = np.median(np.abs(against_neighbours), axis=0)
    amplitude = float(np.median(beats))
    return Flicker(amplitude, float(beats.min()) / amplitude if amplitude > 0.0 else 0.0)


def is_hidden(mains_hz: int, rate_hz: float) -> bool:
    """Whether pictures at this rate see the beat at about the same moment each time: it stands still."""
    beats = 2.0 * mains_hz / rate_hz
    return 1.0 - math.cos(math.tau * (beats - round(beats))) < _STILL
