"""How much light falls on each rack front, and on which part of a picture it comes out."""

from __future__ import annotations

import random
from collections.abc import Iterable, Mapping

import cv2
import numpy as np

from flightd.core.camera_view import CameraView, Viewpoint
from flightd.core.errors import InputError
from flightd.core.geometry import Lens
from flightd.core.types import Image
from flightd.sim.racks.panels import Pane
from flightd.sim.racks.scene import Sightline
from flightd.site.site import Side, Site

USUAL_LIGHT = 64
"""The usual light in a map of it; four times as much is the most."""
_MOST = 255 / USUAL_LIGHT
_COARSE = 8
"""A map is drawn at a fraction of the resolution."""
_NEAREST_M2 = 0.1
_SOFT_PX = 3
"""Over so many pixels of that the light of one level goes over into the next one's."""


def face_name(aisle: str, side: Side) -> str:
    """A rack front as scenarios name it: "A left"; a level of it is "A left 2"."""
    return f"{aisle} {side.value}"


def drawn_light(site: Site, bounds: tuple[float, float], seed: int) -> dict[str, float]:
    """A light for each level of each rack front, within `bounds`, the usual one being 1."""
    rng = random.Random(f"face light {seed}")
    levels = sorted({(place.aisle, place.side.value, place.level) for place in site.locations.values()})
    return {f"{aisle} {side} {level}": rng.uniform(*bounds) for aisle, side, level in levels}


def check_names(light: Iterable[str], site: Site) -> None:
    """InputError where a light is told of what no rack front of the site is called."""
    known = {face_name(place.aisle, place.side) for place in site.locations.values()}
    known |= {f"{face_name(place.aisle, place.side)} {place.level}" for place in site.locations.values()}
    for name in light:
        if name not in known:
            raise InputError(f"racks.light: no rack front {name!r}; there are {', '.join(sorted(known))}")


class FaceLight:
    """Draws the light of a picture.  `light` is a factor on the usual one by the name of a rack front or of
    one of its levels; a front without any has the usual light."""

    def __init__(self, light: Mapping[str, float], lens: Lens) -> None:
        self._light = light
        self._size = lens.width_px, lens.height_px
        self._lens = lens.scaled(max(lens.width_px // _COARSE, 1), max(lens.height_px // _COARSE, 1))

    def draw(self, at: Viewpoint, seen: Iterable[Sightline], lamp: float = 0.0) -> Image | None:
        """(H, W, 3) light of each pixel of a picture taken at `at`, `USUAL_LIGHT` being 1; None where all of
        it is usual.  The lamp beside the camera adds `lamp` to it 1 m
        away, by the square of the distance less."""
        if not self._light and not lamp:
            return None
        drawn = np.full((self._lens.height_px, self._lens.width_px, 4), USUAL_LIGHT, np.uint8)
        pane = Pane(CameraView(self._lens, at), drawn)
        for sight in seen:
            face = sight.face
            decks_m = [0.0, *(level.deck_m - level.beam_m for level in face.levels[1:])]
            tops_m = [*decks_m[1:], face.shelf.height_m]
            for number, (low_m, high_m) in enumerate(zip(decks_m, tops_m, strict=True), start=1):
                light = self._of(face.shelf.aisle, face.shelf.side, number)
                light += lamp / max((face.y_m - at.y_m) ** 2, _NEAREST_M2)
                level = USUAL_LIGHT * min(light, _MOST)
                for x0_m, x1_m in sight.bays():
                    ends = (x0_m, low_m), (x1_m, low_m), (x1_m, high_m), (x0_m, high_m)
                    corners = np.array([(x, face.y_m, height) for x, height in ends])
                    pane.polygon(corners, (level, level, level))
        soft = cv2.blur(drawn, (_SOFT_PX, _SOFT_PX))
        whole = cv2.resize(soft, self._size, interpolation=cv2.INTER_LINEAR)
        return np.asarray(cv2.cvtColor(whole, cv2.COLOR_BGRA2BGR), np.uint8)

    def _of(self, aisle: str, side: Side, level: int) -> float:
        name = face_name(aisle, side)
        return self._light.get(f"{name} {level}", self._light.get(name, 1.0))
