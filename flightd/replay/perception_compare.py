"""Look at a flight's recorded pictures again with today's detector and compare what is seen.

The pictures were compressed after the daemon looked at them, so lines move by a little even where
nothing changed; a line that comes or goes is a change of behaviour.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np

from flightd.core.geometry import wrap_half_pi
from flightd.core.topics import RecordedFrame, Topic
from flightd.core.types import Image, Line, LineSet
from flightd.replay.log import LogReader, read_log
from flightd.vision.jpeg import decoded_jpeg

Detect: TypeAlias = Callable[[Image, int, int], LineSet]
"""Picture, frame number and stamp to lines."""

_GATE_PX = 20.0
_GATE_RAD = math.radians(5.0)
"""Lines farther apart than this are not the same."""

_CHANGED = 0.02
"""Share of lines at the edge of being seen, which the compression may tip over."""
_CHANCE_SIGMAS = 2.0
"""Room for chance where few lines are compared: how many tip over is counted, so it varies by its root."""


@dataclass(frozen=True, slots=True)
class PerceptionDrift:
    """`gone` lines were recorded and are not found again, `new` ones the other way round; the rest are
    pairs, whose differences are told as 95th percentile and largest (0 without pairs)."""

    pictures: int
    pairs: int
    gone: int
    new: int
    rho_p95_px: float
    rho_max_px: float
    theta_p95_deg: float
    theta_max_deg: float

    @property
    def may_tip(self) -> int:
        """How many lines may come or go without anything having changed."""
        tipped = _CHANGED * max(self.pairs, 1)
        return math.floor(tipped + _CHANCE_SIGMAS * math.sqrt(tipped))

    def within(self, tolerance_px: float) -> bool:
        """Whether lines moved by no more than `tolerance_px` (95 of 100) and hardly any came or went."""
        return not self.complaint(tolerance_px)

    def complaint(self, tolerance_px: float) -> str:
        """What is seen differently, with the figure that says so and the one allowed; empty for nothing."""
        found = []
        if self.rho_p95_px > tolerance_px:
            found.append(f"95 % of the lines within {self.rho_p95_px:.3f} px, {tolerance_px:g} allowed")
        if self.gone + self.new > self.may_tip:
            found.append(f"{self.gone + self.new} lines gone or new, {self.may_tip} allowed")
        return "; ".join(found)


def replay_pictures(path: Path, detect: Detect, every: int = 1) -> PerceptionDrift:
    """Run `detect` on every recorded picture whose lines were recorded too, or each `every`-th of them.
    InputError as `read_log`."""
    recorded = {lines.frame_seq: lines for lines in read_log(path, {Topic.LINES}).messages(LineSet)}
    seen = pictures = gone = new = 0
    differences: list[tuple[float, float]] = []
    for entry in LogReader(path).entries({Topic.FRAME}):
        picture = entry.message
        before = recorded.get(picture.seq) if isinstance(picture, RecordedFrame) else None
        if before is None or not isinstance(picture, RecordedFrame):
            continue
        seen += 1
        if seen % every:
            continue
        image = decoded_jpeg(picture.jpeg)
        if image is None or (image.shape[1], image.shape[0]) != (before.width_px, before.height_px):
            continue
        after = detect(image, picture.seq, picture.stamp_ns)
        pairs = _pairs(before.lines, after.lines)
        pictures += 1
        gone += len(before.lines) - len(pairs)
        new += len(after.lines) - len(pairs)
        differences += pairs
    rho_px, theta_rad = np.array(differences, np.float64).reshape(-1, 2).T
    return PerceptionDrift(
        pictures, len(differences), gone, new, *_spread(rho_px), *_spread(np.degrees(theta_rad))
    )


def _spread(values: np.ndarray) -> tuple[float, float]:
    if not len(values):
        return 0.0, 0.0
    return float(np.percentile(values, 95)), float(values.max())


def _pairs(before: Iterable[Line], after: Iterable[Line]) -> list[tuple[float, float]]:
    """|difference| in rho and theta of the lines that are the same, nearest first."""
    rest = list(after)
    pairs = []
    for line in before:
        apart = [_apart(line, other) for other in rest]
        near = [i for i, (rho, theta) in enumerate(apart) if rho < _GATE_PX and theta < _GATE_RAD]
        if near:
            nearest = min(near, key=lambda i: apart[i][0])
            pairs.append(apart[nearest])
            del rest[nearest]
    return pairs


def _apart(a: Line, b: Line) -> tuple[float, float]:
    """|difference| in rho (px, in the middle of the picture) and theta (rad); theta is modulo pi."""
    flipped = abs(a.theta_rad - b.theta_rad) > math.pi / 2
    rho = abs(a.rho_px + b.rho_px) if flipped else abs(a.rho_px - b.rho_px)
    return rho, abs(wrap_half_pi(a.theta_rad - b.theta_rad))
