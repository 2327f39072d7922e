"""The paper's Table I: how fast each method is here, and what a user would pick instead.

Every figure is also given in units of one `cvtColor(BGR2HSV)` of the same frame, measured between the
methods in the same run, so that figures of different machines and busy hours can be compared.
"""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, thread_time, thread_time_ns
from typing import TypeAlias

import cv2
import numpy as np
from rich.console import Console
from rich.table import Table

from flightd import __version__
from flightd.config.camera import CameraConfig
from flightd.core.errors import UnavailableError
from flightd.core.geometry import Lens
from flightd.core.markers import MarkerDictionary, MarkerSet
from flightd.core.types import Image
from flightd.runtime.undisturbed_start import undisturbed
from flightd.sim.dataset.generate import LEVEL_NAMES
from flightd.studies.baselines import BASELINES
from flightd.studies.bench_frames import COLOUR, FRAMES, BenchFrames, Size
from flightd.studies.progress_bar import track
from flightd.vision.line_detector import METHODS, Detector

SIZES: tuple[Size, ...] = ((1920, 1080), (640, 360))
UNIT = "cvtColor"
IN_FLIGHT = "combined, in flight"
PREVIEW = "JPEG of a frame"
_MARKERS = MarkerSet(MarkerDictionary.APRILTAG_36H11, tuple(range(30)))
_DISTORTION = (-0.05, 0.01, 0.0, 0.0, 0.0)
"""A cheap wide lens's."""
_FRAME_NS = 33_333_333

PAPER_FPS = {"centroid": (4.23, 15.10), "skeleton": (8.93, 20.0)}
"""Frames a second of the paper's Table I: on board (Raspberry Pi 3) and off board (Core i7, 4 cores)."""

Finder: TypeAlias = Callable[[Image, int], object]


@dataclass(slots=True)
class Timing:
    """One method on frames of one size."""

    method: str
    size: Size
    baseline: bool
    ms: list[float] = field(default_factory=list)
    levels: list[str] = field(default_factory=list)
    """Of which level each of the frames was."""
    units: list[float] = field(default_factory=list)
    """Each frame's time in conversions of the same frame."""
    stages_ms: dict[str, list[float]] = field(default_factory=dict)
    fps_all: float = 0.0
    missing: str = ""

    @property
    def median_ms(self) -> float:
        return float(np.median(self.ms)) if self.ms else float("nan")

    @property
    def median_units(self) -> float:
        return float(np.median(self.units)) if self.units else float("nan")

    def of_level(self, level: str) -> float:
        """The median in ms of one level's frames."""
        ms = [ms for ms, of in zip(self.ms, self.levels, strict=True) if of == level]
        return float(np.median(ms)) if ms else float("nan")


def flown_lens(size: Size) -> Lens:
    """A lens as it is flown, with distortion."""
    return CameraConfig(distortion=_DISTORTION).lens().scaled(*size)


def finder(timing: Timing) -> Finder:
    """The function that a row of the table times: it takes a frame and its number."""
    method = timing.method
    if method == UNIT:
        return lambda bgr, _: cv2.cvtColor(bgr, cv2.COLOR_BGR2HSV)
    if method == PREVIEW:
        return lambda bgr, _: cv2.imencode(".jpg", bgr)[1].tobytes()
    if method in BASELINES:
        baseline = BASELINES[method]
        return lambda bgr, _: baseline(bgr)
    if method == IN_FLIGHT:
        return _flown(timing)
    detector = Detector(method, COLOUR)
    return lambda bgr, _: detector.detect(bgr)


def _flown(timing: Timing) -> Finder:
    """All that a flight asks of each frame: beside the lines the pads, the picture's check, features that are
    followed, markers."""
    lens = flown_lens(timing.size)
    detector = Detector("combined", COLOUR, lens, markers=_MARKERS, in_flight=True, now_ns=thread_time_ns)

    def detect(bgr: Image, number: int) -> None:
        found = detector.detect(bgr, number, (number + 1) * _FRAME_NS)
        for stage, ms in found.timings_ms.items():
            timing.stages_ms.setdefault(stage, []).append(ms)

    return detect


