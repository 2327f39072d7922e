"""Evidence pictures as small JPEG files."""

from __future__ import annotations

import hashlib

import cv2
import numpy as np

from flightd.core.types import Image

MOST_BYTES = 50_000
MOST_PIXELS = 40_000_000
"""What a picture may decode to: more than any camera gives."""
_START, _NO_FRAME = b"\xff\xd8", frozenset({0xC4, 0xC8, 0xCC})
_QUALITIES = (85, 70, 55, 40)
_SHRINK = 0.75


def evidence_jpeg(bgr: Image) -> bytes:
    """The picture as a JPEG of at most 50 KB: quality first, then size, is given up."""
    picture = bgr
    while True:
        for quality in _QUALITIES:
            good, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])
            if not good:
                raise ValueError(f"a picture of {picture.shape} cannot be encoded")
            if data.size <= MOST_BYTES:
                return bytes(data)
        size = (max(1, int(picture.shape[1] * _SHRINK)), max(1, int(picture.shape[0] * _SHRINK)))
        picture = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)


def picture_name(jpeg: bytes) -> str:
    """The name under which a picture is kept: the SHA-256 of the file, in hexadecimal."""
    return hashlib.sha256(jpeg).hexdigest()


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
