"""Floor markers in the picture, by OpenCV's ArUco detector on the small picture.

The centre is where the diagonals meet, which tilt does not move; whether such a marker is one of the map, by
its size on the floor, is for those to say who know the height.  S. Garrido-Jurado et al., Automatic
generation and detection of highly reliable fiducial markers under occlusion, Pattern Recognition 47, 2014.
"""

from __future__ import annotations

import cv2
import numpy as np

from flightd.core.markers import MarkerDictionary, MarkerSet
from flightd.core.types import Image, MarkerSight
from flightd.vision.lines.band import Array
from flightd.vision.lines.sampling import TARGET_WIDTH_PX, Grid
from flightd.vision.lines.undistortion import Plane

_CODES = {
    MarkerDictionary.ARUCO_4X4_50: cv2.aruco.DICT_4X4_50,
    MarkerDictionary.ARUCO_4X4_250: cv2.aruco.DICT_4X4_250,
    MarkerDictionary.ARUCO_5X5_100: cv2.aruco.DICT_5X5_100,
    MarkerDictionary.ARUCO_6X6_250: cv2.aruco.DICT_6X6_250,
    MarkerDictionary.APRILTAG_16H5: cv2.aruco.DICT_APRILTAG_16h5,
    MarkerDictionary.APRILTAG_36H11: cv2.aruco.DICT_APRILTAG_36h11,
}
_WINDOW_PX = 15
"""Of the adaptive threshold, in samples: one pass is enough where markers are dark on a pale sheet."""
_LEAST_MODULE_PX = 2.2
"""In samples: below it no bits can be told."""


class MarkerFinder:
    """Finds the markers of a floor in picture after picture."""

    def __init__(self, markers: MarkerSet) -> None:
        self._markers = markers
        params = cv2.aruco.DetectorParameters()
        params.adaptiveThreshWinSizeMin = params.adaptiveThreshWinSizeMax = _WINDOW_PX
        least_px = 4 * _LEAST_MODULE_PX * markers.dictionary.modules
        params.minMarkerPerimeterRate = least_px / TARGET_WIDTH_PX
        self._detector = cv2.aruco.ArucoDetector(
            _only(cv2.aruco.getPredefinedDictionary(_CODES[markers.dictionary]), markers), params
        )

    def find(self, small: Image, grid: Grid, plane: Plane) -> tuple[MarkerSight, ...]:
        """The markers wholly in the (grid.height, grid.width, 3) samples of a frame."""
        grey = cv2.cvtColor(np.ascontiguousarray(small), cv2.COLOR_BGR2GRAY)
        quads, ids, _ = self._detector.detectMarkers(grey)
        return tuple(
            _sight(self._markers.ids[int(row)], np.asarray(quad, np.float64).reshape(4, 2), grid, plane)
            for row, quad in zip(np.ravel(ids) if quads else (), quads, strict=True)
        )


def _only(known: cv2.aruco.Dictionary, markers: MarkerSet) -> cv2.aruco.Dictionary:
    """The dictionary with nothing but these markers in their order: every candidate is held against each."""
    rows = np.ascontiguousarray(known.bytesList[list(markers.ids)])
    return cv2.aruco.Dictionary(rows, known.markerSize, known.maxCorrectionBits)


def marker_bits(dictionary: MarkerDictionary, number: int) -> Image:
    """(modules, modules) grey picture of a marker, one pixel a module, as it is printed: 0 is black."""
    known = cv2.aruco.getPredefinedDictionary(_CODES[dictionary])
    return np.asarray(cv2.aruco.generateImageMarker(known, number, dictionary.modules), np.uint8)


def _sight(number: int, corners: Array, grid: Grid, plane: Plane) -> MarkerSight:
    x, y = plane.ideal(grid.x(corners[:, 0]), grid.y(corners[:, 1]))
    ahead, across = (x[2] - x[0], y[2] - y[0]), (x[3] - x[1], y[3] - y[1])
    turn = ahead[0] * across[1] - ahead[1] * across[0]
    share = ((x[1] - x[0]) * across[1] - (y[1] - y[0]) * across[0]) / turn
    side_px = np.hypot(np.roll(x, 1) - x, np.roll(y, 1) - y).mean()
    return MarkerSight(number, float(x[0] + share * ahead[0]), float(y[0] + share * ahead[1]), float(side_px))
