"""What a cheap camera makes of any renderer's pictures: it exposes by itself, and shows the lamps' beat."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass, replace

from flightd.core.types import Image
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.sensors.auto_exposure import AutoExposure, metered
from flightd.sim.sensors.camera import PictureMaker
from flightd.sim.sensors.flicker_bands import FlickerBands
from flightd.sim.sensors.optics import USUALLY, SimCamera, Taking


@dataclass(frozen=True, slots=True)
class CheapParams:
    """`lag_s` is the time constant of the automatic exposure, `flicker` the share of the light that beats
    with the mains; 0: there is none."""

    lag_s: float = 0.0
    flicker: float = 0.0


FAITHFUL = CheapParams()
"""A camera that is set by hand, in steady light."""


class CheapCamera:
    """Takes a renderer's pictures as a cheap camera would.  Unlike those, they depend on the ones before.

    Asked for another exposure or gain than its usual ones it does as it is asked; its automatic rests until
    it is given back the usual ones."""

    def __init__(
        self, make: Callable[[], PictureMaker], camera: SimCamera, params: CheapParams, seed: int
    ) -> None:
        self._renderer = make()
        self._automatic = AutoExposure(params.lag_s) if params.lag_s else None
        phase_rad = random.Random(f"mains {seed}").uniform(0.0, math.tau)
        self._bands = FlickerBands(camera, params.flicker, phase_rad) if params.flicker else None
        self._stamp_ns = 0

    def render(
        self, kinematics: Kinematics, seq: int, out: Image | None = None, how: Taking = USUALLY
    ) -> Image:
        """As the renderer's."""
        part, gain, stamp_ns = how.exposure, how.gain, kinematics.stamp_ns
        automatic = self._automatic if (part, gain) == (USUALLY.exposure, USUALLY.gain) else None
        if automatic is not None:
            gain *= automatic.level_gain
        if self._bands is not None:
            gain *= 1.0 - self._bands.amplitude(part)
        picture = self._renderer.render(kinematics, seq, out, replace(how, gain=gain))
        if self._bands is not None:
            self._bands.lay(picture, stamp_ns, part)
        if automatic is not None:
            automatic.step(metered(picture), (stamp_ns - self._stamp_ns) * 1e-9)
            self._stamp_ns = stamp_ns
        return picture
