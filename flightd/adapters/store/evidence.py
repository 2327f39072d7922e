"""Evidence pictures: small JPEG files named by their SHA-256, on the disk before anything refers to them."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

import cv2
import numpy as np

from flightd.core.errors import UnavailableError
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


class EvidenceFolder:
    """Pictures by content: FOLDER/ab/abcd….jpg.  The same picture twice is one file."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def path(self, name: str) -> Path:
        """Where the picture `name` is, or would be."""
        return self._folder / name[:2] / f"{name}.jpg"

    def keep(self, jpeg: bytes) -> str:
        """Write a picture through to the disk and return its name.

        Raises ValueError above 50 KB and UnavailableError when the disk refuses."""
        if len(jpeg) > MOST_BYTES:
            raise ValueError(f"evidence of {len(jpeg)} bytes; at most {MOST_BYTES} are kept")
        name = hashlib.sha256(jpeg).hexdigest()
        target = self.path(name)
        if target.exists():
            return name
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            part = target.with_name(f"{name}.{os.getpid()}.part")
            with part.open("wb") as file:
                file.write(jpeg)
                file.flush()
                os.fsync(file.fileno())
            part.replace(target)
            for folder in (target.parent, self._folder):
                _sync(folder)
        except OSError as err:
            raise UnavailableError(f"{target}: cannot keep the picture: {err.strerror or err}") from err
        return name

    def clean(self) -> None:
        """Take away what a power cut left half written."""
        for part in self._folder.glob("*/*.part"):
            part.unlink(missing_ok=True)


def _sync(folder: Path) -> None:
    # a new name is safe only once its folder is
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
