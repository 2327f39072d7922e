"""The paper's Table II on any labelled folder: every method against the same labels."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import cv2
import numpy as np
from rich.console import Console
from rich.table import Table

from flightd.core.errors import InputError
from flightd.core.types import Image, LineSet
from flightd.studies.frame_files import read_image
from flightd.studies.overlay import draw_judged
from flightd.studies.progress_bar import track
from flightd.vision.line_detector import Detector
from flightd.vision.lines.colour_profile import SHIPPED
from flightd.vision.training.labelled_frames import LabelledImage, Labels, read_labels
from flightd.vision.training.line_score import Gate, LineScore, score_picture

PAPER = {
    "naive": {"simulation": (56.0, 3.0), "real": (78.0, 12.0)},
    "centroid": {"simulation": (10.0, 3.0), "real": (18.0, 5.0)},
    "skeleton": {"simulation": (5.0, 4.0), "real": (15.0, 10.0)},
    "combined": {"simulation": (6.0, 3.0), "real": (16.0, 7.0)},
}
"""Mean errors (px, degrees) of the paper's Table II, on 50 simulated and 50 real images of 1920x1080."""


@dataclass(frozen=True, slots=True)
class LightLevel:
    """Another light for every picture: all channels times `exposure`, red over blue times `warmth`; what
    goes beyond the sensor's range is cut off."""

    exposure: float = 1.0
    warmth: float = 1.0

    def on(self, bgr: Image) -> Image:
        """The picture under this light."""
        if self.exposure == self.warmth == 1.0:
            return bgr
        lean = math.sqrt(self.warmth)
        gains = (self.exposure / lean, self.exposure, self.exposure * lean)
        return np.dstack([cv2.convertScaleAbs(bgr[..., k], alpha=gain) for k, gain in enumerate(gains)])


@dataclass(frozen=True, slots=True)
class Failure:
    """A picture on which a method missed a line or saw one too many."""

    path: str
    method: str
    missed: int
    false: int


def evaluate(
    dataset: Path,
    methods: Sequence[str],
    profile: str | None,
    gate: Gate,
    overlay: Path | None,
    light: LightLevel = LightLevel(),
) -> tuple[dict[str, LineScore], list[Failure], int]:
    """Scores by method, the failures, and the number of pictures of `dataset`.

    Without `profile` each picture is searched for the colour its label tells; where that is "none" (a
    negative), for every colour of the dataset in turn, and a line of any colour is false.
    """
    folder, labels = read_labels(dataset)
    usual = _usual_colours(labels)
    detectors: dict[tuple[str, str], Detector] = {}
    scores = {method: LineScore() for method in methods}
    failures = []
    for label in track(labels.images, "evaluating"):
        path = folder / label.file
        bgr = light.on(read_image(path))
        _check_size(path, bgr, label)
        for method in methods:
            names = (profile,) if profile else _colours(label, usual)
            for name in names:
                if (method, name) not in detectors:
                    detectors[method, name] = Detector(method, name)
            found, ms = _detect([detectors[method, name] for name in names], bgr, path)
            score = scores[method]
            score.ms.append(ms)
            judged = score_picture(score, label, found, gate)
            if judged.missed or judged.false:
                failures.append(Failure(str(path), method, len(judged.missed), len(judged.false)))
                if overlay:
                    draw_judged(overlay / f"{path.stem}-{method}.jpg", bgr, label, found, judged)
    return scores, failures, len(labels.images)


def _usual_colours(labels: Labels) -> tuple[str, ...]:
    told = {name for image in labels.images for name in image.line_colour.split("/") if name in SHIPPED}
    return tuple(sorted(told)) or ("yellow",)


def _colours(label: LabelledImage, usual: tuple[str, ...]) -> tuple[str, ...]:
    told = tuple(name for name in label.line_colour.split("/") if name in SHIPPED)
    return told or usual


def _check_size(path: Path, bgr: Image, label: LabelledImage) -> None:
    size = (bgr.shape[1], bgr.shape[0])
    if label.width and label.height and size != (label.width, label.height):
        raise InputError(f"is {size[0]}x{size[1]}, its label says {label.width}x{label.height}", file=path)


def _detect(detectors: Sequence[Detector], bgr: Image, path: Path) -> tuple[LineSet, float]:
    """All detectors' findings as one, and the mean time of a detector in ms."""
    start = perf_counter()
    try:
        sets = [detector.detect(bgr) for detector in detectors]
    except InputError as err:
        raise InputError(str(err), file=path) from err
    ms = (perf_counter() - start) * 1e3 / len(sets)
    first = sets[0]
    lines = tuple(line for found in sets for line in found.lines)
    junctions = tuple(junction for found in sets for junction in found.junctions)
    together = LineSet(0, 0, first.width_px, first.height_px, lines, junctions, first.method)
    return together, ms


