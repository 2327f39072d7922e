"""Lines in images, folders and videos, as numbers and as pictures."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

from rich.console import Console
from rich.table import Table

from flightd.core.errors import InputError
from flightd.core.types import LineSet
from flightd.studies.frame_files import all_pictures
from flightd.studies.overlay import draw, write_picture
from flightd.vision.line_detector import Detector


@dataclass(frozen=True, slots=True)
class Found:
    """What was seen in one picture, and how long it took."""

    name: str
    ms: float
    lines: LineSet


def detect(paths: Sequence[Path], method: str, profile: str, overlay: Path | None) -> Iterator[Found]:
    """Every picture that `paths` mean, in order; overlays are written as they are made."""
    detector = Detector(method, profile)
    names: set[str] = set()
    for picture in all_pictures(paths, "detecting"):
        start = perf_counter()
        try:
            found = detector.detect(picture.bgr)
        except InputError as err:
            raise InputError(str(err), file=picture.name) from err
        ms = (perf_counter() - start) * 1e3
        if overlay:
            title = f"{method}, {detector.profile.name}: {len(found.lines)} lines, {ms:.1f} ms"
            target = overlay / f"{_stem(picture.name, names)}.jpg"
            write_picture(target, draw(picture.bgr, found, title))
        yield Found(picture.name, ms, found)


def _stem(name: str, taken: set[str]) -> str:
    """A file name for a picture's overlay: its own, numbered if another picture had the same."""
    file, _, frame = name.partition("#")
    stem = Path(file).stem + (f"-{int(frame):06d}" if frame.isdecimal() else "")
    unique, number = stem, 2
    while unique in taken:
        unique, number = f"{stem}-{number}", number + 1
    taken.add(unique)
    return unique


def as_json(found: Sequence[Found]) -> str:
    """The one JSON document of `flightd detect --json`: rho about the image centre, points from top left."""
    return json.dumps({"images": [_image(entry) for entry in found]}, indent=1)


def _image(entry: Found) -> dict[str, object]:
    seen = entry.lines
    cx, cy = (seen.width_px - 1) / 2, (seen.height_px - 1) / 2
    lines = []
    for line in seen.lines:
        (x1, y1), (x2, y2) = line.point_at(line.start_px), line.point_at(line.end_px)
        lines.append(
            {
                "rho_px": round(line.rho_px, 3),
                "theta_deg": round(math.degrees(line.theta_rad), 4),
                "x1": round(x1 + cx, 3),
                "y1": round(y1 + cy, 3),
                "x2": round(x2 + cx, 3),
                "y2": round(y2 + cy, 3),
                "width_px": round(line.width_px, 3),
                "kind": line.kind.value,
                "support": round(line.support, 3),
                "sigma_rho_px": round(line.sigma_rho_px, 4),
                "sigma_theta_deg": round(math.degrees(line.sigma_theta_rad), 5),
            }
        )
    return {
        "path": entry.name,
        "width": seen.width_px,
        "height": seen.height_px,
        "ms": round(entry.ms, 3),
        "lines": lines,
        "junctions": [
            {"x": round(j.x_px + cx, 2), "y": round(j.y_px + cy, 2), "kind": j.kind.value}
            for j in seen.junctions
        ],
    }


def print_found(entry: Found, console: Console) -> None:
    """One picture for people."""
    seen = entry.lines
    title = f"{entry.name}  {seen.width_px}x{seen.height_px}  {entry.ms:.1f} ms"
    console.print(title, style="bold", highlight=False, markup=False, soft_wrap=True)
    if not seen.lines:
        console.print("  no line")
        return
    table = Table(box=None)
    for name in ("kind", "rho px", "theta °", "width px", "span px", "± px", "± °"):
        table.add_column(name, justify="left" if name == "kind" else "right")
    for line in seen.lines:
        table.add_row(
            line.kind.value,
            f"{line.rho_px:+.2f}",
            f"{math.degrees(line.theta_rad):.3f}",
            f"{line.width_px:.1f}",
            f"{line.span_px:.0f}",
            f"{line.sigma_rho_px:.2f}",
            f"{math.degrees(line.sigma_theta_rad):.3f}",
        )
    console.print(table)
    cx, cy = (seen.width_px - 1) / 2, (seen.height_px - 1) / 2
    for j in seen.junctions:
        console.print(f"  {j.kind.value} at ({j.x_px + cx:.1f}, {j.y_px + cy:.1f})", highlight=False)
