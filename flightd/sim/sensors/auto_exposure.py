"""A camera's automatic exposure: how bright a picture is, and the gain by which the next is taken."""

from __future__ import annotations

import math

import numpy as np

from flightd.core.types import Image
from flightd.sim.sensors.optics import Floats

TARGET = 0.28
"""The mean light, as a share of what burns out, that the automatic strives for: a concrete floor's in the
usual light, where its gain is one."""
GAINS = 0.25, 4.0
"""Between which it is able to change the usual gain, in light."""
_EVERY_PX = 16
_DARKEST = 1e-3
_GAMMA = 2.2


def _light_table() -> Floats:
    share = np.arange(256) / 255.0
    light: Floats = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4).astype(
        np.float32
    )
    return light


_LIGHT = _light_table()


def metered(picture: Image) -> float:
    """The mean light of a picture, 0 to 1, of one pixel in some hundred."""
    start = _EVERY_PX // 2
    return float(_LIGHT[picture[start::_EVERY_PX, start::_EVERY_PX]].mean())


class AutoExposure:
    """A loop of the first order, in stops; what is burnt out seems no brighter than it shows, as to a real
    one.  The first picture settles it at once: a camera has looked at the floor before anybody flies."""

    def __init__(self, lag_s: float) -> None:
        """`lag_s` is its time constant."""
        self._lag_s = lag_s
        self._settled = False
        self.gain = 1.0
        """In light, not in grey levels."""

    @property
    def level_gain(self) -> float:
        """What the gain does to grey levels, which have a gamma."""
        return float(self.gain ** (1.0 / _GAMMA))

    def step(self, light: float, dt_s: float) -> None:
        """Take in the mean light of a picture that was taken by the present gain, `dt_s` after the one
        before."""
        wanted = min(max(self.gain * TARGET / max(light, _DARKEST), GAINS[0]), GAINS[1])
        share = 1.0 - math.exp(-max(dt_s, 0.0) / self._lag_s) if self._settled else 1.0
        self._settled = True
        self.gain *= (wanted / self.gain) ** share
