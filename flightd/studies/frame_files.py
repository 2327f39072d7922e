"""Pictures from files, folders and videos, as (H, W, 3) BGR uint8, or one clear line about why not."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from flightd.core.errors import InputError
from flightd.core.types import Image

IMAGE_SUFFIXES = frozenset(
    (".bmp", ".jpeg", ".jpg", ".jp2", ".pbm", ".pgm", ".png", ".pnm", ".ppm", ".tif", ".tiff", ".webp")
)
VIDEO_SUFFIXES = frozenset(
    (".avi", ".h264", ".m4v", ".mjpeg", ".mkv", ".mov", ".mp4", ".mpg", ".ts", ".webm")
)


@dataclass(frozen=True, slots=True)
class NamedFrame:
    """One picture and what to call it: its path, and for a video's frame `path#number` from 0."""

    name: str
    bgr: Image


def list_files(paths: Sequence[Path]) -> list[Path]:
    """The image and video files that `paths` mean, folders opened (not deeper), in name order.

    Raises InputError for a path that does not exist and for a folder without pictures.
    """
    files = []
    for path in paths:
        if path.is_dir():
            inside = sorted(p for p in path.iterdir() if p.suffix.lower() in IMAGE_SUFFIXES | VIDEO_SUFFIXES)
            if not inside:
                raise InputError(f"{path}: no image or video in this folder")
            files += inside
        elif path.exists():
            files.append(path)
        else:
            raise InputError(f"{path}: no such file or folder")
    return files


def pictures(path: Path) -> Iterator[NamedFrame]:
    """The one picture of an image file, or every frame of a video."""
    _refuse_streams(path)
    if path.suffix.lower() in VIDEO_SUFFIXES:
        yield from _frames(path)
    else:
        yield NamedFrame(str(path), read_image(path))


def read_image(path: Path) -> Image:
    """Grey, 16-bit and transparent images become plain BGR; a camera's orientation tag is obeyed.

    Raises InputError naming the file when it cannot be read or decoded.
    """
    _refuse_streams(path)
    try:
        data = np.fromfile(path, np.uint8)
    except OSError as err:
        raise InputError(f"{path}: {err.strerror}") from err
    if data.size == 0:
        raise InputError(f"{path}: the file is empty")
    try:
        decoded = cv2.imdecode(data, cv2.IMREAD_ANYDEPTH | cv2.IMREAD_COLOR)
    except (cv2.error, MemoryError) as err:
        raise InputError(f"{path}: cannot be decoded: too large or damaged") from err
    if decoded is None:
        raise InputError(f"{path}: not an image that can be decoded (damaged, or no image at all)")
    if decoded.dtype == np.uint16:
        decoded = cv2.convertScaleAbs(decoded, alpha=1 / 257)
    if decoded.dtype != np.uint8:
        raise InputError(f"{path}: pixels are {decoded.dtype}; convert the image to 8 or 16 bits")
    return np.ascontiguousarray(decoded, np.uint8)


def _refuse_streams(path: Path) -> None:
    """A pipe or a device may never end."""
    if path.exists() and not path.is_file():
        raise InputError(f"{path}: not a file; save the picture as one first")


def _frames(path: Path) -> Iterator[NamedFrame]:
    capture = cv2.VideoCapture(str(path))
    try:
        number = 0
        while True:
            good, frame = capture.read()
            if not good:
                break
            yield NamedFrame(f"{path}#{number}", np.asarray(frame, np.uint8))
            number += 1
    finally:
        capture.release()
    if number == 0:
        raise InputError(f"{path}: no frame can be read (damaged, or a codec that is not there)")
