"""Detected lines against labelled ones: who matches whom, and the errors in numbers.

A detection matches a labelled line when the middle of the label's visible span lies within
`Gate.across` image widths of it and their directions differ by less than `Gate.angle_rad`; the nearest
pair first, each at most once.  The errors are those of the paper's Table II: |rho| in pixels, about the
image centre, and |theta|.

A line of which something hides the middle is labelled as two stretches.  Where one label continues the
other's band, a detection that is `found` within FOUND_ACROSS and FOUND_ANGLE_RAD of both finds both: it is
one line.  Labels that lie side by side are two lines, and each needs a detection of its own.

What is left of the `main` labels is missed.  What is left of the detections is false, unless it lies on
a `minor` label, or the picture is not `complete`.  Nodes match within the same distance; `bend`s are
ignored.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from flightd.core.geometry import wrap_half_pi
from flightd.core.types import Junction, JunctionKind, Line, LineSet
from flightd.vision.training.labelled_frames import LabelledImage, LabelledLine

NODE_KINDS = {
    "+": JunctionKind.CROSS,
    "T": JunctionKind.TEE,
    "L": JunctionKind.CORNER,
    "end": JunctionKind.END,
}

FOUND_ACROSS, FOUND_ANGLE_RAD = 0.02, math.radians(3.0)
"""A dominant line counts as found when rho is within this part of the image width and theta within this."""


@dataclass(frozen=True, slots=True)
class Gate:
    """How far apart a detection and a label may be and still be the same line."""

    across: float = 0.05
    angle_rad: float = math.radians(5.0)


@dataclass(frozen=True, slots=True)
class LineError:
    """One matched pair: absolute errors, and the errors in units of what the detector's sigma and the doubt
    of the label itself (`uncert_px`, `uncert_deg`) come to."""

    rho_px: float
    theta_rad: float
    rho_sigmas: float
    theta_sigmas: float
    found: bool


@dataclass(slots=True)
class LineScore:
    """Sums over pictures; `add` one after the other, then read the statistics."""

    errors: list[LineError] = field(default_factory=list)
    labelled: int = 0
    missed: int = 0
    false: int = 0
    detected: int = 0
    negatives: int = 0
    negatives_clean: int = 0
    nodes_labelled: int = 0
    nodes_found: int = 0
    nodes_named: int = 0
    nodes_detected: int = 0
    nodes_false: int = 0
    ms: list[float] = field(default_factory=list)

    @property
    def missed_part(self) -> float:
        """Missed part of the dominant lines."""
        return self.missed / max(self.labelled, 1)

    @property
    def false_part(self) -> float:
        """False part of all detections that could be judged."""
        return self.false / max(self.detected, 1)

    @property
    def found_part(self) -> float:
        """Part of the dominant lines within FOUND_ACROSS and FOUND_ANGLE_RAD."""
        return sum(error.found for error in self.errors) / max(self.labelled, 1)

    def rho_px(self) -> NDArray[np.float64]:
        return np.array([error.rho_px for error in self.errors])

    def theta_rad(self) -> NDArray[np.float64]:
        return np.array([error.theta_rad for error in self.errors])

    def sigma_ratios(self) -> tuple[float, float]:
        """Spread of the errors in units of the sigmas (rho, theta), robust: 1 is calibrated."""
        if not self.errors:
            return math.nan, math.nan
        rho = float(np.median([error.rho_sigmas for error in self.errors]))
        theta = float(np.median([error.theta_sigmas for error in self.errors]))
        return rho / _HALF_NORMAL_MEDIAN, theta / _HALF_NORMAL_MEDIAN

    def within_sigma_parts(self) -> tuple[float, float]:
        """Part of the errors within one sigma (rho, theta); 0.683 where errors are normal and sigmas true."""
        if not self.errors:
            return math.nan, math.nan
        rho = sum(error.rho_sigmas <= 1.0 for error in self.errors)
        theta = sum(error.theta_sigmas <= 1.0 for error in self.errors)
        return rho / len(self.errors), theta / len(self.errors)


_HALF_NORMAL_MEDIAN = 0.6745


@dataclass(frozen=True, slots=True)
class PictureScore:
    """What came of one picture: indices into the labels' and the detections' lines."""

    errors: tuple[LineError, ...]
    missed: tuple[int, ...]
    false: tuple[int, ...]


def score_picture(score: LineScore, label: LabelledImage, found: LineSet, gate: Gate) -> PictureScore:
    """Add one picture to `score`, and say which labels were missed and which detections are false."""
    width, height = found.width_px, found.height_px
    main = [line for line in label.lines if line.grade == "main"]
    matched = _match(main, found.lines, width, height, gate)
    pairs = matched + _stretches(main, found.lines, matched, width, height)
    errors = tuple(_error(main[i], found.lines[j], width, height) for i, j in pairs)
    missed = tuple(sorted(set(range(len(main))) - {i for i, _ in pairs}))
    spare = sorted(set(range(len(found.lines))) - {j for _, j in pairs})
    minor = [line for line in label.lines if line.grade == "minor"]
    doubtful = {j for j in spare if any(_cost(m, found.lines[j], width, height, gate) < 1.0 for m in minor)}
    false = tuple(j for j in spare if j not in doubtful) if label.complete else ()

    score.errors.extend(errors)
    score.labelled += len(main)
    score.missed += len(missed)
    if label.complete:
        score.detected += len(found.lines) - len(doubtful)
        score.false += len(false)
    if label.negative:
        score.negatives += 1
        score.negatives_clean += not found.lines
    _score_nodes(score, label, found.junctions, width, height, gate)
    return PictureScore(errors, missed, false)


def _match(
    labels: Sequence[LabelledLine], lines: Sequence[Line], width: int, height: int, gate: Gate
) -> list[tuple[int, int]]:
    costs = sorted(
        (_cost(label, line, width, height, gate), i, j)
        for i, label in enumerate(labels)
        for j, line in enumerate(lines)
    )
    return _nearest_first(costs)


def _stretches(
    labels: Sequence[LabelledLine],
    lines: Sequence[Line],
    pairs: Sequence[tuple[int, int]],
    width: int,
    height: int,
) -> list[tuple[int, int]]:
    """Labels that no detection of their own matched, with the one that found the line they continue."""
    more: list[tuple[int, int]] = []
    for i in sorted(set(range(len(labels))) - {i for i, _ in pairs}):
        for k, j in pairs:
            both = (_error(labels[other], lines[j], width, height).found for other in (i, k))
            if all(both) and _continues(labels[i], labels[k], width, height):
                more.append((i, j))
                break
    return more


def _continues(one: LabelledLine, other: LabelledLine, width: int, height: int) -> bool:
    """Whether two labels are stretches of one straight band: each prolonged meets the other's paint."""
    turn = wrap_half_pi(one.hessian(width, height)[1] - other.hessian(width, height)[1])
    reach_px = max(one.thickness, other.thickness) / 2
    return abs(turn) <= FOUND_ANGLE_RAD and _meets(one, other, reach_px) and _meets(other, one, reach_px)