def summary(score: LineScore) -> dict[str, float | int | None]:
    """The numbers of one method; None where nothing was matched."""
    rho, theta = score.rho_px(), np.degrees(score.theta_rad())
    sigma_rho, sigma_theta = score.sigma_ratios()
    within_rho, within_theta = score.within_sigma_parts()
    return {
        "rho_mean_px": _number(rho.mean() if rho.size else math.nan),
        "rho_median_px": _number(_quantile(rho, 0.5)),
        "rho_p95_px": _number(_quantile(rho, 0.95)),
        "theta_mean_deg": _number(theta.mean() if theta.size else math.nan),
        "theta_median_deg": _number(_quantile(theta, 0.5)),
        "theta_p95_deg": _number(_quantile(theta, 0.95)),
        "lines": score.labelled,
        "missed": score.missed,
        "missed_part": _number(score.missed_part),
        "found_part": _number(score.found_part),
        "detections": score.detected,
        "false": score.false,
        "false_part": _number(score.false_part),
        "negatives": score.negatives,
        "negatives_clean": score.negatives_clean,
        "nodes": score.nodes_labelled,
        "nodes_found": score.nodes_found,
        "nodes_named": score.nodes_named,
        "nodes_detected": score.nodes_detected,
        "nodes_false": score.nodes_false,
        "sigma_rho_ratio": _number(sigma_rho),
        "sigma_theta_ratio": _number(sigma_theta),
        "within_sigma_rho_part": _number(within_rho),
        "within_sigma_theta_part": _number(within_theta),
        "ms_median": _number(_quantile(np.array(score.ms), 0.5)),
    }


def _quantile(values: np.ndarray[tuple[int], np.dtype[np.float64]], share: float) -> float:
    return float(np.quantile(values, share)) if values.size else math.nan


def _number(value: float) -> float | None:
    return None if math.isnan(value) else round(float(value), 5)


def as_json(
    dataset: Path, gate: Gate, scores: dict[str, LineScore], failures: Iterable[Failure], count: int
) -> str:
    """The one JSON document of `flightd evaluate --json`."""
    document = {
        "dataset": str(dataset),
        "pictures": count,
        "gate": {"rho_part_of_width": gate.across, "theta_deg": round(math.degrees(gate.angle_rad), 6)},
        "methods": {
            method: summary(score)
            | {
                "paper": {
                    where: {"rho_mean_px": r, "theta_mean_deg": t} for where, (r, t) in PAPER[method].items()
                }
            }
            for method, score in scores.items()
        },
        "failures": [
            {"path": f.path, "method": f.method, "missed": f.missed, "false": f.false} for f in failures
        ],
    }
    return json.dumps(document, indent=1)


_COLUMNS = (
    "rho px\nmean", "\nmedian", "\np95", "theta °\nmean", "\nmedian", "\np95", "missed\n%", "false\n%",
    "found\n2 %, 3°", "clean\nnegatives", "nodes\nfound", "in 1 sigma\nrho theta", "ms",
    "paper: rho\nsim real", "theta\nsim real",
)  # fmt: skip


def print_table(dataset: Path, scores: dict[str, LineScore], count: int, console: Console) -> None:
    """Table II for people: errors, the paper's in the last columns."""
    lines = next(iter(scores.values())).labelled
    table = Table(title=f"{dataset}: {count} pictures, {lines} lines", title_justify="left")
    table.add_column("method")
    for name in _COLUMNS:
        table.add_column(name, justify="right")
    for method, score in scores.items():
        s = summary(score)
        simulated, real = PAPER[method]["simulation"], PAPER[method]["real"]
        table.add_row(
            method,
            *(_cell(s[f"rho_{key}_px"]) for key in ("mean", "median", "p95")),
            *(_cell(s[f"theta_{key}_deg"], 3) for key in ("mean", "median", "p95")),
            f"{100 * score.missed_part:.1f}",
            f"{100 * score.false_part:.1f}",
            f"{100 * score.found_part:.1f} %",
            f"{score.negatives_clean}/{score.negatives}",
            f"{score.nodes_named}/{score.nodes_labelled}",
            " ".join(_cell(s[f"within_sigma_{name}_part"]) for name in ("rho", "theta")),
            _cell(s["ms_median"]),
            f"{simulated[0]:.0f} {real[0]:.0f}",
            f"{simulated[1]:.0f} {real[1]:.0f}",
        )
    console.print(table)


def _cell(value: float | None, digits: int = 2) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
