"""What a front camera sees where nothing is: wall above floor, parted by the horizon."""

from __future__ import annotations

import math

import cv2
import numpy as np

from flightd.core.types import Image
from flightd.sim.ardrone.video import HEIGHT_PX, WIDTH_PX

_WALL_BGR, _FLOOR_BGR = (200, 195, 190), (105, 110, 115)
_FOCAL_PX = math.hypot(WIDTH_PX, HEIGHT_PX) / 2 / math.tan(math.radians(92.0) / 2)


def horizon(roll_rad: float, pitch_rad: float) -> Image:
    """The picture, (360, 640, 3), at an attitude: nose up shows less floor; right side down turns the horizon
    counter-clockwise."""
    picture = np.full((HEIGHT_PX, WIDTH_PX, 3), _WALL_BGR, np.uint8)
    middle_x, middle_y = (WIDTH_PX - 1) / 2, (HEIGHT_PX - 1) / 2 + _FOCAL_PX * math.tan(pitch_rad)
    along, down = (math.cos(roll_rad), -math.sin(roll_rad)), (math.sin(roll_rad), math.cos(roll_rad))
    reach_px = 2 * WIDTH_PX
    corners = [
        (
            middle_x + a * reach_px * along[0] + d * reach_px * down[0],
            middle_y + a * reach_px * along[1] + d * reach_px * down[1],
        )
        for a, d in ((-1, 0), (1, 0), (1, 1), (-1, 1))
    ]
    cv2.fillPoly(picture, [np.array(corners, np.float64).round().astype(np.int32)], _FLOOR_BGR)
    return picture
