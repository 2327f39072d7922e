"""Evidence pictures as small JPEG files."""

from __future__ import annotations

import hashlib

import cv2
import numpy as np

from flightd.core.types import Image

MOST_BYTES = 50_000
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
