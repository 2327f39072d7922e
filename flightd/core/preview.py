"""A camera's picture for people on the ground, with what was found in it.

Places in the picture are fractions of its width and height, (0, 0) its left upper corner: whatever the size
at which it is sent or shown, they fit.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from flightd.core.distortion import distorted
from flightd.core.geometry import Lens
from flightd.core.scanning import CodeSet
from flightd.core.types import LineSet

Point: TypeAlias = tuple[float, float]

_BENT_STEPS = 8
"""A line through a lens that bends it is drawn in so many pieces."""


class CameraName(enum.StrEnum):
    """Which of the drone's cameras."""

    DOWN = "down"
    FRONT = "front"


@dataclass(frozen=True, slots=True)
class FoundLine:
    """A painted line: the points of its centre line, and its width as a part of the picture's width."""

    points: tuple[Point, ...]
    width: float


@dataclass(frozen=True, slots=True)
class FoundArea:
    """A code or a place of the shelf: its corners in order, and what it says."""

    kind: str
    text: str
    corners: tuple[Point, ...]


@dataclass(frozen=True, slots=True)
class Preview:
    """A picture as JPEG, its frame's number and the middle of its exposure, and what was found in it."""

    camera: CameraName
    seq: int
    stamp_ns: int
    jpeg: bytes
    lines: tuple[FoundLine, ...] = ()
    areas: tuple[FoundArea, ...] = ()


def found_lines(seen: LineSet, lens: Lens) -> tuple[FoundLine, ...]:
    """The lines of a down camera's frame where its picture shows them: a detector that knows the lens
    tells them without its distortion."""
    scaled = lens.scaled(seen.width_px, seen.height_px)
    steps = _BENT_STEPS if lens.is_distorted else 1
    found = []
    for line in seen.lines:
        alongs = np.linspace(line.start_px, line.end_px, steps + 1)
        points = [_shown(line.point_at(float(along)), scaled) for along in alongs]
        kept = tuple(point for point in points if all(map(math.isfinite, point)))
        if len(kept) > 1:
            found.append(FoundLine(kept, float(line.width_px / seen.width_px)))
    return tuple(found)


def found_areas(seen: CodeSet) -> tuple[FoundArea, ...]:
    """The places of the shelf and the codes of a front camera's frame."""

    def corners(quad: tuple[Point, ...]) -> tuple[Point, ...]:
        return tuple(_fraction(x, y, seen.width_px, seen.height_px) for x, y in quad)

    places = (
        FoundArea("place", f"{look.location}: {look.occupancy.value}", corners(look.quad_px))
        for look in seen.places
    )
    codes = (FoundArea("code", read.text, corners(read.corners_px)) for read in seen.reads)
    return (*places, *(area for area in codes if area.corners))


def _shown(centred: Point, lens: Lens) -> Point:
    """Where the picture shows a point of the distortion-free plane, given in centred pixels."""
    x_px, y_px = centred
    if lens.is_distorted:
        middle_x, middle_y = lens.centre_px
        ideal = np.array(
            [
                (x_px + middle_x - lens.cx_px) / lens.fx_px,
                (y_px + middle_y - lens.cy_px) / lens.fy_px,
            ]
        )
        bent = distorted(ideal, lens)
        x_px = float(bent[0]) * lens.fx_px + lens.cx_px - middle_x
        y_px = float(bent[1]) * lens.fy_px + lens.cy_px - middle_y
    return _fraction(x_px, y_px, lens.width_px, lens.height_px)


def _fraction(x_px: float, y_px: float, width_px: int, height_px: int) -> Point:
    """Centred pixels as fractions, to a hundredth of a percent; pixels lie around their centres."""
    return round(float(x_px) / width_px + 0.5, 4), round(float(y_px) / height_px + 0.5, 4)
