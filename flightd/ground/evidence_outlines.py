"""Where in a picture kept as evidence the codes are: read again, for the record does not keep that."""

from __future__ import annotations

from functools import lru_cache

from flightd.vision.jpeg import decoded_jpeg
from flightd.vision.shelf.code_reader import read_codes


@lru_cache(maxsize=256)
def outlines(jpeg: bytes) -> tuple[tuple[str, tuple[tuple[float, float], ...]], ...]:
    """The text and the four corners of each code, as parts of the picture's width and height from its left
    top.  Nothing for what is no picture."""
    picture = decoded_jpeg(jpeg)
    if picture is None:
        return ()
    height, width = picture.shape[:2]
    return tuple(
        (
            read.text,
            tuple((round(x / width + 0.5, 4), round(y / height + 0.5, 4)) for x, y in read.corners_px),
        )
        for read in read_codes(picture, deeper=False)
        if read.believed
    )
