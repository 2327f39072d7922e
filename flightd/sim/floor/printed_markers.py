"""Printed markers stuck to the simulated floor, each on its pale sheet."""

from __future__ import annotations

import math
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from flightd.sim.floor.texture import Patch
from flightd.site.site import Marker, Site
from flightd.vision.floor.floor_markers import marker_bits

Floats: TypeAlias = NDArray[np.float32]

_PAPER, _INK = 0.72, 0.04
"""Reflectances of the sheet and of the print."""
_FINE = 16
"""Pixels a module in the printed picture."""


class FloorSigns:
    """The markers of a site, laid over patches of its floor."""

    def __init__(self, site: Site) -> None:
        self._signs = [(marker, _printed(marker)) for marker in site.markers]

    def lay(self, colour: Floats, patch: Patch) -> None:
        """Cover the (size, size, 3) reflectances of the patch where a marker lies."""
        for marker, printed in self._signs:
            reach_m = _sheet_m(marker) * math.sqrt(0.5) + patch.texel_m
            away_x = abs(patch.x_m + patch.side_m / 2 - marker.x_m)
            away_y = abs(patch.y_m + patch.side_m / 2 - marker.y_m)
            if max(away_x, away_y) < patch.side_m / 2 + reach_m:
                _stick(colour, patch, marker, printed)


def _sheet_m(marker: Marker) -> float:
    """Side of the sheet: the marker and a rim of one module."""
    return marker.size_m * (1.0 + 2.0 / marker.dictionary.modules)


def _printed(marker: Marker) -> Floats:
    """The sheet's reflectance."""
    bits = marker_bits(marker.dictionary, marker.id)
    sheet = cv2.copyMakeBorder(bits, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=(255,))
    shares = np.kron(sheet.astype(np.float32) / np.float32(255.0), np.ones((_FINE, _FINE), np.float32))
    printed: Floats = (_INK + (_PAPER - _INK) * shares).astype(np.float32)
    return printed


def _stick(colour: Floats, patch: Patch, marker: Marker, printed: Floats) -> None:
    texels = _sheet_m(marker) / patch.texel_m
    side = max(1, min(len(printed), round(texels)))  # averaged to texels first: a warp does not
    small = cv2.resize(printed, (side, side), interpolation=cv2.INTER_AREA)
    scale = texels / side
    c, s = scale * math.cos(marker.yaw_rad), scale * math.sin(marker.yaw_rad)
    middle = (side - 1) / 2
    x = (marker.x_m - patch.x_m) / patch.texel_m - 0.5
    y = (marker.y_m - patch.y_m) / patch.texel_m - 0.5
    turn = np.array([[c, -s, x - c * middle + s * middle], [s, c, y - s * middle - c * middle]])
    size = (patch.size, patch.size)
    look = cv2.warpAffine(small, turn, size)
    cover = cv2.warpAffine(np.ones_like(small), turn, size)
    colour *= (1.0 - cover)[..., None]
    colour += look[..., None]
