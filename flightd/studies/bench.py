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
from itertools import cycle
from multiprocessing import get_context
from time import perf_counter, thread_time
from typing import TypeAlias

import cv2
import numpy as np
from rich.console import Console
from rich.table import Table

from flightd import __version__
from flightd.core.errors import UnavailableError
from flightd.core.types import Image
from flightd.runtime.undisturbed_start import undisturbed
from flightd.sim.dataset.generate import generate
from flightd.studies.baselines import BASELINES
from flightd.studies.progress_bar import track
from flightd.vision.line_detector import METHODS, Detector

SIZES = ((1920, 1080), (640, 360))
LEVEL, FIRST_SEED, FRAMES = "perturbed", 700, 6
UNIT = "cvtColor"
_SETTLE_S = 0.01

PAPER_FPS = {"centroid": (4.23, 15.10), "skeleton": (8.93, 20.0)}
"""Frames a second of the paper's Table I: on board (Raspberry Pi 3) and off board (Core i7, 4 cores)."""

Finder: TypeAlias = Callable[[Image], object]


@dataclass(slots=True)
class Timing:
    """One method on frames of one size."""

    method: str
    size: tuple[int, int]
    baseline: bool
    ms: list[float] = field(default_factory=list)
    fps_all: float = 0.0
    missing: str = ""

    @property
    def median_ms(self) -> float:
        return float(np.median(self.ms)) if self.ms else float("nan")


def finder(method: str) -> Finder:
    """The function that a row of the table times."""
    if method == UNIT:
        return lambda bgr: cv2.cvtColor(bgr, cv2.COLOR_BGR2HSV)
    if method in BASELINES:
        return BASELINES[method]
    return Detector(method, "yellow").detect


def frames_of(size: tuple[int, int]) -> list[Image]:
    """The frames that are timed: yellow lines, level `perturbed`, always the same."""
    layouts = ("single", "parallel", "cross", "grid", "tee", "corner")
    return [
        generate(LEVEL, FIRST_SEED + i, *size, colour="yellow", layout=layouts[i % len(layouts)]).bgr  # type: ignore[arg-type]
        for i in range(FRAMES)
    ]


def bench(seconds: float, sizes: Sequence[tuple[int, int]] = SIZES, all_cores: bool = True) -> list[Timing]:
    """Time every method for about `seconds` on one core, and again on all cores at once."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        timings = []
        for size in sizes:
            timings += _one_core(size, seconds)
        if all_cores:
            _all_cores(timings, seconds)
        return timings
    finally:
        cv2.setNumThreads(threads)


def _one_core(size: tuple[int, int], seconds: float) -> list[Timing]:
    """Rounds in which every method in turn takes all frames, one right after another, so that a busy moment
    strikes all alike.  Each turn begins with some milliseconds that are not counted: they pay for what the
    one before has left in the caches, and the figures are those of a method at work on frame after frame.
    Lines and junctions only, without what a flight asks of a frame besides.

    Processor time of the one thread at work, which other programs on the machine hardly touch.
    """
    frames = frames_of(size)
    timings = [Timing(name, size, False) for name in (UNIT, *METHODS)]
    timings += [Timing(name, size, True) for name in BASELINES]
    finders: dict[str, Finder] = {}
    for timing in timings:
        try:
            finders[timing.method] = finder(timing.method)
            finders[timing.method](frames[0])
        except UnavailableError as err:
            timing.missing = str(err)
    spent = dict.fromkeys(finders, 0.0)
    rounds = max(round(seconds * 100 / FRAMES), 2)
    for _ in track(range(rounds), f"one core, {size[0]}x{size[1]}"):
        for timing in timings:
            if timing.missing or (spent[timing.method] > seconds and len(timing.ms) >= 2 * FRAMES):
                continue
            find, settled = finders[timing.method], thread_time() + _SETTLE_S
            for bgr in cycle(frames):
                find(bgr)
                if thread_time() >= settled:
                    break
            for bgr in frames:
                start = thread_time()
                find(bgr)
                elapsed = thread_time() - start
                timing.ms.append(elapsed * 1e3)
                spent[timing.method] += elapsed
    return timings


_worker_frames: dict[tuple[int, int], list[Image]] = {}


def _start_worker(sizes: Sequence[tuple[int, int]]) -> None:
    cv2.setNumThreads(1)
    for size in sizes:
        _worker_frames[size] = frames_of(size)


def _rate(method: str, size: tuple[int, int], seconds: float) -> float:
    """Frames a second of this worker over `seconds`."""
    find, frames = finder(method), _worker_frames[size]
    find(frames[0])
    start, count = perf_counter(), 0
    while perf_counter() - start < seconds:
        find(frames[count % len(frames)])
        count += 1
    return count / (perf_counter() - start)


def _all_cores(timings: Sequence[Timing], seconds: float) -> None:
    """One process to a core, as the daemon runs its detectors, all at the same method at once."""
    cores = os.cpu_count() or 1
    sizes = sorted({timing.size for timing in timings})
    with ProcessPoolExecutor(cores, get_context("spawn"), _start_worker, (sizes,)) as pool:
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


def _unit_ms(timings: Sequence[Timing], size: tuple[int, int]) -> float:
    return next(t.median_ms for t in timings if t.method == UNIT and t.size == size)


def as_json(timings: Sequence[Timing]) -> str:
    """The one JSON document of `flightd bench --json`."""
    rows = []
    for timing in timings:
        unit = _unit_ms(timings, timing.size)
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
                "cvtcolor_units": round(timing.median_ms / unit, 3),
            }
        if timing.method in PAPER_FPS:
            row["paper_fps"] = dict(zip(("on_board", "off_board"), PAPER_FPS[timing.method], strict=True))
        rows.append(row)
    return json.dumps({"machine": machine(), "level": LEVEL, "results": rows}, indent=1)


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
        for name in ("ms", "/ cvtColor", "fps, one core", "fps, all cores", "paper fps\non off board"):
            table.add_column(name, justify="right")
        for timing in (t for t in timings if t.size == size):
            if timing.missing:
                table.add_row(timing.method, timing.missing)
                continue
            paper = PAPER_FPS.get(timing.method)
            table.add_row(
                timing.method,
                f"{timing.median_ms:.2f}",
                f"{timing.median_ms / _unit_ms(timings, size):.2f}",
                f"{1e3 / timing.median_ms:.0f}",
                f"{timing.fps_all:.0f}" if timing.fps_all else "-",
                f"{paper[0]:.0f} {paper[1]:.0f}" if paper else "",
                end_section=timing.method in (UNIT, METHODS[-1]),
            )
        console.print(table)
