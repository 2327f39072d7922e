"""JPEG files of any origin: their size, and what they show."""

from __future__ import annotations

from typing import Final

import cv2
import numpy as np

from flightd.core.types import Image

MOST_PIXELS: Final = 40_000_000
"""What a picture may decode to: more than any camera gives."""
_START, _NO_FRAME = b"\xff\xd8", frozenset({0xC4, 0xC8, 0xCC})


def jpeg_size(jpeg: bytes) -> tuple[int, int] | None:
    """Width and height (px) as the file's frame header has them, before anything is decoded; None for what
    is no JPEG (ITU-T T.81, B.2.2)."""
    if not jpeg.startswith(_START):
        return None
    at = len(_START)
    while at + 9 <= len(jpeg) and jpeg[at] == 0xFF:
        marker = jpeg[at + 1]
        if marker == 0xFF:  # fill
            at += 1
        elif 0xC0 <= marker <= 0xCF and marker not in _NO_FRAME:
            height, width = (int.from_bytes(jpeg[place : place + 2], "big") for place in (at + 5, at + 7))
            return (width, height) if width and height else None
        else:
            at += 2 + int.from_bytes(jpeg[at + 2 : at + 4], "big")
    return None


def decoded_jpeg(jpeg: bytes) -> Image | None:
    """The picture, BGR; None for what is no JPEG, is damaged beyond showing anything, or claims more than
    MOST_PIXELS."""
    size = jpeg_size(jpeg)
    if size is None or size[0] * size[1] > MOST_PIXELS:
        return None
    try:
        picture = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
    except cv2.error:  # of a file that is spoilt within
        return None
    return None if picture is None else np.asarray(picture, np.uint8)