def _meets(line: LabelledLine, stretch: LabelledLine, reach_px: float) -> bool:
    """Whether `stretch` lies wholly before or beyond `line`, and begins within reach of `line` prolonged."""
    length = max(line.length_px, 1e-9)
    dx, dy = (line.x2 - line.x1) / length, (line.y2 - line.y1) / length
    ends = ((stretch.x1 - line.x1, stretch.y1 - line.y1), (stretch.x2 - line.x1, stretch.y2 - line.y1))
    (near, off), (far, _) = sorted(
        ((x * dx + y * dy, abs(x * dy - y * dx)) for x, y in ends), key=lambda end: abs(end[0] - length / 2)
    )
    beyond = min(near, far) >= length or max(near, far) <= 0.0
    return beyond and off <= reach_px


def _nearest_first(costs: Iterable[tuple[float, int, int]]) -> list[tuple[int, int]]:
    pairs: list[tuple[int, int]] = []
    for cost, i, j in costs:
        if cost < 1.0 and all(i != a and j != b for a, b in pairs):
            pairs.append((i, j))
    return pairs


def _cost(label: LabelledLine, line: Line, width: int, height: int, gate: Gate) -> float:
    """0 for the same line, 1 at the gate's edge, infinite beyond."""
    x = (label.x1 + label.x2) / 2 - (width - 1) / 2
    y = (label.y1 + label.y2) / 2 - (height - 1) / 2
    across = abs(x * math.cos(line.theta_rad) + y * math.sin(line.theta_rad) - line.rho_px)
    angle = abs(wrap_half_pi(line.theta_rad - label.hessian(width, height)[1]))
    far, turned = across / (gate.across * width), angle / gate.angle_rad
    return math.hypot(far, turned) / math.sqrt(2) if max(far, turned) < 1.0 else math.inf


def _error(label: LabelledLine, line: Line, width: int, height: int) -> LineError:
    rho, theta = label.hessian(width, height)
    sign = 1.0 if math.cos(line.theta_rad - theta) >= 0 else -1.0
    rho_error = abs(sign * line.rho_px - rho)
    theta_error = abs(wrap_half_pi(line.theta_rad - theta))
    return LineError(
        rho_error,
        theta_error,
        rho_error / max(math.hypot(line.sigma_rho_px, label.uncert_px), 1e-9),
        theta_error / max(math.hypot(line.sigma_theta_rad, math.radians(label.uncert_deg)), 1e-9),
        rho_error <= FOUND_ACROSS * width and theta_error <= FOUND_ANGLE_RAD,
    )


def _score_nodes(
    score: LineScore, label: LabelledImage, found: Sequence[Junction], width: int, height: int, gate: Gate
) -> None:
    """Nodes count only where every line is labelled; where two meet within the gate, nearest first."""
    if not label.complete:
        return
    nodes = [node for node in label.nodes if node.kind in NODE_KINDS]
    reach = gate.across * width
    costs = sorted(
        (_distance(node.x, node.y, other, width, height) / reach, i, j)
        for i, node in enumerate(nodes)
        for j, other in enumerate(found)
    )
    pairs = _nearest_first(costs)
    ignored = {
        j
        for j, other in enumerate(found)
        for node in label.nodes
        if node.kind == "bend" and _distance(node.x, node.y, other, width, height) < reach
    }
    score.nodes_labelled += len(nodes)
    score.nodes_found += len(pairs)
    score.nodes_named += sum(NODE_KINDS[nodes[i].kind] == found[j].kind for i, j in pairs)
    judged = len(set(range(len(found))) - ignored)
    score.nodes_detected += judged
    score.nodes_false += max(judged - len(pairs), 0)


def _distance(x: float, y: float, junction: Junction, width: int, height: int) -> float:
    return math.hypot(x - (width - 1) / 2 - junction.x_px, y - (height - 1) / 2 - junction.y_px)
