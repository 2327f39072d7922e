"""The frames that are timed: all levels alike often, made once, read by whoever times them."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import TypeAlias

import cv2
import numpy as np

from flightd.core.distortion import undistorted
from flightd.core.errors import UnavailableError
from flightd.core.geometry import Lens
from flightd.core.types import Image
from flightd.runtime.undisturbed_start import undisturbed
from flightd.sim.dataset.generate import LEVEL_NAMES, frame_of_any_level
from flightd.sim.dataset.rough_floor import FRAMES_A_HALL
from flightd.sim.dataset.scenes import LAYOUTS
from flightd.sim.dataset.severity import LEVELS
from flightd.studies.progress_bar import track

COLOUR = "yellow"
"""What one would pick instead knows no other."""
FIRST_SEED, LEAST_FRAMES, FRAMES = 700, len(LEVEL_NAMES), 60
_ENLARGED = 1.06
"""A lens of a drone shows more in its corners than a straight picture of the same focal length has."""

Size: TypeAlias = tuple[int, int]


def frame(number: int, size: Size) -> Image:
    """Number -1 is of no level's: what a process's first call is made on."""
    if number < 0:
        return frame_of_any_level("clean", FIRST_SEED - 1, *size, COLOUR, "cross")[0]
    level, index = LEVEL_NAMES[number % len(LEVEL_NAMES)], number // len(LEVEL_NAMES)
    layout = LAYOUTS[index % len(LAYOUTS)] if level in LEVELS else None
    return frame_of_any_level(level, FIRST_SEED + index, *size, COLOUR, layout)[0]


class BenchFrames:
    """Frames of some sizes in files of a folder, beside the one for the first call."""

    def __init__(self, folder: Path, count: int) -> None:
        self._folder, self.count = folder, count

    def make(self, sizes: Sequence[Size], cores: int) -> None:
        """Draw them all, on all cores."""
        # frames of one hall together: it is laid out once
        numbers = sorted(range(-1, self.count), key=lambda n: n % len(LEVEL_NAMES))
        starts = range(0, len(numbers), FRAMES_A_HALL)
        jobs = [(size, numbers[at : at + FRAMES_A_HALL]) for size in sizes for at in starts]
        for size in sizes:
            self._reserve(size)
        with ProcessPoolExecutor(cores, get_context("spawn")) as pool:
            with undisturbed():
                done = [pool.submit(self._draw, size, some) for size, some in jobs]
            for job in track(done, "drawing frames"):
                job.result()

    def first(self, size: Size) -> Image:
        """For a call that is not counted."""
        return np.array(self._open(size, "r")[-1])

    def of(self, size: Size, lens: Lens | None = None) -> Iterator[tuple[int, Image]]:
        """Their numbers and the frames, each as new as from a camera, as a `lens` shows them if given."""
        stored, bend = self._open(size, "r"), _Bend(lens) if lens is not None else None
        for number in range(self.count):
            straight = np.array(stored[number])
            yield number, straight if bend is None else bend(straight)

    def _reserve(self, size: Size) -> None:
        """A file that has its room; without, whoever writes to it dies of a signal.  UnavailableError."""
        try:
            with self._path(size).open("wb") as file:
                os.posix_fallocate(file.fileno(), 0, (self.count + 1) * size[0] * size[1] * 3)
        except OSError as err:
            raise UnavailableError(
                f"no room for the frames in {self._folder.parent} ({err.strerror}); let TMPDIR name a "
                "folder that has some, or ask for fewer --frames"
            ) from err

    def _path(self, size: Size) -> Path:
        return self._folder / f"{size[0]}x{size[1]}"

    def _draw(self, size: Size, numbers: Sequence[int]) -> None:
        stored = self._open(size, "r+")
        for number in numbers:
            stored[number] = frame(number, size)

    def _open(self, size: Size, mode: str) -> Image:
        width, height = size
        shape = (self.count + 1, height, width, 3)
        return np.memmap(self._path(size), np.uint8, mode, shape=shape)  # type: ignore[call-overload,no-any-return]


class _Bend:
    """Pictures of a camera without distortion as a lens with distortion shows them."""

    def __init__(self, lens: Lens) -> None:
        columns, rows = np.meshgrid(np.arange(lens.width_px, dtype=float), np.arange(lens.height_px))
        seen = np.stack([(columns - lens.cx_px) / lens.fx_px, (rows - lens.cy_px) / lens.fy_px])
        x, y = undistorted(seen, lens) / _ENLARGED
        self._x = (x * lens.fx_px + lens.cx_px).astype(np.float32)
        self._y = (y * lens.fy_px + lens.cy_px).astype(np.float32)

    def __call__(self, bgr: Image) -> Image:
        return np.asarray(
            cv2.remap(bgr, self._x, self._y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), np.uint8
        )