def bench(
    seconds: float, sizes: Sequence[Size] = SIZES, all_cores: bool = True, frames: int = FRAMES
) -> list[Timing]:
    """Time every method on `frames` frames of all levels on one core, and for about `seconds` on all cores at
    once.  What is compared with stops after `seconds`."""
    threads, cores = cv2.getNumThreads(), os.cpu_count() or 1
    cv2.setNumThreads(1)
    try:
        with TemporaryDirectory(prefix="flightd-bench-") as folder:
            drawn = BenchFrames(Path(folder), frames)
            drawn.make(sizes, cores)
            timings = []
            for size in sizes:
                timings += _one_core(drawn, size, seconds)
            if all_cores:
                _all_cores(timings, drawn, cores, seconds)
            return timings
    finally:
        cv2.setNumThreads(threads)


def _one_core(drawn: BenchFrames, size: Size, seconds: float) -> list[Timing]:
    """Each frame in turn by every method, one right after another, so that a busy moment strikes all alike.

    Cold: no method has seen the frame before, and the others have used the caches since its last one.  Not
    counted is the first call of each, on a frame of its own: it loads code.  The unit alone is measured warm,
    at its best of two: a cold one would flatter the rest.

    Processor time of the one thread at work, which other programs on the machine hardly touch.
    """
    names = (UNIT, *METHODS, *BASELINES, IN_FLIGHT, PREVIEW)
    timings = [Timing(name, size, name in BASELINES) for name in names]
    straight, bent = timings[:-2], timings[-2:]
    finders: dict[str, Finder] = {}
    for timing in timings:
        try:
            finders[timing.method] = finder(timing)
            finders[timing.method](drawn.first(size), -1)
            timing.stages_ms.clear()
        except UnavailableError as err:
            timing.missing = str(err)
    frames = zip(drawn.of(size), drawn.of(size, flown_lens(size)), strict=True)
    for (number, bgr), (_, flown) in track(frames, f"one core, {size[0]}x{size[1]}", total=drawn.count):
        unit_ms = min(_timed(finders[UNIT], bgr, number) for _ in range(2))
        for rows, picture in ((straight, bgr), (bent, flown)):
            for timing in rows:
                if timing.missing or (timing.baseline and sum(timing.ms) > seconds * 1e3):
                    continue
                is_unit = timing.method == UNIT
                ms = unit_ms if is_unit else _timed(finders[timing.method], picture, number)
                timing.ms.append(ms)
                timing.units.append(ms / unit_ms)
                timing.levels.append(LEVEL_NAMES[number % len(LEVEL_NAMES)])
    return timings


def _timed(find: Finder, bgr: Image, number: int) -> float:
    """Processor time in ms."""
    start = thread_time()
    find(bgr, number)
    return (thread_time() - start) * 1e3


_worker_frames: dict[Size, list[Image]] = {}
_A_WORKERS_FRAMES = 12


def _start_worker(drawn: BenchFrames, sizes: Sequence[Size]) -> None:
    cv2.setNumThreads(1)
    for size in sizes:
        _worker_frames[size] = [bgr for number, bgr in drawn.of(size) if number < _A_WORKERS_FRAMES]


def _rate(method: str, size: Size, seconds: float) -> float:
    """Frames a second of this worker over `seconds`."""
    find, frames = finder(Timing(method, size, False)), _worker_frames[size]
    find(frames[0], 0)
    start, count = perf_counter(), 0
    while perf_counter() - start < seconds:
        find(frames[count % len(frames)], count)
        count += 1
    return count / (perf_counter() - start)


