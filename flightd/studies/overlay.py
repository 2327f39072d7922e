"""Lines and junctions drawn over the picture in which they were found."""

from __future__ import annotations

import math
from pathlib import Path

import cv2
import numpy as np

from flightd.core.errors import cannot_write
from flightd.core.types import Image, Junction, Line, LineKind, LineSet
from flightd.vision.training.labelled_frames import LabelledImage
from flightd.vision.training.line_score import PictureScore

_COLOURS = {LineKind.VERTICAL: (80, 220, 60), LineKind.HORIZONTAL: (255, 140, 40)}
_JUNCTION = (220, 60, 255)
_FALSE = (40, 40, 255)
_TRUTH = (255, 255, 255)
_SHADE = (24, 24, 24)
_SUBPIXEL_BITS = 4


def draw(bgr: Image, found: LineSet, title: str) -> Image:
    """A copy of the picture with each line's band, axis and numbers, each junction's arms, and a title."""
    canvas = bgr.copy()
    for line in found.lines:
        _band(canvas, line, _COLOURS[line.kind])
    for line in found.lines:
        _axis(canvas, line, _COLOURS[line.kind])
    taken = [_junction(canvas, junction) for junction in found.junctions]
    for line in found.lines:
        _tag(canvas, line, _COLOURS[line.kind], taken)
    _write(canvas, title, 0, 0, _TRUTH)
    return canvas


def draw_judged(path: Path, bgr: Image, label: LabelledImage, found: LineSet, judged: PictureScore) -> None:
    """Write the overlay of a picture that went wrong: labels white, missed ones dashed, false lines red."""
    missed = f"{len(judged.missed)} missed, {len(judged.false)} false"
    canvas = draw(bgr, found, f"{found.method}: {missed}")
    main = [line for line in label.lines if line.grade == "main"]
    for number in judged.false:
        _axis(canvas, found.lines[number], _FALSE)
    for number, line in enumerate(main):
        ends = np.array([(line.x1, line.y1), (line.x2, line.y2)])
        steps = max(int(line.length_px / (12 * _unit(canvas))), 2) if number in judged.missed else 1
        for step in range(0, steps, 2):
            start, end = (ends[0] + (ends[1] - ends[0]) * k / steps for k in (step, step + 1))
            cv2.line(canvas, _fixed(*start), _fixed(*end), _TRUTH, _unit(canvas), cv2.LINE_AA, _SUBPIXEL_BITS)
    write_picture(path, canvas)


def write_picture(path: Path, canvas: Image) -> None:
    """Write a JPEG or PNG by its suffix; InputError when the folder cannot be written."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _, data = cv2.imencode(path.suffix, canvas, [cv2.IMWRITE_JPEG_QUALITY, 90])
        path.write_bytes(data.tobytes())
    except OSError as err:
        raise cannot_write(path, err) from err


def _unit(canvas: Image) -> int:
    """Stroke width that looks the same in every size of picture."""
    height, width = canvas.shape[:2]
    return int(max((min(width, height) + 180) // 360, 1))


def _centre(canvas: Image) -> tuple[float, float]:
    return (canvas.shape[1] - 1) / 2, (canvas.shape[0] - 1) / 2


def _fixed(x: float, y: float) -> tuple[int, int]:
    """Pixel coordinates in OpenCV's fixed point."""
    return round(x * (1 << _SUBPIXEL_BITS)), round(y * (1 << _SUBPIXEL_BITS))


def _ends(canvas: Image, line: Line) -> tuple[tuple[float, float], tuple[float, float]]:
    cx, cy = _centre(canvas)
    (x1, y1), (x2, y2) = line.point_at(line.start_px), line.point_at(line.end_px)
    return (x1 + cx, y1 + cy), (x2 + cx, y2 + cy)


def _band(canvas: Image, line: Line, colour: tuple[int, int, int]) -> None:
    """The painted band: shaded inside, its two edges drawn."""
    first, second = _ends(canvas, line)
    dx, dy = line.width_px / 2 * math.cos(line.theta_rad), line.width_px / 2 * math.sin(line.theta_rad)
    corners = [
        (first[0] + dx, first[1] + dy),
        (second[0] + dx, second[1] + dy),
        (second[0] - dx, second[1] - dy),
        (first[0] - dx, first[1] - dy),
    ]
    points = np.array([_fixed(*corner) for corner in corners], np.int32)
    shade = canvas.copy()
    cv2.fillPoly(shade, [points], colour, cv2.LINE_AA, _SUBPIXEL_BITS)
    cv2.addWeighted(shade, 0.3, canvas, 0.7, 0.0, canvas)
    cv2.polylines(canvas, [points], True, colour, _unit(canvas), cv2.LINE_AA, _SUBPIXEL_BITS)


