"""Labelled pictures: a folder of images with one `labels.json`.

The format is meant for hand-labelled photographs and generated frames alike:

    {"images": [{
        "file": "a.jpg", "width": 1920, "height": 1080,
        "line_colour": "yellow",     the profile to use; "none" or absent: not told
        "complete": true,            every line-like marking is labelled: other detections are false
        "negative": false,           shows no line at all
        "lines": [{"x1": 0.0, "y1": 188.5, "x2": 102.4, "y2": 120.4,
                   "thickness": 11.5,
                   "grade": "main",  "main" must be found, "minor" may be found or not
                   "uncert_px": 0.8, "uncert_deg": 0.7}],
        "nodes": [{"x": 231.2, "y": 157.1, "kind": "+"}],      "+", "T", "L", "end", "bend"
        "mask": "a-mask.png",        white paint, black floor, grey not told (for training)
        "regions": [                 paint and floor shown by hand (for training)
            {"paint": true, "box": [x, y, width, height]},
            {"paint": false, "stroke": [[x, y], [x, y]], "width": 12}]}]}

Coordinates are pixels with the origin at the centre of the top-left pixel, x right, y down.  A line is
the bisector of its two visible edges, from where it enters the picture to where it leaves it or ends.
One that something hides in the middle may be labelled as two stretches, each with its thickness; one
detection finds both.
Only `file` is required; other keys are ignored, so a labeller may keep notes beside these.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Literal

import msgspec

from flightd.core.errors import InputError
from flightd.core.geometry import normalise_line

LABELS_NAME = "labels.json"

Grade = Literal["main", "minor"]
NodeKind = Literal["+", "T", "L", "end", "bend"]


class LabelledLine(msgspec.Struct, frozen=True, kw_only=True):
    """One visible line by the ends of its centre line."""

    x1: float
    y1: float
    x2: float
    y2: float
    thickness: float = 0.0
    grade: Grade = "main"
    uncert_px: float = 0.0
    uncert_deg: float = 0.0

    def hessian(self, width: int, height: int) -> tuple[float, float]:
        """(rho_px, theta_rad) about the centre of a width x height picture, theta in [0, pi)."""
        theta = math.atan2(self.x2 - self.x1, self.y1 - self.y2)
        x, y = (self.x1 + self.x2) / 2 - (width - 1) / 2, (self.y1 + self.y2) / 2 - (height - 1) / 2
        return normalise_line(x * math.cos(theta) + y * math.sin(theta), theta)

    @property
    def length_px(self) -> float:
        return math.hypot(self.x2 - self.x1, self.y2 - self.y1)


class LabelledNode(msgspec.Struct, frozen=True, kw_only=True):
    """A crossing, tee, corner, line end or slight bend."""

    x: float
    y: float
    kind: NodeKind


class LabelledRegion(msgspec.Struct, frozen=True, kw_only=True):
    """A box (x, y, width, height) or a stroke of `width` pixels that shows paint, or shows none."""

    paint: bool
    box: tuple[float, float, float, float] | None = None
    stroke: list[tuple[float, float]] = []
    width: float = 1.0


class LabelledImage(msgspec.Struct, frozen=True, kw_only=True):
    """What a picture shows.  `file` is relative to the dataset's folder."""

    file: str
    width: int = 0
    height: int = 0
    line_colour: str = "none"
    complete: bool = False
    negative: bool = False
    lines: list[LabelledLine] = []
    nodes: list[LabelledNode] = []
    mask: str = ""
    regions: list[LabelledRegion] = []
    tags: list[str] = []


class Labels(msgspec.Struct, frozen=True, kw_only=True):
    """The content of one `labels.json`; `about` is free for the labeller's own words."""

    images: list[LabelledImage]
    about: dict[str, object] = {}


def read_labels(dataset: Path) -> tuple[Path, Labels]:
    """The folder and labels of `dataset`, a folder with a `labels.json` or that file itself.

    Raises InputError naming the file and the key when it is missing, malformed or has no images.
    """
    path = dataset / LABELS_NAME if dataset.is_dir() else dataset
    try:
        labels = msgspec.json.decode(path.read_bytes(), type=Labels)
    except OSError as err:
        raise InputError(f"{path}: {err.strerror}; a dataset is a folder with a {LABELS_NAME}") from err
    except (msgspec.DecodeError, UnicodeDecodeError) as err:
        raise InputError(f"{path}: {err}; see `flightd evaluate --help` for the format") from err
    if not labels.images:
        raise InputError(f"{path}: key `images` is empty; nothing to work on")
    return path.parent, labels


def write_labels(folder: Path, labels: Labels) -> None:
    """Write `labels.json` into a folder."""
    (folder / LABELS_NAME).write_text(labels_text(labels))


def labels_text(labels: Labels) -> str:
    """The content of `labels.json`, one line to an image, lengths to a ten-thousandth of a pixel."""
    rows = [msgspec.json.encode(_rounded(msgspec.to_builtins(image))).decode() for image in labels.images]
    about = msgspec.json.encode(labels.about).decode()
    return f'{{"about": {about},\n"images": [\n' + ",\n".join(rows) + "\n]}\n"


def _rounded(value: object) -> object:
    if isinstance(value, float):
        return round(value, 4)
    if isinstance(value, dict):
        return {key: _rounded(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(entry) for entry in value]
    return value
