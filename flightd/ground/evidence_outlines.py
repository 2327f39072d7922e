"""Where in a picture kept as evidence the codes are: read again, for the record does not keep that."""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np

from flightd.vision.shelf.code_reader import read_codes
from flightd.vision.shelf.evidence_jpeg import MOST_PIXELS, jpeg_size


@lru_cache(maxsize=256)
def outlines(jpeg: bytes) -> tuple[tuple[str, tuple[tuple[float, float], ...]], ...]:
    """The text and the four corners of each code, as parts of the picture's width and height from its left
    top.  Nothing for what is no picture."""
    size = jpeg_size(jpeg)
    if size is None or size[0] * size[1] > MOST_PIXELS:
        return ()
    try:
        return _outlines(jpeg)
    except cv2.error:  # of a file that is spoilt within
        return ()


def _outlines(jpeg: bytes) -> tuple[tuple[str, tuple[tuple[float, float], ...]], ...]:
    picture = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
    if picture is None:
        return ()
    height, width = picture.shape[:2]
    return tuple(
        (
            read.text,
            tuple((round(x / width + 0.5, 4), round(y / height + 0.5, 4)) for x, y in read.corners_px),
        )
        for read in read_codes(np.asarray(picture, np.uint8), deeper=False)
        if read.believed
    )
