"""Labels with printed lines, drawn as a camera sees them: fonts, tilt, blur, glare, contrast, noise."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from PIL import Image as Picture
from PIL import ImageDraw, ImageFont

from flightd.core.types import Image

_PAPER, _INK, _RACK = 235, 20, 90
_FINER: Final = 4
"""Drawn so many times larger than it is seen."""
_STROKES: Final = {
    "simplex": cv2.FONT_HERSHEY_SIMPLEX,
    "duplex": cv2.FONT_HERSHEY_DUPLEX,
    "complex": cv2.FONT_HERSHEY_COMPLEX,
}
_STROKE_CAP: Final = 21
_SYSTEM: Final = "/usr/share/fonts/truetype/dejavu/DejaVu"
_FILES: Final = ("Sans", "Sans-Bold", "Serif", "SansMono", "SansCondensed")


def fonts() -> list[str]:
    """Names of the fonts that are here: a sans of Pillow's own, three of strokes, the system's DejaVu."""
    return ["aileron", *_STROKES, *(name for name in _FILES if Path(f"{_SYSTEM}{name}.ttf").exists())]


@dataclass(frozen=True, slots=True)
class Seen:
    """How a label is seen.  `yaw_deg` turns it about its upright, `roll_deg` in the picture; `motion_px` and
    `blur_px` are length and sigma of the blur, `glare` the light of a spot in grey levels, `contrast` what is
    left of it, `noise` a standard deviation."""

    yaw_deg: float = 0.0
    roll_deg: float = 0.0
    motion_px: float = 0.0
    blur_px: float = 0.0
    glare: float = 0.0
    contrast: float = 1.0
    noise: float = 2.0

    @classmethod
    def drawn(cls, rng: np.random.Generator, cap_px: int) -> Seen:
        """Anything that a flight may see: up to 30 degrees aside, blur of an eighth of a capital."""
        return cls(
            yaw_deg=float(rng.uniform(-30, 30)),
            roll_deg=float(rng.uniform(-4, 4)),
            motion_px=float(rng.uniform(0, cap_px / 8)),
            blur_px=float(rng.uniform(0, cap_px / 14)),
            glare=float(rng.choice((0, 0, 80, 160))),
            contrast=float(rng.uniform(0.35, 1)),
            noise=float(rng.uniform(1, 8)),
        )


def label(lines: Sequence[str], font: str, cap_px: int, seen: Seen, rng: np.random.Generator) -> Image:
    """(H, W, 3) BGR: a label with these lines, its capitals `cap_px` high, before something darker."""
    drawn = [_line(text, font, cap_px * _FINER) for text in lines]
    width = max(line.shape[1] for line in drawn)
    paper = [np.pad(line, ((0, 0), (0, width - line.shape[1])), constant_values=_PAPER) for line in drawn]
    small = _turned(np.vstack(paper), seen)
    seen_as = _lit(_blurred(small, seen), cap_px, seen, rng)
    around = np.pad(seen_as, 20, constant_values=_RACK)
    return np.asarray(cv2.cvtColor(around, cv2.COLOR_GRAY2BGR), np.uint8)


def _line(text: str, font: str, cap: int) -> Image:
    """One line with room of a capital's height on all sides."""
    if font in _STROKES:
        scale, thick = cap / _STROKE_CAP, max(1, round(cap / 10))
        (width, height), below = cv2.getTextSize(text, _STROKES[font], scale, thick)
        paper = np.full((height + below + 2 * cap, width + 2 * cap), _PAPER, np.uint8)
        cv2.putText(paper, text, (cap, cap + height), _STROKES[font], scale, _INK, thick, cv2.LINE_AA)
        return paper
    _, top, _, bottom = _font(font, 100.0).getbbox("H")
    face = _font(font, 100.0 * cap / (bottom - top))
    _, _, right, low = face.getbbox(text)
    paper_of = Picture.new("L", (int(right) + 2 * cap, int(low) + 2 * cap), _PAPER)
    ImageDraw.Draw(paper_of).text((cap, cap), text, fill=_INK, font=face)
    return np.asarray(paper_of, np.uint8)


def _font(name: str, size: float) -> Any:
    return (
        ImageFont.load_default(size)
        if name == "aileron"
        else ImageFont.truetype(f"{_SYSTEM}{name}.ttf", size)
    )


def _turned(paper: Image, seen: Seen) -> Image:
    height, width = paper.shape
    yaw, roll = math.radians(seen.yaw_deg), math.radians(seen.roll_deg)
    narrow, taper = width * (1 - math.cos(yaw)), height * 0.15 * math.tan(yaw)
    flat = np.array([[0, 0], [width, 0], [width, height], [0, height]], np.float32)
    aside = flat + np.array([[0, 0], [-narrow, taper], [-narrow, -taper], [0, 0]], np.float32)
    room = int(width * abs(math.sin(roll)) / 2) + 4
    turn = np.vstack([cv2.getRotationMatrix2D((width / 2, height / 2 + room), seen.roll_deg, 1.0), [0, 0, 1]])
    down = np.array([[1, 0, 0], [0, 1, room], [0, 0, 1]], np.float64)
    whole = turn @ down @ cv2.getPerspectiveTransform(flat, aside.astype(np.float32))
    large = cv2.warpPerspective(paper, whole, (width, height + 2 * room), borderValue=_PAPER)
    part = 1 / _FINER
    return np.asarray(cv2.resize(large, None, fx=part, fy=part, interpolation=cv2.INTER_AREA), np.uint8)


def _blurred(picture: Image, seen: Seen) -> Image:
    out = picture
    if seen.motion_px >= 1.0:
        length = round(seen.motion_px) + 1
        out = np.asarray(cv2.blur(out, (length, 1)), np.uint8)
    return np.asarray(cv2.GaussianBlur(out, (0, 0), seen.blur_px), np.uint8) if seen.blur_px > 0.1 else out


def _lit(picture: Image, cap_px: int, seen: Seen, rng: np.random.Generator) -> Image:
    light = _PAPER - (_PAPER - picture.astype(np.float64)) * seen.contrast
    height, width = picture.shape
    y, x = np.mgrid[:height, :width]
    at_x, at_y = rng.uniform(0, width), rng.uniform(0, height)
    spot = np.exp(-(((x - at_x) / (3 * cap_px)) ** 2) - ((y - at_y) / (1.2 * cap_px)) ** 2)
    noisy = light + seen.glare * spot + rng.normal(0, seen.noise, light.shape)
    return np.asarray(np.clip(noisy, 0, 255), np.uint8)