def _all_cores(timings: Sequence[Timing], drawn: BenchFrames, cores: int, seconds: float) -> None:
    """One process to a core, as the daemon runs its detectors, all at the same method at once."""
    sizes = sorted({timing.size for timing in timings})
    with ProcessPoolExecutor(cores, get_context("spawn"), _start_worker, (drawn, sizes)) as pool:
        with undisturbed():
            started = pool.map(_warm, range(4 * cores))
        list(started)
        for timing in track(timings, f"all {cores} cores"):
            if not timing.missing:
                jobs = [pool.submit(_rate, timing.method, timing.size, seconds) for _ in range(cores)]
                timing.fps_all = sum(job.result() for job in jobs)


def _warm(number: int) -> int:
    """Nothing, but it makes the pool start its workers."""
    return number


def machine() -> dict[str, object]:
    """What the figures were measured on."""
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "python": platform.python_version(),
        "opencv": cv2.__version__,
        "flightd": __version__,
    }


def _processor() -> str:
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as lines:  # noqa: PTH123
            for line in lines:
                if line.startswith("model name"):
                    return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def as_json(timings: Sequence[Timing]) -> str:
    """The one JSON document of `flightd bench --json`."""
    rows = []
    for timing in timings:
        row: dict[str, object] = {
            "method": timing.method,
            "baseline": timing.baseline,
            "width": timing.size[0],
            "height": timing.size[1],
        }
        if timing.missing:
            row["missing"] = timing.missing
        else:
            row |= {
                "ms_median": round(timing.median_ms, 4),
                "ms_p95": round(float(np.quantile(timing.ms, 0.95)), 4),
                "fps_one_core": round(1e3 / timing.median_ms, 2),
                "fps_all_cores": round(timing.fps_all, 2) or None,
                "cvtcolor_units": round(timing.median_units, 3),
                "frames": len(timing.ms),
                "ms_median_of_level": {name: _rounded(timing.of_level(name)) for name in LEVEL_NAMES},
            }
        if timing.stages_ms:
            row["stages_ms"] = {
                stage: round(float(np.median(ms)), 4) for stage, ms in timing.stages_ms.items()
            }
        if timing.method in PAPER_FPS:
            row["paper_fps"] = dict(zip(("on_board", "off_board"), PAPER_FPS[timing.method], strict=True))
        rows.append(row)
    levels = {"level": ", ".join(LEVEL_NAMES), "levels": list(LEVEL_NAMES)}
    return json.dumps({"machine": machine(), **levels, "results": rows}, indent=1)


def _rounded(ms: float) -> float | None:
    return None if np.isnan(ms) else round(ms, 4)


def print_table(timings: Sequence[Timing], console: Console) -> None:
    """Table I for people, one block to a size."""
    about = machine()
    console.print(
        f"{about['processor']}, {about['cores']} cores, OpenCV {about['opencv']}",
        highlight=False,
        markup=False,
    )
    for size in dict.fromkeys(timing.size for timing in timings):
        table = Table(title=f"{size[0]}x{size[1]}", title_justify="left")
        table.add_column("method")
        for name in (
            "ms", "p95", *LEVEL_NAMES, "/ cvtColor", "fps, one core", "fps, all cores",
            "paper fps\non off board",
        ):  # fmt: skip
            table.add_column(name, justify="right")
        for timing in (t for t in timings if t.size == size):
            if timing.missing:
                table.add_row(timing.method, timing.missing)
                continue
            paper = PAPER_FPS.get(timing.method)
            table.add_row(
                timing.method,
                f"{timing.median_ms:.2f}",
                f"{np.quantile(timing.ms, 0.95):.2f}",
                *(f"{timing.of_level(name):.2f}" for name in LEVEL_NAMES),
                f"{timing.median_units:.2f}",
                f"{1e3 / timing.median_ms:.0f}",
                f"{timing.fps_all:.0f}" if timing.fps_all else "-",
                f"{paper[0]:.0f} {paper[1]:.0f}" if paper else "",
                end_section=timing.method in (UNIT, METHODS[-1], list(BASELINES)[-1]),
            )
        console.print(table)
