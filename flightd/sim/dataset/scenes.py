"""Random arrangements of painted lines in a picture, with their exact truth.

A scene is drawn in the picture's plane: straight bands given by centre line, thickness and span, and
arcs.  Lengths are pixels about the image centre, x right, y down.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from flightd.vision.training.labelled_frames import LabelledLine, LabelledNode, NodeKind

Layout = Literal["single", "parallel", "cross", "grid", "tee", "corner", "end", "curve", "negative"]
LAYOUTS: tuple[Layout, ...] = get_args(Layout)
_LAYOUT_WEIGHTS = (0.17, 0.13, 0.16, 0.12, 0.11, 0.10, 0.07, 0.06, 0.08)

THICKNESS_PX = (6.0, 200.0)
"""Range of line thickness in a picture 1920 wide; the upper end scales with the width."""

FAR = 1e5
"""Where a band that goes on beyond the picture starts and ends."""


@dataclass(frozen=True, slots=True)
class SceneBand:
    """A straight band of paint: x cos(theta) + y sin(theta) = rho, from `start` to `end` along
    (-sin(theta), cos(theta)); its half width grows by `taper` per pixel along it (perspective)."""

    rho: float
    theta: float
    thickness: float
    start: float = -FAR
    end: float = FAR
    taper: float = 0.0

    def point(self, along: float) -> tuple[float, float]:
        c, s = math.cos(self.theta), math.sin(self.theta)
        return self.rho * c - along * s, self.rho * s + along * c

    def along(self, x: float, y: float) -> float:
        return -x * math.sin(self.theta) + y * math.cos(self.theta)


@dataclass(frozen=True, slots=True)
class Arc:
    """A curved band: centre, radius of the centre line, and the angles it covers (end > start)."""

    x: float
    y: float
    radius: float
    thickness: float
    start: float
    end: float


@dataclass(frozen=True, slots=True)
class Scene:
    width: int
    height: int
    layout: Layout
    bands: tuple[SceneBand, ...] = ()
    arcs: tuple[Arc, ...] = ()


def random_scene(
    rng: np.random.Generator, width: int, height: int, layout: Layout | None = None, taper: float = 0.0
) -> Scene:
    """A scene of the given (or a random) layout in which every line is clearly visible."""
    if layout is None:
        layout = LAYOUTS[int(rng.choice(len(LAYOUTS), p=_LAYOUT_WEIGHTS))]
    for _ in range(1000):
        scene = _propose(rng, width, height, layout)
        if taper:
            grown = tuple(replace(band, taper=rng.uniform(-taper, taper) / width) for band in scene.bands)
            scene = replace(scene, bands=grown)
        lines = truth_lines(scene)
        if len(lines) == len(scene.bands) and all(line.grade == "main" for line in lines):
            return scene
    raise ValueError(f"no {layout} scene fits in {width}x{height}")


def _propose(rng: np.random.Generator, width: int, height: int, layout: Layout) -> Scene:
    scale = width / 1920
    upper = max(THICKNESS_PX[1] * scale, 2 * THICKNESS_PX[0])
    narrow = layout in ("parallel", "grid")
    thickness = _log_uniform(rng, THICKNESS_PX[0], upper / 2 if narrow else upper)
    theta = rng.uniform(0, math.pi)
    x, y = rng.uniform(-0.33, 0.33) * width, rng.uniform(-0.33, 0.33) * height
    main = _band_through(x, y, theta, thickness)
    other_thickness = thickness * rng.uniform(0.6, 1.4) if rng.random() < 0.4 else thickness
    other_thickness = min(max(other_thickness, THICKNESS_PX[0]), upper)
    across = theta + math.pi / 2 + rng.normal(0, math.radians(4)) * (rng.random() < 0.5)
    other = _band_through(x, y, across, other_thickness)
    spacing = thickness + max(rng.uniform(1.0, 3.0) * thickness, rng.uniform(0.04, 0.15) * width)
    bands: tuple[SceneBand, ...]
    arcs: tuple[Arc, ...] = ()
    match layout:
        case "single":
            bands = (main,)
        case "parallel":
            count = int(rng.integers(2, 4))
            bands = tuple(replace(main, rho=main.rho + i * spacing) for i in range(count))
        case "cross":
            bands = (main, other)
        case "grid":
            bands = (main, replace(main, rho=main.rho + spacing), other)
        case "tee":
            bands = (main, replace(other, start=other.along(x, y)))
        case "corner":
            outer = main.along(x, y) - other_thickness / 2
            bands = (replace(main, start=outer), replace(other, start=other.along(x, y) - thickness / 2))
        case "end":
            bands = (replace(main, start=main.along(x, y)),)
        case "curve":
            bands = (main,) if rng.random() < 0.3 else ()
            arcs = (_random_arc(rng, width, height, thickness),)
        case "negative":
            bands = ()
    return Scene(width, height, layout, bands, arcs)


def _band_through(x: float, y: float, theta: float, thickness: float) -> SceneBand:
    return SceneBand(x * math.cos(theta) + y * math.sin(theta), theta, thickness)


def _random_arc(rng: np.random.Generator, width: int, height: int, thickness: float) -> Arc:
    """An arc so strongly curved that no stretch of it passes for a straight line."""
    radius = rng.uniform(0.15, 0.4) * height + thickness
    start = rng.uniform(0, math.tau)
    x, y = rng.uniform(-0.25, 0.25) * width, rng.uniform(-0.25, 0.25) * height
    return Arc(x, y, radius, min(thickness, radius / 3), start, start + rng.uniform(0.7, 1.6) * math.pi)


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def visible_span(band: SceneBand, width: int, height: int, offset: float = 0.0) -> tuple[float, float] | None:
    """Where the line `offset` beside the centre line runs inside the picture (its pixels' area)."""
    start, end = band.start, band.end
    x0, y0 = band.point(0.0)
    c, s = math.cos(band.theta), math.sin(band.theta)
    x0, y0 = x0 + offset * c, y0 + offset * s
    for origin, step, limit in ((x0, -s, width / 2), (y0, c, height / 2)):
        if abs(step) < 1e-12:
            if abs(origin) > limit:
                return None
            continue
        first, last = sorted(((-limit - origin) / step, (limit - origin) / step))
        start, end = max(start, first), min(end, last)
    return (start, end) if end > start else None


def truth_lines(scene: Scene) -> list[LabelledLine]:
    """The scene's straight lines in pixel coordinates.

    `main` where both edges run through the picture for a good length, else `minor`.
    """
    lines = []
    for band in scene.bands:
        span = visible_span(band, scene.width, scene.height)
        if span is None:
            continue
        half = band.thickness / 2
        edges = [visible_span(band, scene.width, scene.height, side * half) for side in (-1, 1)]
        both = min((e[1] for e in edges if e), default=0.0) - max((e[0] for e in edges if e), default=0.0)
        clear = all(edges) and both >= max(0.15 * scene.width, 2.0 * band.thickness)
        (x1, y1), (x2, y2) = (to_pixel(scene, *band.point(t)) for t in span)
        lines.append(
            LabelledLine(
                x1=x1, y1=y1, x2=x2, y2=y2, thickness=band.thickness, grade="main" if clear else "minor"
            )
        )
    return lines


def truth_nodes(scene: Scene) -> list[LabelledNode]:
    """Crossings, tees, corners and ends whose centre lies inside the picture."""
    nodes = []
    met: set[tuple[int, float]] = set()
    for i, first in enumerate(scene.bands):
        for j, second in enumerate(scene.bands[i + 1 :], i + 1):
            point = intersection(first, second)
            if point is None or not _inside(scene, *point):
                continue
            arms = [
                _arms(band, band.along(*point), reach.thickness)
                for band, reach in ((first, second), (second, first))
            ]
            if 0 in arms or not (_reaches(first, point, second) and _reaches(second, point, first)):
                continue
            kind: NodeKind = {4: "+", 3: "T", 2: "L"}[sum(arms)]  # type: ignore[assignment]
            met.update(
                (k, _nearest_end(band, band.along(*point)))
                for k, band, arm in ((i, first, arms[0]), (j, second, arms[1]))
                if arm == 1
            )
            x, y = to_pixel(scene, *point)
            nodes.append(LabelledNode(x=x, y=y, kind=kind))
    for i, band in enumerate(scene.bands):
        for end in _ends(band):
            if (i, end) not in met and _inside(scene, *band.point(end)):
                x, y = to_pixel(scene, *band.point(end))
                nodes.append(LabelledNode(x=x, y=y, kind="end"))
    return nodes


def intersection(first: SceneBand, second: SceneBand) -> tuple[float, float] | None:
    """Where two centre lines meet, about the image centre; None for parallels."""
    sine = math.sin(second.theta - first.theta)
    if abs(sine) < 1e-3:
        return None
    x = (first.rho * math.sin(second.theta) - second.rho * math.sin(first.theta)) / sine
    y = (second.rho * math.cos(first.theta) - first.rho * math.cos(second.theta)) / sine
    return x, y


def to_pixel(scene: Scene, x: float, y: float) -> tuple[float, float]:
    """Pixel coordinates (origin at the centre of the top-left pixel) of a point about the centre."""
    return x + (scene.width - 1) / 2, y + (scene.height - 1) / 2


def _arms(band: SceneBand, along: float, reach: float) -> int:
    """In how many directions the band leaves a node that another band of thickness `reach` covers."""
    before, after = along - band.start > reach, band.end - along > reach
    return int(before) + int(after)


def _ends(band: SceneBand) -> list[float]:
    """Where, along it, the band ends: not far out of the picture."""
    return [end for end in (band.start, band.end) if abs(end) < FAR]


def _nearest_end(band: SceneBand, along: float) -> float:
    return min(_ends(band), key=lambda end: abs(end - along))


def _reaches(band: SceneBand, point: tuple[float, float], other: SceneBand) -> bool:
    """Whether the band gets as far as the paint of another that it crosses in `point`."""
    return band.start - other.thickness < band.along(*point) < band.end + other.thickness


def _inside(scene: Scene, x: float, y: float) -> bool:
    return abs(x) < scene.width / 2 and abs(y) < scene.height / 2
