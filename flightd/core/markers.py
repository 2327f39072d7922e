"""Square floor markers by which a place is known: the dictionaries that may be printed."""

from __future__ import annotations

import enum
from dataclasses import dataclass


class MarkerDictionary(enum.StrEnum):
    """A set of ArUco or AprilTag patterns; the first numbers are the bits on each side (AprilTag: in all,
    and their least difference), the last one of ArUco's how many there are."""

    ARUCO_4X4_50 = "4x4_50"
    ARUCO_4X4_250 = "4x4_250"
    ARUCO_5X5_100 = "5x5_100"
    ARUCO_6X6_250 = "6x6_250"
    APRILTAG_16H5 = "apriltag_16h5"
    APRILTAG_36H11 = "apriltag_36h11"

    @property
    def numbers(self) -> int:
        """How many markers there are; their ids count from 0."""
        return _COUNTS[self]

    @property
    def modules(self) -> int:
        """Squares on each side, the black border included."""
        return _BITS[self] + 2


@dataclass(frozen=True, slots=True)
class MarkerSet:
    """The markers that lie on one floor, by their ids: no others are looked for."""

    dictionary: MarkerDictionary
    ids: tuple[int, ...]


_COUNTS = {
    MarkerDictionary.ARUCO_4X4_50: 50,
    MarkerDictionary.ARUCO_4X4_250: 250,
    MarkerDictionary.ARUCO_5X5_100: 100,
    MarkerDictionary.ARUCO_6X6_250: 250,
    MarkerDictionary.APRILTAG_16H5: 30,
    MarkerDictionary.APRILTAG_36H11: 587,
}
_BITS = {
    MarkerDictionary.ARUCO_4X4_50: 4,
    MarkerDictionary.ARUCO_4X4_250: 4,
    MarkerDictionary.ARUCO_5X5_100: 5,
    MarkerDictionary.ARUCO_6X6_250: 6,
    MarkerDictionary.APRILTAG_16H5: 4,
    MarkerDictionary.APRILTAG_36H11: 6,
}
