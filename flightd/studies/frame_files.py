"""Pictures from files, folders and videos, as (H, W, 3) BGR uint8, or one clear line about why not."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from flightd.core.errors import InputError
from flightd.core.types import Image
from flightd.studies.progress_bar import track

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
                raise InputError("no image or video in this folder", file=path)
            files += inside
        elif path.exists():
            files.append(path)
        else:
            raise InputError("no such file or folder", file=path)
    return files


def all_pictures(paths: Sequence[Path], what: str) -> Iterator[NamedFrame]:
    """Every picture of the files that `paths` mean, in order, under a progress bar called `what`.

    Raises InputError as `list_files` and `pictures` do.
    """
    files = list_files(paths)
    counts = [_frame_count(file) for file in files]
    found = (picture for file in files for picture in pictures(file))
    return track(found, what, total=sum(counts) if all(counts) else None)


def _frame_count(path: Path) -> int:
    """How many pictures a file holds as it says itself; 0 for a video that does not."""
    if path.suffix.lower() not in VIDEO_SUFFIXES or not path.is_file():
        return 1
    capture = cv2.VideoCapture(str(path))
    try:
        return max(int(capture.get(cv2.CAP_PROP_FRAME_COUNT)), 0)
    finally:
        capture.release()


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
        raise InputError(err.strerror or str(err), file=path) from err
    if data.size == 0:
        raise InputError("the file is empty", file=path)
    try:
        decoded = cv2.imdecode(data, cv2.IMREAD_ANYDEPTH | cv2.IMREAD_COLOR)
    except (cv2.error, MemoryError) as err:
        raise InputError("cannot be decoded: too large or damaged", file=path) from err
    if decoded is None:
        raise InputError("not an image that can be decoded (damaged, or no image at all)", file=path)
    if decoded.dtype == np.uint16:
        decoded = cv2.convertScaleAbs(decoded, alpha=1 / 257)
    if decoded.dtype != np.uint8:
        raise InputError(f"pixels are {decoded.dtype}", file=path, remedy="convert the image to 8 or 16 bits")
    return np.ascontiguousarray(decoded, np.uint8)


def _refuse_streams(path: Path) -> None:
    """A pipe or a device may never end."""
    if path.exists() and not path.is_file():
        raise InputError("not a file", file=path, remedy="save the picture as one first")


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
        raise InputError("no frame can be read (damaged, or a codec that is not there)", file=path)