def _axis(canvas: Image, line: Line, colour: tuple[int, int, int]) -> None:
    first, second = (_fixed(*end) for end in _ends(canvas, line))
    unit = _unit(canvas)
    shade = 3 * unit if line.width_px > 8 * unit else unit  # a thin band must still be seen beside it
    cv2.line(canvas, first, second, _SHADE, shade, cv2.LINE_AA, _SUBPIXEL_BITS)
    cv2.line(canvas, first, second, colour, unit, cv2.LINE_AA, _SUBPIXEL_BITS)


def _junction(canvas: Image, junction: Junction) -> tuple[int, int, int, int]:
    """Draw it; returns the box of its name (left, top, width, height)."""
    cx, cy = _centre(canvas)
    x, y, unit = junction.x_px + cx, junction.y_px + cy, _unit(canvas)
    for width, colour in ((4 * unit, _SHADE), (2 * unit, _JUNCTION)):
        for arm in junction.arms_rad:
            tip = (x + 18 * unit * math.cos(arm), y + 18 * unit * math.sin(arm))
            cv2.line(canvas, _fixed(x, y), _fixed(*tip), colour, width, cv2.LINE_AA, _SUBPIXEL_BITS)
    cv2.circle(canvas, _fixed(x, y), (5 * unit) << _SUBPIXEL_BITS, _SHADE, -1, cv2.LINE_AA, _SUBPIXEL_BITS)
    cv2.circle(canvas, _fixed(x, y), (4 * unit) << _SUBPIXEL_BITS, _JUNCTION, -1, cv2.LINE_AA, _SUBPIXEL_BITS)
    name, left, top = junction.kind.value, round(x) + 8 * unit, round(y) + 6 * unit
    _write(canvas, name, left, top, _JUNCTION)
    return left, top, *_extent(canvas, name)


def _tag(
    canvas: Image, line: Line, colour: tuple[int, int, int], taken: list[tuple[int, int, int, int]]
) -> None:
    """The line's numbers beside its visible middle, moved along the line until they hide no other's."""
    cx, cy = _centre(canvas)
    text = f"{line.rho_px:+.1f} px  {math.degrees(line.theta_rad):.1f} deg  w {line.width_px:.0f}"
    width, height = _extent(canvas, text)
    for share in (0.5, 0.35, 0.65, 0.2, 0.8, 0.05, 0.95):
        x, y = line.point_at(line.start_px + share * line.span_px)
        left = min(max(round(x + cx), 0), canvas.shape[1] - width)
        top = min(max(round(y + cy), height), canvas.shape[0] - height)
        if all(left > b[0] + b[2] or b[0] > left + width or abs(top - b[1]) > height for b in taken):
            break
    taken.append((left, top, width, height))
    _write(canvas, text, left, top, colour)


def _font(canvas: Image) -> tuple[int, float]:
    return cv2.FONT_HERSHEY_SIMPLEX, max(0.42 * min(canvas.shape[:2]) / 360, 0.3)


def _extent(canvas: Image, text: str) -> tuple[int, int]:
    face, scale = _font(canvas)
    (width, height), below = cv2.getTextSize(text, face, scale, _unit(canvas))
    return width + height, height + below + height // 2


def _write(canvas: Image, text: str, left: int, top: int, colour: tuple[int, int, int]) -> None:
    """Text on a dark plate whose top left corner is (left, top)."""
    face, scale = _font(canvas)
    width, height = _extent(canvas, text)
    plate = canvas[max(top, 0) : max(top + height, 0), max(left, 0) : max(left + width, 0)]
    plate[:] = plate // 4
    (_, ascent), _ = cv2.getTextSize(text, face, scale, _unit(canvas))
    origin = (left + ascent // 2, top + ascent + ascent // 3)
    cv2.putText(canvas, text, origin, face, scale, colour, _unit(canvas), cv2.LINE_AA)
