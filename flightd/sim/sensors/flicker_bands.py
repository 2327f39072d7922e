"""Mains light that a rolling shutter sees: bright and dark bands across the picture."""

from __future__ import annotations

import math

import cv2
import numpy as np

from flightd.core.exposure import beat_passed
from flightd.core.types import Image
from flightd.sim.sensors.optics import Floats, SimCamera

_MAINS_HZ = 50
_TURNS_HZ = 2 * _MAINS_HZ


class FlickerBands:
    """The beat of lamps on the mains, row by row of one camera."""

    def __init__(self, camera: SimCamera, amplitude: float, phase_rad: float) -> None:
        """`amplitude` is the lamps', a share of their light's grey level; an exposure averages over it."""
        self._amplitude, self._phase_rad = amplitude, phase_rad
        self._exposure_s = camera.exposure_s
        height, width = camera.lens.height_px, camera.lens.width_px
        share = (np.arange(height) + 0.5) / height - 0.5
        self._row_rad: Floats = (math.tau * _TURNS_HZ * camera.readout_s * share).astype(np.float32)
        self._table = np.empty((height, 3 * width), np.uint8)

    def amplitude(self, part: float = 1.0) -> float:
        """What a part of the usual exposure leaves of the beat."""
        return self._amplitude * beat_passed(part * self._exposure_s, _MAINS_HZ)

    def rows(self, stamp_ns: int, part: float = 1.0) -> Floats:
        """(H,) light of each row of a picture whose middle row is exposed at `stamp_ns`; 1 without lamps."""
        at_rad = math.tau * ((stamp_ns * 1e-9 * _TURNS_HZ) % 1.0) + self._phase_rad
        rows: Floats = 1.0 + np.float32(self.amplitude(part)) * np.sin(self._row_rad + np.float32(at_rad))
        return rows

    def lay(self, picture: Image, stamp_ns: int, part: float = 1.0) -> None:
        """Brighten, in place, a picture that was taken by the light of the darkest row there may be: what
        burns out stays so."""
        amplitude = self.amplitude(part)
        most = (1.0 + amplitude) / (1.0 - amplitude)
        steps = 255.0 / most
        rows = self.rows(stamp_ns, part) / (1.0 - amplitude)
        self._table[:] = np.round(rows * steps).astype(np.uint8)[:, None]
        flat = picture.reshape(self._table.shape)
        cv2.multiply(flat, self._table, dst=flat, scale=1.0 / steps)
