"""A picture's fingerprint and exposure, from a coarse sample of its pixels."""

from __future__ import annotations

import zlib

import cv2
import numpy as np

from flightd.core.types import Image, PictureCheck


def check_picture(coarse: Image) -> PictureCheck:
    """Of the (h, w, 3) samples of a picture: some microseconds.  Noise makes each exposure of a real sensor
    another fingerprint."""
    mean, spread = cv2.meanStdDev(coarse)
    brightness, contrast = float(np.mean(mean)), float(np.max(spread))
    return PictureCheck(zlib.crc32(coarse.tobytes()), round(brightness, 1), round(contrast, 1))
